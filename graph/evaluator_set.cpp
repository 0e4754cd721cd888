// Values from outside: each is checked, and a refused one changes nothing.
#include <algorithm>
#include <cmath>
#include <span>

#include "graph/evaluator.h"

namespace kpsa::engine {
namespace {

std::string NameOf(const Plan::Varying& plug, int component) {
  return component < 0 ? plug.name : fmt::format("{}.{}", plug.name, "xyzw"[component]);
}

}  // namespace

Status Evaluator::Set(const PlugHandle& plug, const Value& value) {
  if (plug.varying >= plan_->varying().size())
    return Status::Invalid("the handle belongs to another plan; expected one that this evaluator found");
  const Plan::Varying& target = plan_->varying()[plug.varying];
  const bool one = plug.component >= 0;
  const int components = target.type == Type::kDouble3 ? 3 : target.type == Type::kQuaternion ? 4 : 0;
  if (one ? plug.component >= components || plug.type != Type::kDouble : plug.type != target.type)
    return Status::Invalid(
        "{} is a {}, and the handle is of something else; expected one that this evaluator found",
        target.name, TypeName(target.type));
  double whole = 0;
  const std::span<const double> numbers = NumbersOf(value, &whole);
  // Doubles stand for whole numbers as far as they tell them apart
  const double* d = value.get_if<double>();
  const bool whole_number =
      d != nullptr ? *d == std::floor(*d) && std::abs(*d) <= 0x1p53 : value.get_if<std::int64_t>() != nullptr;
  const bool fits =
      plug.IsWholeNumber() ? whole_number : value.FitsType(plug.type) && !IsPointType(plug.type);
  if (!fits)
    return Status::Invalid("{}: expected {}, got {}", NameOf(target, plug.component), TypeName(plug.type),
                           value.ToString());
  for (double number : numbers) {
    if (!std::isfinite(number))
      return Status::Invalid("{}: expected a finite value, got {}", NameOf(target, plug.component),
                             value.ToString());
    if (number < target.min || number > target.max)
      return Status::Invalid("{}: {} is outside of [{}, {}]", NameOf(target, plug.component), number,
                             target.min, target.max);
  }
  switch (plug.type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum:
      SetInt(plug.varying, value.AsInt());
      break;
    case Type::kDouble:
      Set(plug.varying, numbers[0], plug.component);
      break;
    case Type::kDouble3:
      Set(plug.varying, value.get<Double3>());
      break;
    case Type::kQuaternion:
      Set(plug.varying, value.get<Quaternion>());
      break;
    default:
      Set(plug.varying, value.get<Matrix4>());
      break;
  }
  return Status();
}

Status Evaluator::SetPoints(const PlugHandle& plug, ConstPointsView points) {
  if (plug.varying >= plan_->varying().size() || plug.component >= 0 ||
      !IsPointType(plan_->varying()[plug.varying].type))
    return Status::Invalid("the handle is of no points of this plan; expected one that this evaluator found");
  const Plan::Varying& target = plan_->varying()[plug.varying];
  if (points.count != target.points)
    return Status::Invalid("{}: expected {} points, got {}", target.name, target.points, points.count);
  for (int c = 0; c < PointComponents(target.type); ++c) {
    const float* values = c == 0 ? points.x : c == 1 ? points.y : points.z;
    if (points.count > 0 && values == nullptr)
      return Status::Invalid("{}: expected {} numbers a point", target.name, PointComponents(target.type));
    if (!std::all_of(values, values + points.count, [](float v) { return std::isfinite(v); }))
      return Status::Invalid("{}: expected finite points", target.name);
  }
  SetPoints(plug.varying, points);
  return Status();
}

}  // namespace kpsa::engine
