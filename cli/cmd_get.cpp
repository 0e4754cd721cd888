// kpsa get: values of plugs over time.
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/request.h"
#include "files/quantity.h"
#include "host/plug_columns.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

// RFC 4180
std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

constexpr std::size_t kMaxNumbers = 20'000'000;  // printed

struct GetFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> plugs;
  std::optional<std::string> format;  // csv if not given
};

CommandResult Get(const GetFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  const bool json = flags.json || flags.format == "json";
  if (flags.format.value_or("csv") != "csv" && flags.format != "json")
    return Status::Usage("--format {}: expected csv or json", *flags.format);
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const std::string place = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {}));
  const ThreadLimit limit(*threads);
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  KPSA_RETURN_IF_ERROR(CheckNotInput(place, rig.files));
  const Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  Compiler compiler;
  std::vector<AppliedSubspace> applied;
  if (flags.acceleration.wanted()) {
    Result<std::vector<AppliedSubspace>> result = ApplyAcceleration(&rig, &compiler, flags.acceleration);
    if (!result.ok()) return result.status();
    applied = std::move(*result);
  }
  Request request;
  request.varying.push_back(rig.scene.time);
  Result<std::vector<Column>> columns = FindColumns(rig, flags.plugs, &request);
  if (!columns.ok()) return columns.status();
  ReadColorsFrom(applied, *rig.graph, &request);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  std::size_t width = 0;
  for (Column& column : *columns) {
    CompleteColumn(**plan, &column);
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
        text += "," + CsvField(column.name + suffix);
      }
      if (column.output == kNoIndex) text += "," + CsvField(column.name);
    }
    text += "\n";
  }
  std::vector<double> numbers;
  std::string not_finite;  // the first that is told
  RigFrameOptions options;
  options.threads = *threads;
  options.watch = InterruptWatch();
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        if (!json) text += NumberText((*times)[frame]);
        for (std::size_t c = 0; c < columns->size(); ++c) {
          const Column& column = (*columns)[c];
          if (column.config != nullptr) {
            const std::string words = column.Words(evaluator);
            if (json) {
              values[c].push_back(words);
            } else {
              text += "," + CsvField(words);
            }
            continue;
          }
          numbers.clear();
          if (column.output != kNoIndex) column.Read(evaluator, &numbers);
          if (not_finite.empty() && !std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); }))
            not_finite = fmt::format("{} is not finite at {} s", column.name, (*times)[frame]);
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
                       {"type", column.config != nullptr ? "string" : TypeName(column.type)},
                       {"unit", column.unit},
                       {"values", std::move(values[c])}});
    }
    const nlohmann::ordered_json document = {
        {"schema", "kpsa.get/1"}, {"times", *times}, {"plugs", std::move(plugs)}};
    text = document.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  }
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, text));
  if (!not_finite.empty()) Say("note: " + not_finite + (json ? "; it is null in JSON" : ""));
  return 0;
}

}  // namespace

void AddGetCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<GetFlags>();
  CLI::App* command = AddCommand(program, "get", "Print values of plugs over time",
                                 "One row a frame. Lengths and angles in the rig's units; matrices in "
                                 "metres, column by column; points by vertex.\n"
                                 "With a subspace, its node ENTRY_kpsa tells hit, fullWeight, score and "
                                 "missReason.\n"
                                 "Examples:\n"
                                 "  kpsa get head.yaml jaw.worldMatrix jaw.poseRotateX --frames 0:48\n"
                                 "  kpsa get head.yaml head_kpsa.missReason --accelerate\n"
                                 "  kpsa get head.glb head_mesh.weight[mouth-open] --json --times 0.5",
                                 chosen, [flags] { return Get(*flags); });
  AddRigFlags(command, flags.get());
  AddRepeated(command, "PLUG", "", &flags->plugs,
              "plugs (jaw.worldMatrix), or points of a mesh (head_mesh@mush)");
  AddTimeFlags(command, flags.get());
  AddAccelerationFlags(command, &flags->acceleration);
  AddOption(command, "--format", "", &flags->format, "csv (the default) or json");
  AddOutputFlags(command, flags.get(), "a file instead of stdout");
  AddThreadsFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
