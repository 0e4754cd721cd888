#include "base/near_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostNear = 4, kMostListed = 12;

constexpr std::size_t kMostEdits = 8;  // of long words

// Edit distance with transpositions, over bytes. It gives up beyond a limit, so that a word costs no more than its length
// times that limit: files may name as many wrong ones as they like.
class EditDistance {
 public:
  // limit + 1 where it is larger than `limit`.
  std::size_t operator()(std::string_view a, std::string_view b, std::size_t limit) {
    if (a.size() > b.size() + limit || b.size() > a.size() + limit) return limit + 1;
    const std::size_t beyond = limit + 1;
    for (auto* row : {&before_, &last_, &row_}) row->assign(b.size() + 1, beyond);
    for (std::size_t j = 0; j <= std::min(b.size(), limit); ++j) last_[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
      const std::size_t begin = i > limit ? i - limit : 0, end = std::min(b.size(), i + limit);
      std::size_t least = beyond;
      if (begin == 0)
        least = row_[0] = std::min(i, beyond);
      else
        row_[begin - 1] = beyond;
      for (std::size_t j = std::max<std::size_t>(begin, 1); j <= end; ++j) {
        std::size_t edits =
            std::min({last_[j] + 1, row_[j - 1] + 1, last_[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
        if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
          edits = std::min(edits, before_[j - 2] + 1);
        row_[j] = std::min(edits, beyond);
        least = std::min(least, row_[j]);
      }
      if (end < b.size()) row_[end + 1] = beyond;
      if (least == beyond && i > 1 && least_before_ == beyond)
        return beyond;  // a transposition reaches over one row
      least_before_ = least;
      std::swap(before_, last_);
      std::swap(last_, row_);
    }
    return last_[b.size()];
  }

 private:
  std::vector<std::size_t> before_, last_, row_;
  std::size_t least_before_ = 0;
};

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
  std::size_t best = std::clamp<std::size_t>(word.size() / 3, 1, kMostEdits);
  const std::string lower = Lower(word);
  EditDistance edits;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edits(lower, Lower(candidate), best);
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
