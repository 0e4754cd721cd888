#include "base/status.h"

#include <algorithm>
#include <numeric>

namespace kpsa::engine {

std::string SourceLocation::ToString() const {
  if (line <= 0) return file;
  if (column <= 0) return fmt::format("{}:{}", file, line);
  return fmt::format("{}:{}:{}", file, line, column);
}

std::string Error::ToString() const {
  const std::string place = where.ToString();
  return place.empty() ? message : place + ": " + message;
}

Status Status::Make(ErrorKind kind, std::string message) {
  Status status;
  status.errors_.emplace_back();
  status.errors_.back().kind = kind;
  status.errors_.back().message = std::move(message);
  return status;
}

void Status::Append(Status other) {
  for (Error& error : other.errors_) errors_.push_back(std::move(error));
}

Status Status::At(const SourceLocation& where) && {
  for (Error& error : errors_) {
    if (error.where.file.empty()) error.where = where;
  }
  return std::move(*this);
}

Status Status::OfNode(std::string_view node) && {
  for (Error& error : errors_) {
    if (error.node.empty()) error.node = node;
  }
  return std::move(*this);
}

std::string Status::ToString() const {
  std::string text;
  for (const Error& error : errors_) {
    if (!text.empty()) text += '\n';
    text += error.ToString();
  }
  return text;
}

namespace {

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

std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.size() > 256) return "";
  const std::size_t limit = std::max<std::size_t>(1, word.size() / 3);
  std::size_t best = limit + 1;
  const std::string* nearest = nullptr;
  const std::string lower = Lower(word);
  for (const std::string& candidate : candidates) {
    const std::size_t distance = EditDistance(lower, Lower(candidate), limit);
    if (distance < best) {
      best = distance;
      nearest = &candidate;
    }
  }
  return nearest == nullptr ? "" : fmt::format(" (did you mean \"{}\"?)", *nearest);
}

}  // namespace kpsa::engine
