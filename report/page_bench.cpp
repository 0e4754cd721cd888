#include "report/page_bench.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/quantity_text.h"
#include "report/promise_text.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostNodes = 40;  // rows of the profile

PageTable BenchTable(const BenchResult& r, int runs, int threads) {
  PageTable table("Bench", TimesNote(r.cpu_times, runs, threads),
                  {{"a frame"}, {"full", "ms"}, {"accelerated", "ms"}, {"times as fast"}});
  table.Row({"all frames", ShortCell(r.full_ms), ShortCell(r.accelerated_ms), ShortCell(r.speedup())});
  if (runs > 1) {
    table.Row({"least of the runs", ShortCell(r.full_range.least), ShortCell(r.accelerated_range.least),
               ShortCell(r.speedup_range.least)});
    table.Row({"most of the runs", ShortCell(r.full_range.most), ShortCell(r.accelerated_range.most),
               ShortCell(r.speedup_range.most)});
  }
  if (r.hits > 0)
    table.Row({"hits", ShortCell(r.full_ms_on_hits), ShortCell(r.accelerated_ms_on_hits),
               ShortCell(r.speedup_on_hits())});
  table.Row({"without cues and reconstruction", {}, ShortCell(r.bound_ms), ShortCell(r.ceiling())});
  const std::pair<const char*, double> parts[] = {{"of it: graph", r.graph_ms},
                                                  {"of it: cues", r.cues_ms},
                                                  {"of it: projection", r.projection_ms},
                                                  {"of it: reconstruction", r.reconstruction_ms},
                                                  {"of it: later stages", r.downstream_ms},
                                                  {"of it: misses", r.misses_ms}};
  for (const auto& [name, ms] : parts) {
    if (ms > 0) table.Row({name, {}, ShortCell(ms), {}});
  }
  return table;
}

PageTable ClipTable(const BenchResult& r) {
  PageTable table("Clips", fmt::format("trained on {}", fmt::join(r.trained_on, ", ")),
                  {{"clip"},
                   {"frames"},
                   {"hits", "%"},
                   {"blends", "%"},
                   {"misses", "%"},
                   {"largest error", "mm"},
                   {"RMS error", "mm"},
                   {"full", "ms"},
                   {"accelerated", "ms"},
                   {"times as fast"}});
  for (std::size_t begin = 0; begin < r.per_frame.size();) {
    std::size_t end = begin, counts[3] = {};
    double largest = 0, squares = 0, full = 0, fast = 0;
    for (; end < r.per_frame.size() && r.per_frame[end].clip == r.per_frame[begin].clip; ++end) {
      const BenchResult::Frame& frame = r.per_frame[end];
      ++counts[static_cast<std::size_t>(frame.decision.verdict())];
      largest = std::max(largest, frame.max), squares += frame.rms * frame.rms;
      full += frame.full_ms, fast += frame.accelerated_ms;
    }
    const std::size_t n = end - begin;
    const auto frames = static_cast<double>(n);
    table.Row({r.per_frame[begin].clip, CountCell(n), PercentCell(PartOf(counts[0], n)),
               PercentCell(PartOf(counts[1], n)), PercentCell(PartOf(counts[2], n)), MillimetreCell(largest),
               MillimetreCell(std::sqrt(squares / frames)), ShortCell(full / frames),
               ShortCell(fast / frames), ShortCell(Ratio(full, fast))});
    begin = end;
  }
  return table;
}

PageTable ReasonTable(const BenchResult& r) {
  struct Reason {
    std::string text, first;
    std::size_t frames = 0;
  };
  std::vector<Reason> reasons;
  for (const BenchResult::Frame& frame : r.per_frame) {
    if (frame.decision.hit()) continue;
    auto it = std::ranges::find(reasons, frame.decision.reason, &Reason::text);
    if (it == reasons.end())
      it = reasons.insert(it, {frame.decision.reason, fmt::format("{} of {}", frame.number, frame.clip), 0});
    ++it->frames;
  }
  std::ranges::stable_sort(reasons, std::greater(), &Reason::frames);
  PageTable table("Why frames are no hits", "", {{"reason"}, {"frames"}, {"first frame"}});
  for (const Reason& reason : reasons) table.Row({reason.text, CountCell(reason.frames), reason.first});
  return table;
}

