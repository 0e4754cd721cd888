#include "host/plug_columns.h"

namespace kpsa::engine {
namespace {

std::vector<std::string> Suffixes(const Column& column) {
  static const std::string kAxes[] = {".x", ".y", ".z", ".w"};
  std::vector<std::string> suffixes;
  const int component = column.wanted.plug.component;
  const auto vector = [&](const std::string& prefix, int size) {
    for (int c = 0; c < size; ++c) {
      if (component < 0 || component == c) suffixes.push_back(component < 0 ? prefix + kAxes[c] : prefix);
    }
  };
  if (column.type == Type::kDouble3) {
    vector("", 3);
  } else if (column.type == Type::kQuaternion) {
    vector("", 4);
  } else if (column.type == Type::kMatrix) {
    for (int i = 0; i < 16; ++i) suffixes.push_back(fmt::format("[{}]", i));
  } else if (IsPointType(column.type)) {
    if (column.wanted.mesh == nullptr && column.wanted.plug.element >= 0) {
      vector("", PointComponents(column.type));
    } else {
      for (Index i = 0; i < column.points; ++i) vector(fmt::format("[{}]", i), PointComponents(column.type));
    }
  } else {
    suffixes.emplace_back();
  }
  return suffixes;
}

}  // namespace

void Column::Read(const Evaluator& evaluator, std::vector<double>* numbers) const {
  const auto add = [&](double value) { numbers->push_back(value * factor); };
  const int component = wanted.plug.component;
  switch (type) {
    case Type::kBool:
    case Type::kInt:
    case Type::kEnum:
      return add(static_cast<double>(evaluator.Get<std::int64_t>(output)));
    case Type::kDouble:
      return add(evaluator.Get<double>(output));
    case Type::kDouble3: {
      const Double3& v = evaluator.Get<Double3>(output);
      for (int i = 0; i < 3; ++i) {
        if (component < 0 || component == i) add(v[i]);
      }
      return;
    }
    case Type::kQuaternion: {
      const Quaternion& q = evaluator.Get<Quaternion>(output);
      const double v[] = {q.x, q.y, q.z, q.w};
      for (int i = 0; i < 4; ++i) {
        if (component < 0 || component == i) add(v[i]);
      }
      return;
    }
    case Type::kMatrix:
      for (double v : evaluator.Get<Matrix4>(output).m) add(v);
      return;
    default: {
      const ConstPointsView points_view = evaluator.Points(output);
      for (Index i = 0; i < points; ++i) {
        const Index p = wanted.mesh != nullptr ? wanted.mesh->mesh().data().vertex_to_point[i] : i;
        const float* const axes[] = {points_view.x, points_view.y, points_view.z};
        for (int c = 0; c < (points_view.y == nullptr ? 1 : 3); ++c) {
          if (component < 0 || component == c) add(static_cast<double>(axes[c][p]));
        }
      }
    }
  }
}

std::string Column::Words(const Evaluator& evaluator) const {
  const std::int64_t who = evaluator.Get<std::int64_t>(offender);
  return MissText(*config, static_cast<MissReason>(evaluator.Get<std::int64_t>(output)),
                  who < 0 ? kNoIndex : static_cast<Index>(who));
}

Result<std::vector<Column>> FindColumns(const Rig& rig, const std::vector<std::string>& plugs,
                                        Request* request) {
  std::vector<Column> columns;
  for (const std::string& text : plugs) {
    const Result<WantedPlug> wanted = FindWanted(rig, text);
    if (!wanted.ok()) return wanted.status();
    Column column;
    column.name = text;
    column.wanted = *wanted;
    const AttributeDef& attribute =
        rig.graph->def(wanted->plug.node).attributes[static_cast<std::size_t>(wanted->plug.attribute)];
    RequestedOutput output{wanted->plug, {}};
    output.plug.component = -1;
    column.type = attribute.type;
    column.factor = 1 / rig.units.FactorOf(attribute.unit);
    column.unit = attribute.unit == Unit::kLength  ? rig.units.length_name
                  : attribute.unit == Unit::kAngle ? rig.units.angle_name
                  : attribute.unit == Unit::kTime  ? "s"
                                                   : "";
    if (!IsSmallType(column.type) && !IsPointType(column.type)) {
      const Value* value = rig.graph->FindValue(wanted->plug);
      column.text = (value != nullptr ? *value : attribute.default_value).ToString();
    } else if (attribute.array && wanted->plug.element < 0) {
      return Status::Usage("{} is an array: expected an element, as in {}[0] (it has {})", text, text,
                           rig.graph->ArraySize(wanted->plug.node, wanted->plug.attribute));
    } else {
      column.output = static_cast<Index>(request->outputs.size());
      request->outputs.push_back(std::move(output));
      if (const NodeId node = wanted->plug.node;
          rig.graph->def(node).name == "kpsa" && attribute.name == "missReason") {
        const NodeDef& def = rig.graph->def(node);
        const Value* config = rig.graph->FindValue({node, def.FindAttribute("config"), -1, -1});
        if (config != nullptr)
          column.config = std::dynamic_pointer_cast<const KpsaConfig>(config->get<AssetPtr>());
        column.offender = static_cast<Index>(request->outputs.size());
        request->outputs.push_back({{node, def.FindAttribute("offender"), -1, -1}, {}});
      }
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

void CompleteColumn(const Plan& plan, Column* column) {
  if (column->output == kNoIndex) return;
  if (IsPointType(column->type)) {
    column->points = plan.outputs()[column->output].points.size();
    if (column->wanted.mesh != nullptr) column->points = column->wanted.mesh->vertex_count;
  }
  column->suffixes = Suffixes(*column);
}

}  // namespace kpsa::engine
