#include "host/problems.h"

namespace kpsa {

std::string Problem::where() const { return engine::SourceLocation{file, line, column}.ToString(); }

std::string ToText(const Problems& problems) {
  std::string text;
  for (const Problem& problem : problems) {
    if (!text.empty()) text += '\n';
    if (const std::string where = problem.where(); !where.empty()) text += where + ": ";
    text += problem.message;
  }
  return text;
}

namespace engine {
namespace {

Problem::Kind KindOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return Problem::Kind::kUsage;
    case ErrorKind::kInvalidInput:
      return Problem::Kind::kInput;
    case ErrorKind::kEvaluation:
      return Problem::Kind::kEvaluation;
    case ErrorKind::kDiffers:
      return Problem::Kind::kFailedCheck;
    case ErrorKind::kInterrupted:
      return Problem::Kind::kInterrupted;
  }
  return Problem::Kind::kInput;
}

}  // namespace

Problems ProblemsOf(const Status& status) {
  Problems problems;
  for (const Error& error : status.errors())
    problems.push_back({KindOf(error.kind), error.where.file, error.where.line, error.where.column,
                        error.message, error.node});
  return problems;
}

}  // namespace engine
}  // namespace kpsa
