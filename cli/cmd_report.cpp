// kpsa report: benches as tables for a document, and as plots over the frames.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/output.h"
#include "report/bench_tables.h"

namespace kpsa::engine {
namespace {

struct ReportFlags : Flags {
  std::vector<std::string> files, references;
  std::optional<std::string> plot;
  bool without_any = false;
};

CommandResult Report(const ReportFlags& flags) {
  if (flags.references.size() > flags.files.size())
    return Status::Usage("{} --reference for {}", flags.references.size(),
                         Plural(flags.files.size(), "file"));
  if (flags.plot.has_value()) {
    if (flags.files.size() != 1)
      return Status::Usage("--plot: expected one bench, not {}", flags.files.size());
    KPSA_RETURN_IF_ERROR(CheckOutput(*flags.plot, flags.force, {".svg"}));
  }
  if (flags.output.has_value()) KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".md"}));
  std::vector<BenchDocument> documents;
  for (std::size_t i = 0; i < flags.files.size(); ++i)
    documents.push_back({flags.files[i], i < flags.references.size() ? flags.references[i] : ""});
  const Result<std::string> tables = BenchTables(documents, !flags.without_any);
  if (!tables.ok()) return tables.status();
  if (flags.plot.has_value()) {
    const Result<std::vector<LinePlot>> plots = BenchPlots(flags.files.front());
    if (!plots.ok()) return plots.status();
    KPSA_RETURN_IF_ERROR(WriteText(*flags.plot, flags.force, PlotsAsSvg(*plots, 2)));
    if (!flags.output.has_value()) return 0;
  }
  KPSA_RETURN_IF_ERROR(WriteText(flags.output.value_or("-"), flags.force, *tables));
  return 0;
}

}  // namespace

void AddReportCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = AddCommand(program, "report", "Tables (Markdown) and plots (SVG) of benches",
                                 "Takes what kpsa bench --json printed.\n"
                                 "Examples:\n"
                                 "  kpsa report head.json body.json -o tables.md\n"
                                 "  kpsa report head.json --plot errors.svg",
                                 chosen, [flags] { return Report(*flags); });
  AddRepeated(command, "BENCH.json", "", &flags->files, "outputs of kpsa bench --json");
  AddRepeated(command, "--reference", "TEXT", &flags->references,
              "a figure to stand beside a bench's paper mode, in the order of the files");
  AddSwitch(command, "--without-any", &flags->without_any, "leave out sides that accept every frame");
  AddOption(command, "--plot", "FILE.svg", &flags->plot,
            "errors over the frames, of subspaces trained with --keep-modes; then no tables without -o");
  AddOutputFlags(command, flags.get(), "the tables, .md, instead of stdout");
}

}  // namespace kpsa::engine
