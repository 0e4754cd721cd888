#include "rig/file/values.h"

#include <cmath>
#include <limits>

namespace kpsa::engine {
namespace {

constexpr std::int64_t kMaxInteger = 1ll << 53;  // exact in a double

bool ReadList(const YamlNode& node, std::string_view what, Unit unit, const FileUnits& units,
              std::vector<double>* values, YamlErrors* errors) {
  values->clear();
  if (node.is_scalar()) {
    values->resize(1);
    return ReadNumber(node, what, unit, units, values->data(), errors);
  }
  if (!node.is_sequence())
    return errors->Add(node, "{}: expected a list of numbers, found {}", what, node.kind_name());
  bool good = true;
  for (const YamlNode& item : node.items) {
    values->push_back(0);
    good = ReadNumber(item, what, unit, units, &values->back(), errors) && good;
  }
  return good;
}

// 16 numbers column by column, as glTF writes them, or 4 rows of 4.
bool ReadMatrix(const YamlNode& node, std::string_view what, Value* value, YamlErrors* errors) {
  Matrix4 matrix;
  std::vector<double> numbers;
  const FileUnits none;
  if (node.is_sequence() && node.items.size() == 4 && node.items[0].is_sequence()) {
    for (int row = 0; row < 4; ++row) {
      if (!ReadNumbers(node.items[static_cast<std::size_t>(row)], what, Unit::kNone, none, 4, &numbers,
                       errors))
        return false;
      for (int column = 0; column < 4; ++column)
        matrix(row, column) = numbers[static_cast<std::size_t>(column)];
    }
  } else {
    if (!node.is_sequence() || node.items.size() != 16) {
      return errors->Add(node, "{}: expected a matrix, 16 numbers column by column or 4 rows of 4", what);
    }
    if (!ReadNumbers(node, what, Unit::kNone, none, 16, &numbers, errors)) return false;
    for (std::size_t i = 0; i < 16; ++i) matrix.m[i] = numbers[i];
  }
  *value = Value(matrix);
  return true;
}

bool ReadPoints(const YamlNode& node, std::string_view what, const AttributeDef& attribute, int components,
                const FileUnits& units, Value* value, YamlErrors* errors) {
  if (!node.is_sequence())
    return errors->Add(node, "{}: expected a list of points, found {}", what, node.kind_name());
  std::vector<float> all;
  std::vector<double> numbers;
  bool good = true;
  for (const YamlNode& item : node.items) {
    if (components == 1) {
      numbers.resize(1);
      good = ReadNumber(item, what, attribute.unit, units, numbers.data(), errors) && good;
    } else {
      good = ReadNumbers(item, what, attribute.unit, units, 3, &numbers, errors) && good;
    }
    for (double number : numbers) {
      if (!(std::abs(number) <= std::numeric_limits<float>::max())) {
        return errors->Add(item, "{}: {} is outside of the range of points", what, number);
      }
      all.push_back(static_cast<float>(number));
    }
  }
  if (!good) return false;
  if (components == 3) {
    *value = Value(std::make_shared<const PointBuffer>(PointBuffer::FromInterleaved(all)));
    return true;
  }
  auto buffer = std::make_shared<PointBuffer>(all.size(), 1);
  for (std::size_t i = 0; i < all.size(); ++i) buffer->view().x[i] = all[i];
  *value = Value(PointBufferPtr(std::move(buffer)));
  return true;
}

bool ReadEnum(const YamlNode& node, std::string_view what, const AttributeDef& attribute, Value* value,
              YamlErrors* errors) {
  std::string name;
  if (!ReadString(node, what, &name, errors)) return false;
  for (std::size_t i = 0; i < attribute.enum_names.size(); ++i) {
    if (attribute.enum_names[i] != name) continue;
    *value = Value(static_cast<std::int64_t>(i));
    return true;
  }
  return errors->Add(node, "{} has no choice \"{}\"{}; expected one of {}", what, name,
                     DidYouMean(name, attribute.enum_names), fmt::join(attribute.enum_names, ", "));
}

}  // namespace

bool ReadNumbers(const YamlNode& node, std::string_view what, Unit unit, const FileUnits& units,
                 std::size_t count, std::vector<double>* values, YamlErrors* errors) {
  if (!node.is_sequence() || node.items.size() != count) {
    return errors->Add(
        node, "{}: expected a list of {} numbers, found {}", what, count,
        node.is_sequence() ? fmt::format("{}", node.items.size()) : std::string(node.kind_name()));
  }
  return ReadList(node, what, unit, units, values, errors);
}

bool IsConnection(const YamlNode& node, const Graph& graph, Type type, Unit unit, const FileUnits& units) {
  if (!node.is_scalar() || node.scalar.empty()) return false;
  const bool numeric = (IsSmallType(type) && type != Type::kEnum) || IsPointType(type);
  if (!numeric) return false;
  if (type == Type::kBool && ParseBool(node.scalar).has_value()) return false;
  if (ParseQuantity(node.scalar, unit, units).ok()) return false;
  // "3rdJoint.tx" looks like a number but is a plug; "0.2 parsec" is a number gone wrong
  return !LooksNumeric(node.scalar) || graph.FindPlug(node.scalar).ok();
}

bool ReadValue(const YamlNode& node, std::string_view what, const AttributeDef& attribute, Type type,
               const FileUnits& units, Value* value, YamlErrors* errors) {
  std::vector<double> numbers;
  switch (type) {
    case Type::kBool: {
      bool flag = false;
      if (!ReadBool(node, what, &flag, errors)) return false;
      *value = Value(flag);
      return true;
    }
    case Type::kInt: {
      std::int64_t number = 0;
      if (!ReadInteger(node, what, -kMaxInteger, kMaxInteger, &number, errors)) return false;
      *value = Value(number);
      return true;
    }
    case Type::kEnum:
      return ReadEnum(node, what, attribute, value, errors);
    case Type::kDouble: {
      double number = 0;
      if (!ReadNumber(node, what, attribute.unit, units, &number, errors)) return false;
      *value = Value(number);
      return true;
    }
    case Type::kDouble3:
      if (!ReadNumbers(node, what, attribute.unit, units, 3, &numbers, errors)) return false;
      *value = Value(Double3{numbers[0], numbers[1], numbers[2]});
      return true;
    case Type::kQuaternion:
      if (!ReadNumbers(node, what, Unit::kNone, units, 4, &numbers, errors)) return false;
      *value = Value(Quaternion{numbers[0], numbers[1], numbers[2], numbers[3]});
      return true;
    case Type::kMatrix:
      return ReadMatrix(node, what, value, errors);
    case Type::kPoints:
    case Type::kColors:
    case Type::kWeights:
      return ReadPoints(node, what, attribute, PointComponents(type), units, value, errors);
    case Type::kString: {
      std::string text;
      if (!ReadString(node, what, &text, errors)) return false;
      *value = Value(std::move(text));
      return true;
    }
    case Type::kInts: {
      if (!ReadList(node, what, Unit::kNone, units, &numbers, errors)) return false;
      std::vector<std::int64_t> integers;
      for (double number : numbers) {
        if (number != std::floor(number) || std::abs(number) > static_cast<double>(kMaxInteger)) {
          return errors->Add(node, "{}: expected whole numbers, found {}", what, number);
        }
        integers.push_back(static_cast<std::int64_t>(number));
      }
      *value = Value(std::move(integers));
      return true;
    }
    case Type::kDoubles:
      if (!ReadList(node, what, attribute.unit, units, &numbers, errors)) return false;
      *value = Value(numbers);
      return true;
    case Type::kMesh:
    case Type::kCurve:
    case Type::kAsset:
      break;
  }
  return errors->Add(node, "{} is set by the rig itself and cannot be written", what);
}

bool ReadStart(const YamlNode& node, double fps, const FileUnits& units, double* seconds,
               YamlErrors* errors) {
  constexpr double kMaxSeconds = 1e6;
  const Result<double> frame = ParseQuantity(node.scalar, Unit::kNone, FileUnits());
  if (node.is_scalar() && frame.ok() && node.scalar.find('%') == std::string::npos) {
    *seconds = *frame / fps;
  } else if (!ReadNumber(node, "start", Unit::kTime, units, seconds, errors)) {
    return false;
  }
  return std::abs(*seconds) <= kMaxSeconds ||
         errors->Add(node, "start: expected at most {} s, found {} s", kMaxSeconds, *seconds);
}

}  // namespace kpsa::engine
