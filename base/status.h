// Errors that a rig author or a user causes: collected, each with its place and a suggestion.
// Errors of a programmer are in base/check.h. No function of this project throws across a room's border.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kpsa::engine {

// What kind of failure; the command line maps it to an exit code.
enum class ErrorKind : std::uint8_t {
  kUsage,         // the arguments of the command line: exit 2
  kInvalidInput,  // a file or its content: exit 3
  kEvaluation,    // a node failed while it computed: exit 4
  kDiffers,       // a check failed or two things differ: exit 1
  kInterrupted,   // the user stopped it: exit 130
};

// A place in a text file. line and column count from 1; 0 means unknown.
struct SourceLocation {
  std::string file;
  int line = 0;
  int column = 0;
  std::string ToString() const;  // "rig.yaml:41:7", "rig.yaml" or ""
};

struct Error {
  ErrorKind kind = ErrorKind::kInvalidInput;
  SourceLocation where;
  std::string message;  // one sentence: what is wrong, what was expected, what to do; at most five lines
  std::string node = {};  // that it is about, by its name in the graph; "" if none
  std::string ToString() const;  // "rig.yaml:41:7: message"
};

// Success, or one or more errors. Cheap to move; a success allocates nothing.
class [[nodiscard]] Status {
 public:
  Status() = default;
  explicit Status(Error error) { errors_.push_back(std::move(error)); }

  template <typename... Args>
  static Status Invalid(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kInvalidInput, fmt::format(format, std::forward<Args>(args)...));
  }
  template <typename... Args>
  static Status Usage(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kUsage, fmt::format(format, std::forward<Args>(args)...));
  }
  template <typename... Args>
  static Status Evaluation(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kEvaluation, fmt::format(format, std::forward<Args>(args)...));
  }

  static Status Make(ErrorKind kind, std::string message);

  bool ok() const { return errors_.empty(); }
  const std::vector<Error>& errors() const { return errors_; }
  ErrorKind kind() const { return errors_.empty() ? ErrorKind::kInvalidInput : errors_.front().kind; }
  void Add(Error error) { errors_.push_back(std::move(error)); }
  void Append(Status other);  // takes over the other's errors
  // The same errors, with a place for those that have none.
  Status At(const SourceLocation& where) &&;
  // Likewise with a node.
  Status OfNode(std::string_view node) &&;
  std::string ToString() const;  // one error a line

 private:
  std::vector<Error> errors_;
};

// A value or the errors that prevented it.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}          // NOLINT: implicit by design
  Result(Status status) : status_(std::move(status)) {}  // NOLINT: implicit by design
  bool ok() const { return value_.has_value(); }
  const Status& status() const { return status_; }
  T& value() { return *value_; }
  const T& value() const { return *value_; }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }

 private:
  std::optional<T> value_;
  Status status_;
};

// " (did you mean "envelope"?)" for the nearest of the candidates, or "" if none is near.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace kpsa::engine

#define KPSA_RETURN_IF_ERROR(expression)                                                  \
  do {                                                                                    \
    if (::kpsa::engine::Status kpsa_status = (expression); !kpsa_status.ok()) return kpsa_status; \
  } while (false)
