#include "cli/page_report.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "host/bench/bench.h"
#include "host/clip_record.h"
#include "host/full_times.h"
#include "host/rig_survey.h"
#include "host/rig_training.h"
#include "report/page_clips.h"
#include "report/page_graph.h"
#include "report/page_html.h"
#include "report/page_rig.h"
#include "report/page_tables.h"
#include "report/viewer_page.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kHeavyBytes = 16 << 20;  // of a page that is warned about

// The clips of the flags; without them the test clips, and without these what the rig plays ("").
std::vector<std::string> ClipsOf(const PageFlags& flags, const Rig& rig) {
  std::vector<std::string> clips;
  const auto add = [&](const std::string& clip) {
    if (std::ranges::find(clips, clip) == clips.end()) clips.push_back(clip);
  };
  for (const std::string& clip : flags.clips) add(clip);
  if (!clips.empty() || flags.rest || flags.pose.has_value())
    return clips.empty() ? std::vector<std::string>{""} : clips;
  clips = TestClips(rig);
  if (clips.empty()) clips.emplace_back();
  return clips;
}

AccelerationChoice WithModes(const PageFlags& flags) {
  AccelerationChoice choice = ChoiceOf(flags.acceleration);
  choice.with_modes = true;  // for the table of what errors consist of
  return choice;
}

// The subspaces that the flags name, or the rig's own where all of them are there.
std::optional<AccelerationChoice> ChoiceFor(const PageFlags& flags, const Rig& rig,
                                            std::vector<std::string>* notes) {
  if (flags.acceleration.wanted()) return WithModes(flags);
  if (rig.accelerate.empty()) return std::nullopt;
  for (const AccelerateEntry& entry : rig.accelerate) {
    if (std::ranges::any_of(entry.points, &AcceleratedPoints::colors)) {
      notes->push_back(fmt::format("\"{}\" accelerates light, which a page does not show", entry.name));
      return std::nullopt;
    }
    std::error_code error;
    if (!entry.subspace.empty() && std::filesystem::exists(entry.subspace, error)) continue;
    notes->push_back(
        fmt::format("\"{}\" is not trained, so the page shows the full evaluation alone (kpsa train {})",
                    entry.name, flags.file));
    return std::nullopt;
  }
  return WithModes(flags);
}

// Opens the rig with no clip.
RigOpener RestOpener(const PageFlags& flags) {
  Flags rest = flags;
  rest.rest = true;
  rest.clip.reset();
  return OpenerOf(rest);
}

std::string Today() {
  const std::time_t now = std::time(nullptr);
  char text[32];
  std::tm local{};
  localtime_r(&now, &local);
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M", &local)};
}

// All that a page shows.
struct Gathered {
  RigSurvey survey;
  std::vector<BenchResult> bench;  // one, or none where nothing is accelerated
  PageClips clips;
  PageTables tables;
};

Status Survey(const RigOpener& opener, const RigOpener& rest, const std::string& clip,
              const std::optional<AccelerationChoice>& choice, const Watch& watch, Gathered* all) {
  Result<RigSurvey> survey = SurveyRig(opener, rest, clip, choice, watch);
  if (!survey.ok()) return survey.status();
  for (const AppliedSubspace& one : survey->applied) {
    if (one.subspace->of_light())
      return Status::Usage("\"{}\" accelerates light, which a page does not show", one.name).At({one.path});
  }
  all->survey = std::move(*survey);
  return Status();
}

Status Time(const RigOpener& opener, const std::vector<std::string>& clips,
            const std::optional<AccelerationChoice>& choice, const Watch& watch, Gathered* all) {
  PageTables& tables = all->tables;
  if (!choice.has_value()) {
    Result<FullTimes> full = TimeFull(opener, clips, tables.runs, tables.threads, watch);
    if (!full.ok()) return full.status();
    tables.full = std::move(*full);
    all->clips.full_us = tables.full.frame_us;
    return Status();
  }
  BenchOptions options;
  options.runs = tables.runs, options.threads = tables.threads;
  Result<std::vector<BenchResult>> bench = RunBench(opener, {*choice}, clips, options, watch);
  if (!bench.ok()) return bench.status();
  all->bench = std::move(*bench);
  all->clips.bench = tables.bench = &all->bench.front();
  return Status();
}