PageTable SplitTable(const BenchResult& r) {
  const FrameErrors& e = r.frame_errors;
  PageTable table(
      "Errors of frames, all reconstructed",
      "RMS; what no coordinates of the subspace reach, what the cues do not tell, and what storage adds",
      {{"part"}, {"RMS", "mm"}});
  if (e.empty()) return table;
  const std::pair<const char*, const std::vector<double>&> parts[] = {{"projection", e.projection},
                                                                      {"cueing", e.cueing},
                                                                      {"storage", e.storage},
                                                                      {"together", e.total},
                                                                      {"with SoftCache", e.soft_cache}};
  for (const auto& [name, errors] : parts) table.Row({name, MillimetreCell(OverFrames(errors))});
  return table;
}

// The lines of the bench's text.
PageTable PromiseTable(const BenchResult& r) {
  PageTable table("Promise", "", {{"of these frames"}});
  const std::string text = PromiseText(r.promise, "");
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
    end = std::min(text.find('\n', begin), text.size());
    table.Row({text.substr(begin, end - begin)});
  }
  return table;
}

}  // namespace

std::string TimesNote(bool cpu, int runs, int threads) {
  return fmt::format(
      "means of the frames, each the median of {}; {}, {}", Plural(static_cast<std::uint64_t>(runs), "run"),
      Plural(static_cast<std::uint64_t>(threads), "thread"), cpu ? "the thread's CPU time" : "wall time");
}

PageTable ProfileTable(const std::vector<BenchNode>& full, const std::vector<BenchNode>& fast,
                       double full_ms) {
  const bool both = !fast.empty();
  std::vector<PageTable::Column> columns{
      {"node"}, {"type"}, {"full", "µs"}, {"share of it", "%"}, {"points"}};
  if (both) columns.push_back({"accelerated", "µs"});
  std::vector<BenchNode> nodes = full;
  for (const BenchNode& node : fast) {
    if (std::ranges::find(full, node.name, &BenchNode::name) == full.end())
      nodes.push_back(node), nodes.back().points = 0;
  }
  const std::size_t of_full = full.size();
  PageTable table(
      "Profile",
      fmt::format("the {} that take longest, a frame", Plural(std::min(kMostNodes, nodes.size()), "node")),
      columns);
  struct Line {
    const BenchNode* node;
    double full_us = 0, fast_us = 0;
    bool in_full = false, in_fast = false;
  };
  std::vector<Line> lines;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Line line{&nodes[n], 0, 0, n < of_full, false};
    if (line.in_full) line.full_us = nodes[n].ms_per_frame * 1e3;
    const auto it = std::ranges::find(fast, nodes[n].name, &BenchNode::name);
    if (it != fast.end()) line.fast_us = it->ms_per_frame * 1e3, line.in_fast = true;
    lines.push_back(line);
  }
  std::ranges::stable_sort(lines, std::greater(),
                           [](const Line& line) { return std::max(line.full_us, line.fast_us); });
  if (lines.size() > kMostNodes) lines.resize(kMostNodes);
  for (const Line& line : lines) {
    const PageTable::Cell none;
    std::vector<PageTable::Cell> cells{line.node->name, line.node->type,
                                       line.in_full ? ShortCell(line.full_us) : none,
                                       line.in_full ? PercentCell(line.full_us / (1e3 * full_ms)) : none,
                                       line.node->points == 0 ? none : CountCell(line.node->points)};
    if (both) cells.push_back(line.in_fast ? ShortCell(line.fast_us) : CountCell(0));
    table.Row(std::move(cells));
  }
  return table;
}

std::vector<PageTable> BenchPageTables(const BenchResult& r, int runs, int threads) {
  return {BenchTable(r, runs, threads), ClipTable(r), PromiseTable(r), ReasonTable(r), SplitTable(r)};
}

}  // namespace kpsa::engine
