#include "base/near_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostNear = 4, kMostListed = 12;

// Edit distance with transpositions, over bytes; gives up beyond `limit`.
std::size_t EditDistance(std::string_view a, std::string_view b, std::size_t limit) {
  if (a.size() > b.size() + limit || b.size() > a.size() + limit) return limit + 1;
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace

std::vector<std::string> NearNames(std::string_view word, const std::vector<std::string>& candidates) {
  std::vector<std::string> near;
  if (word.size() > 256) return near;
  const std::size_t limit = std::max<std::size_t>(1, word.size() / 3);
  std::size_t best = limit;
  const std::string lower = Lower(word);
  for (const std::string& candidate : candidates) {
    const std::size_t distance = EditDistance(lower, Lower(candidate), limit);
    if (distance > best) continue;
    if (distance < best) near.clear();
    best = distance;
    if (std::find(near.begin(), near.end(), candidate) == near.end()) near.push_back(candidate);
  }
  return near;
}

Suggestion NearOrAll(std::string_view word, const std::vector<std::string>& candidates,
                     const std::vector<std::string>& all) {
  std::vector<std::string> near = NearNames(word, candidates);
  if (near.empty()) {
    if (all.empty()) return {};
    const auto shown = all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kMostListed));
    const std::string list = fmt::format("; there is {}", fmt::join(all.begin(), shown, ", "));
    return {"",
            all.size() <= kMostListed ? list : fmt::format("{} and {} more", list, all.size() - kMostListed)};
  }
  near.resize(std::min(near.size(), kMostNear));
  for (std::string& name : near) name = "\"" + name + "\"";
  const std::string last = near.back();
  near.pop_back();
  if (near.empty()) return {fmt::format("did you mean {}?", last), ""};
  return {fmt::format("did you mean {} or {}?", fmt::join(near, ", "), last), ""};
}

}  // namespace kpsa::engine
