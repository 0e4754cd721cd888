// Errors that a rig author or a user causes: collected, each with its place and a suggestion.
// Errors of a programmer are in base/check.h. No function of this project throws across a room's border.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
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

// What somebody may have meant who wrote a wrong name: a part of a message that keeps its meaning (Error::suggestion).
struct Suggestion {
  std::string words;      // "did you mean "rotateX"?"; "" where nothing is near
  std::string otherwise;  // said then
  bool empty() const { return words.empty(); }
  std::string ToString() const { return words.empty() ? otherwise : " (" + words + ")"; }
};

struct Error {
  ErrorKind kind = ErrorKind::kInvalidInput;
  SourceLocation where;
  std::string message;    // one sentence: what is wrong, what was expected, what to do; at most five lines
  std::string node = {};  // that it is about, by its name in the graph; "" if none
  std::string suggestion =
      {};  // Suggestion::words, where the message ends or goes on with " (" + suggestion + ")"
  std::string ToString() const;  // "rig.yaml:41:7: message"
};

// Success, or one or more errors. Cheap to move; a success allocates nothing.
class [[nodiscard]] Status {
 public:
  Status() = default;
  explicit Status(Error error) { errors_.push_back(std::move(error)); }

  template <typename... Args>
  static Status Invalid(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kInvalidInput, fmt::vformat(format, fmt::make_format_args(args...)),
                WordsAmong(args...));
  }
  template <typename... Args>
  static Status Usage(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kUsage, fmt::vformat(format, fmt::make_format_args(args...)), WordsAmong(args...));
  }
  template <typename... Args>
  static Status Evaluation(fmt::format_string<Args...> format, Args&&... args) {
    return Make(ErrorKind::kEvaluation, fmt::vformat(format, fmt::make_format_args(args...)),
                WordsAmong(args...));
  }

  static Status Make(ErrorKind kind, std::string message, std::string suggestion = {});

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
  // Of the suggestion among the parts of a message; "" if there is none.
  template <typename... Args>
  static std::string WordsAmong(const Args&... args) {
    std::string words;
    [[maybe_unused]] const auto look = [&](const auto& arg) {
      if constexpr (std::is_same_v<std::decay_t<decltype(arg)>, Suggestion>) words = arg.words;
    };
    (look(args), ...);
    return words;
  }

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

// "did you mean "envelope"?" for the nearest of the candidates, if one is near.
Suggestion DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace kpsa::engine

// In a message: " (did you mean "envelope"?)".
template <>
struct fmt::formatter<kpsa::engine::Suggestion> : fmt::formatter<std::string_view> {
  template <typename Context>
  auto format(const kpsa::engine::Suggestion& suggestion, Context& context) const {
    return fmt::formatter<std::string_view>::format(suggestion.ToString(), context);
  }
};

#define KPSA_RETURN_IF_ERROR(expression)                                                          \
  do {                                                                                            \
    if (::kpsa::engine::Status kpsa_status = (expression); !kpsa_status.ok()) return kpsa_status; \
  } while (false)
