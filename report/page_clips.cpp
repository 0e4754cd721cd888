#include "report/page_clips.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "report/json_text.h"
#include "report/page_shape.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

// Seven digits: more than any of these numbers is worth.
Json SevenDigits(double value) { return RoundedJson<Json>(value, 7); }

double Diagonal(const PageClips& clips) {
  double low[3], high[3];
  for (int c = 0; c < 3; ++c) low[c] = std::numeric_limits<double>::infinity(), high[c] = -low[c];
  for (const ClipRecord& record : clips.records) {
    for (std::size_t i = 0; i < record.full.size(); ++i) {
      const auto x = static_cast<double>(record.full[i]);
      low[i % 3] = std::min(low[i % 3], x), high[i % 3] = std::max(high[i % 3], x);
    }
  }
  const double diagonal = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  return std::isfinite(diagonal) ? diagonal : 0;
}

template <typename Narrow>
std::string AddNarrow(const std::string& name, const std::vector<std::int16_t>& values, PageData* page) {
  const std::vector<Narrow> narrow(values.begin(), values.end());
  return page->AddBlob(name, std::span<const Narrow>(narrow));
}

std::string AddWhole(const std::string& name, const std::vector<std::int16_t>& values, bool wide,
                     PageData* page) {
  return wide ? AddNarrow<std::int16_t>(name, values, page) : AddNarrow<std::int8_t>(name, values, page);
}

// The frames of one clip as rows of what is shown where nothing is asked for.
void AddRows(const ClipRecord& record, std::vector<std::span<const float>>* rows) {
  for (std::size_t f = 0; f < record.times.size(); ++f)
    rows->push_back(record.accelerated.empty() ? record.FullAt(f) : record.AcceleratedAt(f));
}

Json ResidualOf(const ClipRecord& record, std::size_t number, double step, PageData* page) {
  std::vector<std::span<const float>> full, accelerated;
  for (std::size_t f = 0; f < record.times.size(); ++f)
    full.push_back(record.FullAt(f)), accelerated.push_back(record.AcceleratedAt(f));
  const PageResidual residual = FitResidual(full, accelerated, step);
  if (residual.values.empty()) return nullptr;
  Json json = {{"blob", AddWhole(fmt::format("residual.{}", number), residual.values, residual.wide, page)},
               {"step", residual.step}};
  if (std::ranges::find(residual.frame_rows, -1) != residual.frame_rows.end())
    json["rows"] = residual.frame_rows;
  return json;
}

// The index of a text, which is added where it is new.
int IndexOf(const std::string& text, std::vector<std::string>* texts) {
  const auto it = std::ranges::find(*texts, text);
  const auto index = static_cast<int>(it - texts->begin());
  if (it == texts->end()) texts->push_back(text);
  return index;
}

void TellFrames(std::span<const BenchResult::Frame> frames, bool several, std::vector<std::string>* reasons,
                Json* clip) {
  Json verdicts = Json::array(), why = verdicts, scores = verdicts, full = verdicts, fast = verdicts,
       most = verdicts, rms = verdicts;
  for (const BenchResult::Frame& frame : frames) {
    const FrameDecision& decision = frame.decision;
    verdicts.push_back(static_cast<int>(decision.verdict()));
    why.push_back(
        decision.hit() ? -1 : IndexOf((several ? decision.entry + ": " : "") + decision.reason, reasons));
    scores.push_back(SevenDigits(decision.score));
    full.push_back(SevenDigits(frame.full_ms * 1e3));
    fast.push_back(SevenDigits(frame.accelerated_ms * 1e3));
    most.push_back(SevenDigits(frame.max));
    rms.push_back(SevenDigits(frame.rms));
  }
  (*clip)["verdicts"] = std::move(verdicts);
  (*clip)["reasons"] = std::move(why);
  (*clip)["scores"] = std::move(scores);
  (*clip)["full_us"] = std::move(full);
  (*clip)["accelerated_us"] = std::move(fast);
  (*clip)["max_error"] = std::move(most);
  (*clip)["rms_error"] = std::move(rms);
}

bool SeveralEntries(const BenchResult& bench) {
  return std::ranges::any_of(bench.per_frame, [&](const BenchResult::Frame& frame) {
    return frame.decision.entry != bench.per_frame.front().decision.entry;
  });
}

}  // namespace

PageSteps StepsOf(const PageClips& clips) {
  double tolerance = clips.bench == nullptr ? 0 : clips.bench->promise.tolerance;
  if (clips.bench == nullptr || !clips.bench->promise.promised() || !(tolerance > 0))
    tolerance = std::max(1e-3 * Diagonal(clips), 1e-9);
  return {tolerance / 10, tolerance / 16};
}

Status PutClips(const PageClips& clips, std::span<const float> rest, const Watch& watch, PageData* page) {
  const PageSteps steps = StepsOf(clips);
  const bool accelerated = clips.bench != nullptr;
  page->Put("accelerated", accelerated ? "true" : "false");
  if (accelerated && clips.bench->promise.promised() && clips.bench->promise.tolerance > 0)
    page->Put("tolerance", CompactJson(Json(clips.bench->promise.tolerance)));
  std::vector<std::span<const float>> rows;
  Json told = Json::array();
  std::vector<std::string> reasons;
  std::size_t first = 0;
  for (std::size_t n = 0; n < clips.records.size(); ++n) {
    const ClipRecord& record = clips.records[n];
    const std::size_t frames = record.times.size();
    Json clip = {{"name", record.name},
                 {"frames", frames},
                 {"fps", record.fps},
                 {"begin", frames == 0 ? 0.0 : record.times.front()},
                 {"first_row", first}};
    if (record.test) clip["test"] = true;
    if (accelerated) {
      TellFrames(std::span(clips.bench->per_frame).subspan(first, frames), SeveralEntries(*clips.bench),
                 &reasons, &clip);
      if (Json residual = ResidualOf(record, n, steps.residual, page); !residual.is_null())
        clip["residual"] = std::move(residual);
    } else if (n < clips.full_us.size()) {
      Json full = Json::array();
      for (const double us : clips.full_us[n]) full.push_back(SevenDigits(us));
      clip["full_us"] = std::move(full);
    }
    AddRows(record, &rows);
    first += frames;
    told.push_back(std::move(clip));
  }
  const Result<PageShape> shape = FitShape(rest, rows, steps.shape, watch);
  if (!shape.ok()) return shape.status();
  Json shape_json = {{"modes", shape->modes},
                     {"basis", AddWhole("basis", shape->basis, shape->largest > 127, page)},
                     {"scale", page->AddBlob("scale", std::span<const float>(shape->scale))},
                     {"rows", page->AddBlob("rows", std::span<const float>(shape->rows))},
                     {"precision", shape->precision}};
  page->Put("shape", CompactJson(shape_json));
  page->Put("clips", CompactJson(told));
  if (!reasons.empty()) page->Put("reasons", CompactJson(Json(reasons)));
  return Status();
}

}  // namespace kpsa::engine