// What is left out is added to the notes.
Result<PageData> Fill(const Rig& rig, Gathered* all, const Watch& watch, std::vector<std::string>* notes) {
  const RigSurvey& survey = all->survey;
  PageTables& tables = all->tables;
  PageData page;
  PutRigNames(rig, &page);
  page.Put("made", PageText(Today()));
  PutMeshes(rig, survey.rest, &page);
  KPSA_RETURN_IF_ERROR(PutClips(all->clips, survey.rest, watch, &page));
  PutControls(rig, &page, survey.reaches);
  if (survey.reaches.empty() && !rig.controls.empty())
    notes->push_back(fmt::format("{}: what each moves is measured of at most {}",
                                 Plural(rig.controls.size(), "control"), kMostReaches));
  const std::vector<BenchNode> none;
  const bool accelerated = tables.bench != nullptr;
  PutCues(survey.cues, accelerated ? tables.bench->cue_us : std::vector<std::vector<double>>(), &page);
  PutNodes(survey.nodes, accelerated, accelerated ? tables.bench->full_nodes : tables.full.nodes,
           accelerated ? tables.bench->accelerated_nodes : none, &page);
  if (!PutFieldBlobs(rig, &page))
    notes->push_back(
        fmt::format("more than {} joints and deformers: their weights are not in the page", kMostFieldBlobs));
  tables.notes = *notes;
  tables.applied = survey.applied;
  tables.points = survey.rest.size() / 3;
  PutTables(tables, &page);
  return page;
}

// What was written, to stdout unless that is the page.
void PrintSizes(const PageFlags& flags, const PageHtml& html, double seconds) {
  if (flags.json) {
    nlohmann::ordered_json parts = nlohmann::ordered_json::array();
    for (const PageHtml::Part& part : html.parts)
      parts.push_back({{"name", part.name}, {"bytes", part.bytes}});
    PrintJson(nlohmann::ordered_json{{"schema", "kpsa.page/1"},
                                     {"file", *flags.output},
                                     {"bytes", html.text.size()},
                                     {"seconds", seconds},
                                     {"parts", parts}});
  } else if (*flags.output != "-" && !flags.quiet) {
    Print(fmt::format("{}: {} in {:.1f} s; open it in a browser\n", *flags.output, ByteText(html.text.size()),
                      seconds));
  }
}

}  // namespace

bool MakesPage(const std::string& file) {
  const std::vector<std::string> suffixes{".yaml", ".yml", ".glb", ".gltf", ".vrm"};
  return std::ranges::find(suffixes, FileSuffix(file)) != suffixes.end();
}

CommandResult WritePage(const PageFlags& flags) {
  if (!flags.output.has_value()) return Status::Usage("{}: expected -o FILE.html", flags.file);
  KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".html"}));
  if (flags.output == "-" && flags.json) return Status::Usage("-o - and --json: stdout takes one of them");
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, true));
  const Result<int> threads = ThreadCount(flags),
                    runs = ParseCount("--runs", flags.runs.value_or("5"), 1, 1000);
  if (!threads.ok()) return threads.status();
  if (!runs.ok()) return runs.status();
  const auto begin = std::chrono::steady_clock::now();
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  KPSA_RETURN_IF_ERROR(CheckNotInput(*flags.output, rig.files));
  std::vector<std::string> notes;
  const std::optional<AccelerationChoice> choice = ChoiceFor(flags, rig, &notes);
  if (!choice.has_value()) KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, false));
  const std::vector<std::string> names = ClipsOf(flags, rig);

  const InterruptScope interruptible;
  Progress progress("report", 0, flags.quiet);
  const Watch watch = progress.watch();
  const RigOpener opener = OpenerOf(flags);
  Gathered all;
  all.tables.runs = *runs, all.tables.threads = std::max(1, *threads);
  progress.SetLabel("report: controls", 0);
  KPSA_RETURN_IF_ERROR(Survey(opener, RestOpener(flags), names.front(), choice, watch, &all));
  progress.SetLabel("report: points, frames", 0);
  double bytes = 0;
  for (const std::string& name : names) {
    Result<ClipRecord> record = RecordClip(opener, name, {choice, *threads, watch});
    if (!record.ok()) return record.status();
    bytes += sizeof(float) * static_cast<double>(record->full.size() + record->accelerated.size());
    if (bytes > kMostRecordBytes)
      return Status::Usage(
                 "the clips up to \"{}\" have {} of positions, of at most {}; choose fewer with --clip",
                 record->name, ByteText(static_cast<std::uint64_t>(bytes)),
                 ByteText(static_cast<std::uint64_t>(kMostRecordBytes)))
          .At({flags.file});
    all.clips.records.push_back(std::move(*record));
  }
  progress.SetLabel("report: timing, frames", 0);
  KPSA_RETURN_IF_ERROR(Time(opener, names, choice, watch, &all));
  progress.SetLabel("report: shape, modes", 0);
  const Result<PageData> page = Fill(rig, &all, watch, &notes);
  if (!page.ok()) return page.status();
  const Result<PageHtml> html = MakePageHtml(ViewerPage(), *page);
  if (!html.ok()) return html.status();
  progress.Clear();
  if (Interrupted()) return InterruptedStatus();
  KPSA_RETURN_IF_ERROR(WriteText(*flags.output, flags.force, html->text));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  PrintSizes(flags, *html, seconds);
  for (const std::string& note : notes) {
    if (!flags.quiet) Say("note: " + note);
  }
  if (const std::string note = HeavyNote(*html, kHeavyBytes); !note.empty()) Say("warning: " + note);
  return 0;
}

}  // namespace kpsa::engine
