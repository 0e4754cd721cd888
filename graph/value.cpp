#include "graph/value.h"

#include <fmt/format.h>

#include <cstring>

#include "base/check.h"
#include "graph/builtin_steps.h"

namespace kpsa::engine {

const char* TypeName(Type type) {
  constexpr const char* kNames[] = {"bool",    "int",    "enum",   "double",  "double3", "quaternion",
                                    "matrix",  "points", "colors", "weights", "string",  "ints",
                                    "doubles", "mesh",   "curve",  "asset"};
  return kNames[static_cast<int>(type)];
}

std::size_t SlotSize(Type type) {
  switch (type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum:
    case Type::kDouble:
      return 8;
    case Type::kDouble3:
      return sizeof(Double3);
    case Type::kQuaternion:
      return sizeof(Quaternion);
    case Type::kMatrix:
      return sizeof(Matrix4);
    case Type::kPoints:
    case Type::kColors:
    case Type::kWeights:
      return sizeof(PointsView);
    default:
      return 0;
  }
}

double Value::AsDouble() const {
  if (const auto* d = get_if<double>()) return *d;
  if (const auto* i = get_if<std::int64_t>()) return static_cast<double>(*i);
  return 0;
}

std::int64_t Value::AsInt() const {
  if (const auto* i = get_if<std::int64_t>()) return *i;
  if (const auto* d = get_if<double>()) return WholeNumber(*d);
  return 0;
}

bool Value::FitsType(Type type) const {
  switch (type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum:
      return get_if<std::int64_t>() != nullptr;
    case Type::kDouble:
      return get_if<double>() != nullptr || get_if<std::int64_t>() != nullptr;
    case Type::kDouble3:
      return get_if<Double3>() != nullptr;
    case Type::kQuaternion:
      return get_if<Quaternion>() != nullptr;
    case Type::kMatrix:
      return get_if<Matrix4>() != nullptr;
    case Type::kPoints:
    case Type::kColors:
    case Type::kWeights:
      return points() != nullptr && points()->components() == PointComponents(type);
    case Type::kString:
      return get_if<std::string>() != nullptr;
    case Type::kInts:
      return get_if<std::vector<std::int64_t>>() != nullptr;
    case Type::kDoubles:
      return get_if<std::vector<double>>() != nullptr;
    case Type::kMesh:
      return get_if<AssetPtr>() != nullptr && std::strcmp(get<AssetPtr>()->kind(), "mesh") == 0;
    case Type::kCurve:
      return get_if<AssetPtr>() != nullptr && std::strcmp(get<AssetPtr>()->kind(), "curve") == 0;
    case Type::kAsset:
      return get_if<AssetPtr>() != nullptr;
  }
  return false;
}

void Value::WriteSlot(Type type, std::byte* slot) const {
  switch (type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum: {
      const std::int64_t v = AsInt();
      std::memcpy(slot, &v, 8);
      break;
    }
    case Type::kDouble: {
      const double v = AsDouble();
      std::memcpy(slot, &v, 8);
      break;
    }
    case Type::kDouble3:
      std::memcpy(slot, &get<Double3>(), sizeof(Double3));
      break;
    case Type::kQuaternion:
      std::memcpy(slot, &get<Quaternion>(), sizeof(Quaternion));
      break;
    case Type::kMatrix:
      std::memcpy(slot, &get<Matrix4>(), sizeof(Matrix4));
      break;
    default:
      KPSA_CHECK(false);
  }
}

Value Value::ReadSlot(Type type, const std::byte* slot) {
  const auto read = [&](auto v) {
    std::memcpy(&v, slot, sizeof(v));
    return v;
  };
  switch (type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum:
      return Value(read(std::int64_t{}));
    case Type::kDouble:
      return Value(read(double{}));
    case Type::kDouble3:
      return Value(read(Double3{}));
    case Type::kQuaternion:
      return Value(read(Quaternion{}));
    case Type::kMatrix:
      return Value(read(Matrix4{}));
    default:
      break;
  }
  KPSA_CHECK(IsPointType(type));
  const PointsView view = read(PointsView{});
  auto buffer = std::make_shared<PointBuffer>(view.count, PointComponents(type));
  if (view.count > 0) {
    const PointsView to = buffer->view();
    std::memcpy(to.x, view.x, view.count * sizeof(float));
    if (to.y != nullptr) {
      std::memcpy(to.y, view.y, view.count * sizeof(float));
      std::memcpy(to.z, view.z, view.count * sizeof(float));
    }
  }
  return Value(PointBufferPtr(buffer));
}

Digest Value::digest() const {
  Hasher hasher;
  hasher.Add(static_cast<std::uint64_t>(storage_.index()));
  std::visit(
      [&](const auto& v) {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
        } else if constexpr (std::is_same_v<T, std::string>) {
          hasher.Add(std::string_view(v));
        } else if constexpr (std::is_same_v<T, std::vector<std::int64_t>> ||
                             std::is_same_v<T, std::vector<double>>) {
          hasher.Add(std::span(v.data(), v.size()));
        } else if constexpr (std::is_same_v<T, AssetPtr>) {
          hasher.Add(std::string_view(v->kind()));
          hasher.Add(v->digest());
        } else if constexpr (std::is_same_v<T, PointBufferPtr>) {
          const ConstPointsView view = v->view();
          hasher.Add(std::span<const float>(view.x, view.count));
          if (view.y != nullptr) {
            hasher.Add(std::span<const float>(view.y, view.count));
            hasher.Add(std::span<const float>(view.z, view.count));
          }
        } else {
          hasher.AddBytes(&v, sizeof(v));
        }
      },
      storage_);
  return hasher.Finish();
}

std::string Value::ToString() const {
  return std::visit(
      [](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::monostate>)
          return "unset";
        else if constexpr (std::is_same_v<T, Double3>)
          return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
        else if constexpr (std::is_same_v<T, Quaternion>)
          return fmt::format("[{}, {}, {}, {}]", v.x, v.y, v.z, v.w);
        else if constexpr (std::is_same_v<T, Matrix4>)
          return fmt::format("[{}]", fmt::join(v.m, ", "));
        else if constexpr (std::is_same_v<T, std::vector<std::int64_t>> ||
                           std::is_same_v<T, std::vector<double>>)
          return fmt::format("[{}]", fmt::join(v, ", "));
        else if constexpr (std::is_same_v<T, AssetPtr>)
          return fmt::format("<{}>", v->kind());
        else if constexpr (std::is_same_v<T, PointBufferPtr>)
          return fmt::format("<{} points>", v->count());
        else
          return fmt::format("{}", v);
      },
      storage_);
}

std::span<const double> NumbersOf(const Value& value, double* whole) {
  if (const auto* d = value.get_if<double>()) return std::span(d, 1);
  if (const auto* i = value.get_if<std::int64_t>())
    return *whole = static_cast<double>(*i), std::span(whole, 1);
  if (const auto* v = value.get_if<Double3>()) return std::span(&v->x, 3);
  if (const auto* q = value.get_if<Quaternion>()) return std::span(&q->x, 4);
  if (const auto* m = value.get_if<Matrix4>()) return m->m;
  return {};
}

}  // namespace kpsa::engine
