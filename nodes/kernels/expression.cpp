#include "nodes/kernels/expression.h"

#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "base/scalar_math.h"
#include "nodes/kernels/power.h"

namespace kpsa::engine {
namespace {

double Tangent(double x) { return Sin(x) / Cos(x); }
double Arctangent(double x) { return Atan2(x, 1); }
double Sqrt(double x) { return std::sqrt(x); }
double Abs(double x) { return std::fabs(x); }
double Floor(double x) { return std::floor(x); }
double Ceil(double x) { return std::ceil(x); }
double Round(double x) { return std::floor(x + 0.5); }
double Sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }
double Modulo(double x, double y) { return std::fmod(x, y); }
double ClampTo(double x, double low, double high) { return std::min(std::max(x, low), high); }
double LinearStep(double low, double high, double x) {
  return high == low ? (x < low ? 0 : 1) : ClampTo((x - low) / (high - low), 0, 1);
}
double SmoothStep(double low, double high, double x) { return Smoothstep(LinearStep(low, high, x)); }
double Least(const double* values, int count) { return *std::min_element(values, values + count); }
double Greatest(const double* values, int count) { return *std::max_element(values, values + count); }
double Negative(double x) { return -x; }
double Same(double x) { return x; }

double Operate(std::size_t code, double a, double b) {
  switch (code) {
    case mu::cmLE:
      return a <= b ? 1 : 0;
    case mu::cmGE:
      return a >= b ? 1 : 0;
    case mu::cmNEQ:
      return a != b ? 1 : 0;
    case mu::cmEQ:
      return a == b ? 1 : 0;
    case mu::cmLT:
      return a < b ? 1 : 0;
    case mu::cmGT:
      return a > b ? 1 : 0;
    case mu::cmADD:
      return a + b;
    case mu::cmSUB:
      return a - b;
    case mu::cmMUL:
      return a * b;
    case mu::cmDIV:
      return a / b;
    case mu::cmPOW:
      return Power(a, b);
    case mu::cmLAND:
      return a != 0 && b != 0 ? 1 : 0;
    default:  // cmLOR: no other one is compiled
      return a != 0 || b != 0 ? 1 : 0;
  }
}

// Only what is defined here: muParser's own functions are the C library's.
class FormulaParser : public mu::ParserBase {
 public:
  explicit FormulaParser(std::vector<double>* inputs) {
    InitCharSets();
    InitFun();
    InitConst();
    InitOprt();
    AddValIdent(&IsNumber);
    EnableOptimizer(false);
    for (std::size_t i = 0; i < inputs->size(); ++i) DefineVar(fmt::format("in{}", i), &(*inputs)[i]);
  }
  void InitCharSets() override {
    DefineNameChars("0123456789_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    DefineOprtChars("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ+-*^/?<>=#!$%&|~'_");
    DefineInfixOprtChars("/+-*^?<>=#!$%&|~'_");
  }
  void InitFun() override {
    for (const auto& [name, function] : {std::pair("sin", &Sin),
                                         {"cos", &Cos},
                                         {"tan", &Tangent},
                                         {"asin", &Asin},
                                         {"acos", &Acos},
                                         {"atan", &Arctangent},
                                         {"sqrt", &Sqrt},
                                         {"exp", &Exp},
                                         {"log", &Log},
                                         {"abs", &Abs},
                                         {"floor", &Floor},
                                         {"ceil", &Ceil},
                                         {"round", &Round},
                                         {"sign", &Sign}})
      DefineFun(name, function);
    DefineFun("atan2", &Atan2);
    DefineFun("pow", &Power);
    DefineFun("fmod", &Modulo);
    DefineFun("clamp", &ClampTo);
    DefineFun("linstep", &LinearStep);
    DefineFun("smoothstep", &SmoothStep);
    DefineFun("min", &Least);
    DefineFun("max", &Greatest);
  }
  void InitConst() override {
    DefineConst("pi", kPi);
    DefineConst("e", 2.71828182845904523536);
  }
  void InitOprt() override {
    DefineInfixOprt("-", &Negative);
    DefineInfixOprt("+", &Same);
  }

 private:
  // A decimal number at the beginning of the text, with a point in any locale.
  static int IsNumber(const char* text, int* position, double* value) {
    if (std::isdigit(static_cast<unsigned char>(text[0])) == 0 && text[0] != '.') return 0;
    const auto [end, error] = std::from_chars(text, text + std::strlen(text), *value);
    if (error != std::errc() || end == text) return 0;
    *position += static_cast<int>(end - text);
    return 1;
  }
};

// muParser's sentence without its own count of characters, which begins at 0.
std::string Sentence(const mu::ParserError& error) {
  std::string text = error.GetMsg();
  for (const char* part : {" found at position ", " at expression position ", " at position "}) {
    const std::size_t at = text.find(part);
    if (at == std::string::npos) continue;
    std::size_t end = at + std::strlen(part);
    while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
    text.erase(at, end - at);
  }
  while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
  return text;
}

}  // namespace

// muParser's byte code as steps.
class ExpressionReader {
 public:
  explicit ExpressionReader(std::size_t inputs) : inputs_(inputs) {}

