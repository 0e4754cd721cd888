// A value, or all that is wrong with what was asked for. Errors are values; nothing of kpsa throws.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace kpsa {

// One thing that is wrong.
struct Problem {
  enum class Kind { kUsage, kInput, kEvaluation, kFailedCheck, kInterrupted };
  Kind kind = Kind::kInput;
  std::string file;           // where it stands; "" where it is of no file
  int line = 0, column = 0;   // counted from 1; 0: unknown
  std::string message;        // one sentence: what is wrong, what was expected, what to do
  std::string node;           // the node that it is about; "" if none. Not to be parsed out of `message`
  std::string where() const;  // "face.yaml:41:7", a file, or ""
};
using Problems = std::vector<Problem>;  // in the order of their places

std::string ToText(const Problems& problems);  // "where: message", one a line

template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}                  // NOLINT: implicit by design
  Result(Problems problems) : problems_(std::move(problems)) {}  // NOLINT: at least one
  explicit operator bool() const { return value_.has_value(); }
  // Of a result that is true.
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }
  const Problems& problems() const { return problems_; }  // none where there is a value

 private:
  std::optional<T> value_;
  Problems problems_;
};

struct Done {};  // of what gives no value

}  // namespace kpsa
