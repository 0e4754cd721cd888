// A formula over numbers in0, in1, ..., compiled to a program. muParser reads it, and is not there any more
// when it runs: a parser is no object for several threads, and calls the C library's functions, whose bits
// differ between versions. A program is immutable; any number of threads may run it.
//
// Numbers with a decimal point whatever the locale; + - * / ^, comparisons, && ||, ? :, and sin cos tan asin
// acos atan atan2 sqrt exp log pow abs floor ceil round sign fmod min max clamp(x, lo, hi) smoothstep(lo, hi,
// x) linstep(lo, hi, x), in radians; pi and e.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

class Expression {
 public:
  static constexpr std::size_t kMaxLength = 4096;
  // Errors: what is wrong and at which character (from 1); a name that is none of the inputs.
  static Result<Expression> Compile(const std::string& text, std::size_t inputs);
  std::size_t stack_size() const { return stack_size_; }
  // `inputs` as many as it was compiled for; `stack` of stack_size().
  double Run(std::span<const double> inputs, std::span<double> stack) const noexcept;

 private:
  friend class ExpressionReader;
  enum class Kind : unsigned char { kNumber, kInput, kOperator, kCall, kJumpIfZero, kJump, kNothing };
  struct Step {
    Kind kind = Kind::kNothing;
    double number = 0;
    std::size_t index = 0;  // of an input; which operator; how far to jump
    int arguments = 0;      // negative: any number of them, that many are there
    void (*function)() = nullptr;
  };
  std::vector<Step> steps_;
  std::size_t stack_size_ = 0;
};

}  // namespace kpsa::engine
