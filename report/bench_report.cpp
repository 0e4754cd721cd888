#include "report/bench_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/quantity_text.h"
#include "base/text.h"
#include "report/promise_text.h"
#include "report/table.h"
#include "report/tolerance_text.h"
#include "report/verdict_text.h"

namespace kpsa::engine {
namespace {

std::string IdleText(const IdleDeformers& idle) {
  const std::vector<std::string> off = idle.Off();
  if (off.empty())
    return fmt::format("idle       none of {} makes less than {} on {}\n",
                       Plural(idle.deformers.size(), "deformer"), LengthText(idle.tolerance),
                       Plural(idle.frames, "frame"));
  return fmt::format(
      "idle       {:.0f} % of the full cost makes less than {} on {} ({} together):\n           {}\n",
      100 * idle.share, LengthText(idle.tolerance), Plural(idle.frames, "frame"), LengthText(idle.difference),
      fmt::join(off, ", "));
}

std::string ReferenceText(const BenchResult& r) {
  if (r.reference.rows.empty()) return "";
  std::vector<std::string> header{"RMS from " + r.reference.variant};
  for (const std::string& output : r.reference.outputs) header.push_back(">" + output);
  header.insert(header.end(), {">ms/frame", ">accelerated is"});
  Table table(header);
  for (const FromReference& row : r.reference.rows) {
    std::vector<std::string> cells{row.name};
    for (const double error : row.rms) cells.push_back(ErrorText(error, r.light));
    cells.push_back(fmt::format("{:.3f}", row.ms));
    const bool itself = row.name == r.reference.rows.front().name;
    cells.push_back(itself ? "" : RatioText(Ratio(row.ms, r.accelerated_ms), 1) + " as fast");
    table.Row(cells);
  }
  return fmt::format("\n{}at {} of {} points\n", table.Text(), r.reference.points, r.reference.of_points);
}

std::string SideText(const BenchResult& r, const BenchContext& context) {
  const auto error = [&](double value) { return ErrorText(value, r.light); };
  std::string text;
  if (context.kpsa.size() > 1) text += r.subspace + "\n";
  const double frames = static_cast<double>(std::max<std::size_t>(1, r.frames));
  text += fmt::format("{}: {} by {} ({}), {} modes\n", context.rig, Plural(r.points, "point"),
                      Plural(r.cues, "cue"), fmt::join(r.cue_stages, ", "), r.modes);
  text += fmt::format("trained on {}; tested on {}: {}, {}, medians of {}, {}\n\n",
                      fmt::join(r.trained_on, ", "), fmt::join(r.clips, ", "), Plural(r.frames, "frame"),
                      Plural(static_cast<std::uint64_t>(context.options.threads), "thread"),
                      Plural(static_cast<std::uint64_t>(context.options.runs), "run"),
                      r.cpu_times ? "the thread's CPU time" : "wall time");
  std::string heaviest;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, r.full_nodes.size()); ++i)
    heaviest +=
        fmt::format("{}{} {:.3f}", i == 0 ? "" : ", ", r.full_nodes[i].name, r.full_nodes[i].ms_per_frame);
  std::string parts = fmt::format("graph {:.3f}, cues {:.3f}, projection {:.3f}, reconstruction {:.3f}",
                                  r.graph_ms, r.cues_ms, r.projection_ms, r.reconstruction_ms);
  if (r.downstream_ms > 0) parts += fmt::format(", later stages {:.3f}", r.downstream_ms);
  if (r.misses_ms > 0) parts += fmt::format(", misses {:.3f}", r.misses_ms);
  Table times({"", ">ms/frame", "over the runs", "of which"});
  const bool ranges = context.options.runs > 1;
  const auto range = [&](const BenchResult::Range& of, const char* before, const char* after) {
    return ranges ? fmt::format("{}{:.3f} to {:.3f}{}", before, of.least, of.most, after) : "";
  };
  times.Row({"full", fmt::format("{:.3f}", r.full_ms), range(r.full_range, "", ""), heaviest});
  times.Row(
      {"accelerated", fmt::format("{:.3f}", r.accelerated_ms), range(r.accelerated_range, "", ""), parts});
  text += times.Text();
  text += fmt::format(
      "\nspeedup    {}{}{}; ceiling {}, bound by the graph that the subspace reads{}\n",
      RatioText(r.speedup(), 2),
      ranges && std::isfinite(r.speedup())
          ? fmt::format(" ({:.2f} to {:.2f} over the runs)", r.speedup_range.least, r.speedup_range.most)
          : "",
      r.hits == 0 ? "" : fmt::format(", {} on hits", RatioText(r.speedup_on_hits(), 2)),
      RatioText(r.ceiling()), r.bound_points_ms > 0 ? " and points that are not accelerated" : "");
  if (r.speedup() < 1)
    text += fmt::format("           slower than the full evaluation: {}\n",
                        r.hits == 0 ? "no frame hits, and frames that miss are judged besides"
                        : r.speedup_on_hits() >= 1
                            ? "frames that miss cost it once more, and too few hit"
                            : "even frames that hit cost more; evaluate these without the subspace");
  text += fmt::format("hits       {:.1f} % of frames: {}\n", 100 * static_cast<double>(r.hits) / frames,
                      CountsText(r.hits, r.blends, r.frames - r.hits - r.blends));
  if (!r.most_frequent_reason.empty()) text += "           " + r.most_frequent_reason + "\n";
  text += "promise    " + PromiseText(r.promise, "           ");
  text +=
      fmt::format("error      RMS {}, 99 % {}, max {}{}; motion RMS {}, diagonal {}\n", error(r.error_rms),
                  error(r.error_p99), error(r.error_max),
                  r.worst_clip.empty() ? "" : fmt::format(" (frame {} of {})", r.worst_frame, r.worst_clip),
                  error(r.motion_rms), error(r.diagonal));
  if (const FrameErrors& e = r.frame_errors; !e.empty()) {
    text += fmt::format(
        "split      RMS of all frames reconstructed: projection {}, cueing {}, storage {}, together {}; with "
        "SoftCache {}\n",
        error(OverFrames(e.projection)), error(OverFrames(e.cueing)), error(OverFrames(e.storage)),
        error(OverFrames(e.total)), error(OverFrames(e.soft_cache)));
  }
  if (r.idle.measured()) text += IdleText(r.idle);
  text += fmt::format(
      "evaluated  {} points a frame instead of {}; {} of {} nodes never{}\n",
      Thousands(static_cast<std::uint64_t>(std::llround(r.points_accelerated))),
      Thousands(static_cast<std::uint64_t>(std::llround(r.points_full))), r.never_evaluated.size(),
      r.nodes_total,
      r.never_evaluated.empty()
          ? ""
          : fmt::format(
                ": {}{}",
                fmt::join(r.never_evaluated.begin(),
                          r.never_evaluated.begin() +
                              static_cast<std::ptrdiff_t>(std::min<std::size_t>(6, r.never_evaluated.size())),
                          ", "),
                r.never_evaluated.size() > 6 ? ", ..." : ""));
  if (!r.tolerances.rows.empty()) text += "\n" + ToleranceText(r.tolerances, BenchWords(r));
  return text + ReferenceText(r);
}

// Whether so many frames of clips miss that a subspace should learn from them.
bool MayLearn(const BenchResult& r) {
  const bool of_clips = !r.clips.empty() && r.clips.front() != "(rest)";
  return of_clips && !r.light && r.promise.tolerance > 0 &&
         (2 * r.hits < r.frames || (r.hits < r.frames && !r.promise.kept()));
}

}  // namespace

ToleranceWords BenchWords(const BenchResult& r) {
  // More samples end where controls do
  const bool beyond = r.most_frequent_reason.ends_with(" is outside its trained range");
  return {"frames",
          beyond ? "train on clips that are like these, or widen the controls that these go beyond"
                 : "train on clips that are like these, or on more samples",
          r.light};
}

std::string FramesText(const std::vector<BenchResult>& results) {
  std::string text;
  for (const BenchResult& r : results) {
    std::vector<std::string> header{"clip", ">frame", "", ">full", ">score", ">RMS", ">max"};
    header.insert(header.end(), {">full ms", ">accelerated ms", ">speedup"});
    for (const FromReference& row : r.reference.rows)
      header.push_back(fmt::format(">{} from {}", row.name, r.reference.variant));
    header.emplace_back("why");
    Table table(header);
    for (std::size_t i = 0; i < r.per_frame.size(); ++i) {
      const BenchResult::Frame& f = r.per_frame[i];
      const FrameDecision& d = f.decision;
      std::vector<std::string> cells{f.clip, fmt::format("{}", f.number), VerdictName(d.verdict())};
      cells.push_back(fmt::format("{:.0f} %", 100 * d.full_weight));
      cells.push_back(std::isfinite(d.score) ? fmt::format("{:.3g}", d.score) : "-");
      for (const double error : {f.rms, f.max}) cells.push_back(ErrorText(error, r.light));
      for (const double ms : {f.full_ms, f.accelerated_ms}) cells.push_back(fmt::format("{:.3f}", ms));
      cells.push_back(RatioText(Ratio(f.full_ms, f.accelerated_ms)));
      for (const FromReference& row : r.reference.rows) cells.push_back(ErrorText(row.frames[i], r.light));
      cells.push_back(d.hit() ? "" : d.reason);
      table.Row(cells);
    }
    if (results.size() > 1) text += r.subspace + "\n";
    text += table.Text();
  }
  return text;
}

std::string BenchText(const std::vector<BenchResult>& results, const BenchContext& context) {
  std::string text;
  for (const BenchResult& result : results) text += (text.empty() ? "" : "\n\n") + SideText(result, context);
  const std::string with = context.kpsa.empty() ? "--accelerate" : "--kpsa " + context.kpsa.front();
  if (results.size() == 1 && !context.set && MayLearn(results.front()))
    return text +
           fmt::format(
               "\nnext: kpsa learn {}{} --clips {} --force, which trains again, with what misses here\n",
               context.rig, context.kpsa.empty() ? "" : " " + with, fmt::join(results.front().clips, ","));
  return text + fmt::format("\nnext: kpsa eval {} {} -o fast.npz\n", context.rig, with);
}

}  // namespace kpsa::engine
