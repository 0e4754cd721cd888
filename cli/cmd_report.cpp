// kpsa report: a rig as a page; benches as tables for a document, or their frames as numbers.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/page_report.h"
#include "report/bench_tables.h"

namespace kpsa::engine {
namespace {

struct ReportFlags : PageFlags {
  std::vector<std::string> files, references;
  std::optional<std::string> frames;
  bool without_any = false;
};

// What is of use for the other kind of file alone.
Status RefuseOthers(const ReportFlags& flags, bool page) {
  const AccelerationFlags& acceleration = flags.acceleration;
  const std::vector<std::pair<bool, const char*>> of_benches{{!flags.references.empty(), "--reference"},
                                                             {flags.frames.has_value(), "--csv"},
                                                             {flags.without_any, "--without-any"}};
  const std::vector<std::pair<bool, const char*>> of_rigs{
      {!flags.clips.empty(), "--clip"},
      {flags.runs.has_value(), "--runs"},
      {!flags.sets.empty(), "--set"},
      {flags.pose.has_value(), "--pose"},
      {flags.rest, "--rest"},
      {flags.fps.has_value(), "--fps"},
      {flags.variant.has_value(), "--variant"},
      {!flags.plugins.empty(), "--plugin"},
      {acceleration.accelerate, "--accelerate"},
      {acceleration.kpsa.has_value(), "--kpsa"},
      {acceleration.tolerance.has_value(), "--tolerance"},
      {acceleration.stale.has_value(), "--stale"},
      {acceleration.violation_rate.has_value(), "--violation-rate"},
      {flags.threads.has_value(), "--threads"},
      {flags.json, "--json"},
      {flags.quiet, "-q"}};
  for (const auto& [given, name] : page ? of_benches : of_rigs) {
    if (given) return Status::Usage("{} is of no use for {}", name, page ? "a rig" : "benches");
  }
  return Status();
}

CommandResult Report(ReportFlags flags) {
  const bool page = MakesPage(flags.files.front());
  KPSA_RETURN_IF_ERROR(RefuseOthers(flags, page));
  if (page) {
    if (flags.files.size() > 1)
      return Status::Usage("{}: expected one rig, or benches (.json)", flags.files[1]);
    flags.file = flags.files.front();
    return WritePage(flags);
  }
  if (flags.references.size() > flags.files.size())
    return Status::Usage("{} --reference for {}", flags.references.size(),
                         Plural(flags.files.size(), "file"));
  if (flags.frames.has_value()) KPSA_RETURN_IF_ERROR(CheckOutput(*flags.frames, flags.force, {".csv"}));
  if (flags.output.has_value()) KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".md"}));
  std::vector<BenchDocument> documents;
  for (std::size_t i = 0; i < flags.files.size(); ++i)
    documents.push_back({flags.files[i], i < flags.references.size() ? flags.references[i] : ""});
  const Result<std::string> tables = BenchTables(documents, !flags.without_any);
  if (!tables.ok()) return tables.status();
  if (flags.frames.has_value()) {
    const Result<std::string> frames = BenchFrames(flags.files);
    if (!frames.ok()) return frames.status();
    KPSA_RETURN_IF_ERROR(WriteText(*flags.frames, flags.force, *frames));
    if (!flags.output.has_value()) return 0;
  }
  KPSA_RETURN_IF_ERROR(WriteText(flags.output.value_or("-"), flags.force, *tables));
  return 0;
}

}  // namespace

void AddReportCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = AddCommand(
      program, "report", "A rig as a page to look at (HTML); benches as tables (Markdown) or frames (CSV)",
      "Of a rig or a character: one file with its test clips, full and accelerated, that opens in a browser "
      "from disk.\nWithout a subspace it shows the full evaluation. docs/report.md says what is in it.\n"
      "Of benches, which are what kpsa bench --json printed: tables, or the numbers of every frame. Figures "
      "are "
      "drawn of them by bench/plot_frames.py (matplotlib), and a page of the rig has them, too.\n"
      "Examples:\n"
      "  kpsa report head.yaml -o head.html\n"
      "  kpsa report head.yaml --kpsa other.kpsa --clip face_talk --tolerance 0.5mm -o head.html\n"
      "  kpsa report head.json body.json -o tables.md\n"
      "  kpsa report head.json --csv frames.csv",
      chosen, [flags] { return Report(*flags); });
  AddRepeated(command, "FILE", "", &flags->files,
              "a rig (.yaml) or a character (.glb, .gltf, .vrm); or outputs of kpsa bench --json (.json)");
  AddOutputFlags(command, flags.get(), "the page, .html; or the tables, .md, instead of stdout");
  AddRepeated(
      command, "--clip", "NAME", &flags->clips,
      "of a rig: a clip, instead of its test clips (its first one, if it names none); may be repeated");
  AddPoseFlags(command, flags.get(), false);
  AddAccelerationFlags(command, &flags->acceleration);
  AddOption(command, "--runs", "N", &flags->runs,
            "of a rig: timed evaluations of every frame; 5 if not given");
  AddOption(command, "--threads", "N", &flags->threads, "of a rig: threads of both sides; 1 if not given");
  AddRepeated(command, "--reference", "TEXT", &flags->references,
              "of benches: a figure to stand beside a bench's paper mode, in the order of the files");
  AddSwitch(command, "--without-any", &flags->without_any,
            "of benches: leave out sides that accept every frame");
  AddOption(command, "--csv", "FILE.csv", &flags->frames,
            "of benches: every frame's verdict, errors and times, with the parts of the errors of subspaces "
            "trained with --keep-modes; then no tables without -o");
  AddQuietFlag(command, flags.get());
  AddSwitch(command, "--json", &flags->json,
            "of a rig: print the sizes of the page's parts to stdout as JSON");
}

}  // namespace kpsa::engine
