// kpsa get: values of plugs over time.
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/request.h"
#include "cli/rig_frames.h"
#include "io/quantity.h"

namespace kpsa {
namespace {

constexpr std::size_t kMaxNumbers = 200'000'000;  // printed

struct GetFlags : Flags {
  std::vector<std::string> plugs;
  std::optional<std::string> format;  // csv if not given
};

// A plug and the numbers that it gives each frame.
struct Column {
  std::string name;
  WantedPlug wanted;
  Type type = Type::kDouble;
  double factor = 1;  // from the runtime's unit to the file's
  std::string unit;
  Index output = kNoIndex;  // of the plan; kNoIndex: `text` is its constant value
  std::string text;
  std::vector<std::string> suffixes;  // one a number
  Index points = 0;                   // of a points plug

  void Read(const Evaluator& evaluator, std::vector<double>* numbers) const;
};

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

// The columns that the plugs give, and the request that evaluates them.
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
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

CommandResult Get(const GetFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  const bool json = flags.json || flags.format == "json";
  if (flags.format.value_or("csv") != "csv" && flags.format != "json")
    return Status::Usage("--format {}: expected csv or json", *flags.format);
  const std::string place = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {}));
  const ThreadLimit limit(*threads);
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  KPSA_RETURN_IF_ERROR(CheckNotInput(place, rig.files));
  const Result<std::vector<double>> times = SampleTimes(flags, rig);
  if (!times.ok()) return times.status();
  Request request;
  request.varying.push_back(rig.scene.time);
  Result<std::vector<Column>> columns = FindColumns(rig, flags.plugs, &request);
  if (!columns.ok()) return columns.status();
  Compiler compiler;
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  std::size_t width = 0;
  for (Column& column : *columns) {
    if (column.output == kNoIndex) continue;
    if (IsPointType(column.type)) {
      column.points = (*plan)->outputs()[column.output].points.size();
      if (column.wanted.mesh != nullptr) column.points = column.wanted.mesh->vertex_count;
    }
    column.suffixes = Suffixes(column);
    width += column.suffixes.size();
  }
  if (width * times->size() > kMaxNumbers)
    return Status::Usage("{} numbers are more than {}: expected fewer frames, or kpsa eval for points",
                         Thousands(width * times->size()), Thousands(kMaxNumbers));

  const InterruptScope interruptible;
  std::string text;
  std::vector<nlohmann::ordered_json> values(columns->size(), nlohmann::ordered_json::array());
  if (!json) {
    text = "time";
    for (const Column& column : *columns) {
      for (const std::string& suffix : column.suffixes) {
        std::string name = column.name + suffix;
        if (name.find_first_of(",\"\n") != std::string::npos) name = "\"" + name + "\"";
        text += "," + name;
      }
      if (column.output == kNoIndex) text += "," + column.name;
    }
    text += "\n";
  }
  std::vector<double> numbers;
  RigFrameOptions options;
  options.threads = *threads;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        if (!json) text += NumberText((*times)[frame]);
        for (std::size_t c = 0; c < columns->size(); ++c) {
          const Column& column = (*columns)[c];
          numbers.clear();
          if (column.output != kNoIndex) column.Read(evaluator, &numbers);
          if (!json) {
            for (double number : numbers) text += "," + NumberText(number);
            if (column.output == kNoIndex) text += ",\"" + column.text + "\"";
          } else if (column.output == kNoIndex) {
            values[c].push_back(column.text);
          } else if (numbers.size() == 1) {
            values[c].push_back(numbers[0]);
          } else {
            values[c].push_back(numbers);
          }
        }
        if (!json) text += "\n";
        return Status();
      }));
  if (json) {
    nlohmann::ordered_json plugs = nlohmann::ordered_json::array();
    for (std::size_t c = 0; c < columns->size(); ++c) {
      const Column& column = (*columns)[c];
      plugs.push_back({{"plug", column.name},
                       {"type", TypeName(column.type)},
                       {"unit", column.unit},
                       {"values", std::move(values[c])}});
    }
    const nlohmann::ordered_json document = {
        {"schema", "kpsa.get/1"}, {"times", *times}, {"plugs", std::move(plugs)}};
    text = document.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  }
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, text));
  return 0;
}

}  // namespace

void AddGetCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<GetFlags>();
  CLI::App* command = AddCommand(program, "get", "Print values of plugs over time",
                                 "One row a frame. Lengths and angles in the rig's units; matrices in "
                                 "metres, column by column; points by vertex.\n"
                                 "Examples:\n"
                                 "  kpsa get head.yaml jaw.worldMatrix jaw.poseRotateX --frames 0:48\n"
                                 "  kpsa get head.glb head_mesh.weight[mouth-open] --json --times 0.5",
                                 chosen, [flags] { return Get(*flags); });
  AddRigFlags(command, flags.get());
  AddRepeated(command, "PLUG", "", &flags->plugs,
              "plugs (jaw.worldMatrix), or points of a mesh (head_mesh@mush)");
  AddTimeFlags(command, flags.get());
  AddOption(command, "--format", "", &flags->format, "csv (the default) or json");
  AddOutputFlags(command, flags.get(), "a file instead of stdout");
  AddThreadsFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa
