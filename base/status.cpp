#include "base/status.h"

#include "base/near_names.h"

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

Status Status::Make(ErrorKind kind, std::string message, std::string suggestion) {
  Status status;
  status.errors_.emplace_back();
  status.errors_.back().kind = kind;
  status.errors_.back().message = std::move(message);
  status.errors_.back().suggestion = std::move(suggestion);
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

Suggestion DidYouMean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::vector<std::string> near = NearNames(word, candidates);
  if (near.empty()) return {};
  return {fmt::format("did you mean \"{}\"?", near.front()), ""};
}

}  // namespace kpsa::engine