  Result<Expression> Read(const std::string& text) {
    if (text.size() > Expression::kMaxLength)
      return Status::Invalid("expression: {} characters, at most {} are allowed", text.size(),
                             Expression::kMaxLength);
    if (const std::size_t zero = text.find('\0'); zero != std::string::npos)
      return Status::Invalid("expression, character {}: a zero byte", zero + 1);
    try {
      FormulaParser parser(&inputs_);
      parser.SetExpr(text);
      parser.Eval();
      if (parser.GetNumResults() != 1)
        return Status::Invalid("expression \"{}\": expected one value, found {}", text,
                               parser.GetNumResults());
      const mu::ParserByteCode& code = parser.GetByteCode();
      const mu::SToken* tokens = code.GetBase();
      for (std::size_t i = 0; i < code.GetSize() && tokens[i].Cmd != mu::cmEND; ++i) {
        if (!Add(tokens[i]))
          return Status::Invalid("expression \"{}\": assignments and texts are no part of an expression",
                                 text);
      }
      expression_.stack_size_ = code.GetMaxStackSize() + 2;
    } catch (const mu::ParserError& error) {
      const std::string known =
          inputs_.empty() ? "no input is set" : fmt::format("inputs are in0 to in{}", inputs_.size() - 1);
      const bool name = error.GetCode() == mu::ecUNASSIGNABLE_TOKEN;
      return Status::Invalid("expression \"{}\", character {}: {}{}", text, std::max(error.GetPos(), 0) + 1,
                             Sentence(error), name ? fmt::format(" ({})", known) : "");
    }
    return std::move(expression_);
  }

 private:
  bool Add(const mu::SToken& token) {
    using Kind = Expression::Kind;
    Expression::Step step;
    switch (token.Cmd) {
      case mu::cmVAL:
        step.kind = Kind::kNumber;
        step.number = token.Val.data2;
        break;
      case mu::cmVAR:
        step.kind = Kind::kInput;
        step.index = static_cast<std::size_t>(token.Val.ptr - inputs_.data());
        break;
      case mu::cmFUNC:
        step.kind = Kind::kCall;
        step.arguments = token.Fun.argc;
        step.function = token.Fun.cb._pRawFun;
        break;
      case mu::cmIF:
      case mu::cmELSE:
        step.kind = token.Cmd == mu::cmIF ? Kind::kJumpIfZero : Kind::kJump;
        step.index = static_cast<std::size_t>(token.Oprt.offset);
        break;
      case mu::cmENDIF:
        break;
      default:
        if (token.Cmd > mu::cmLOR) return false;
        step.kind = Kind::kOperator;
        step.index = token.Cmd;
    }
    expression_.steps_.push_back(step);
    return true;
  }

  std::vector<double> inputs_;
  Expression expression_;
};

Result<Expression> Expression::Compile(const std::string& text, std::size_t inputs) {
  return ExpressionReader(inputs).Read(text);
}

double Expression::Run(std::span<const double> inputs, std::span<double> stack) const noexcept {
  double* top = stack.data();  // the last value; the first place stays unused
  for (std::size_t at = 0; at < steps_.size(); ++at) {
    const Step& step = steps_[at];
    switch (step.kind) {
      case Kind::kNumber:
        *++top = step.number;
        break;
      case Kind::kInput:
        *++top = inputs[step.index];
        break;
      case Kind::kOperator:
        --top;
        *top = Operate(step.index, top[0], top[1]);
        break;
      case Kind::kCall: {
        const int count = std::abs(step.arguments);
        top -= count - 1;
        if (step.arguments < 0) {
          *top = reinterpret_cast<mu::multfun_type>(step.function)(top, count);
        } else if (count == 1) {
          *top = reinterpret_cast<mu::fun_type1>(step.function)(top[0]);
        } else if (count == 2) {
          *top = reinterpret_cast<mu::fun_type2>(step.function)(top[0], top[1]);
        } else {
          *top = reinterpret_cast<mu::fun_type3>(step.function)(top[0], top[1], top[2]);
        }
        break;
      }
      case Kind::kJumpIfZero:
        if (*top-- == 0) at += step.index;
        break;
      case Kind::kJump:
        at += step.index;
        break;
      case Kind::kNothing:
        break;
    }
  }
  return *top;
}

}  // namespace kpsa::engine
