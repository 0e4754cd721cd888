#include "host/bench/reference.h"

#include <algorithm>
#include <cmath>

#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostColors = 10'000;  // of a picture: a reference takes long, and so many tell an RMS

}  // namespace

struct BenchReference::Variant {
  std::unique_ptr<OpenRig> open;
  std::unique_ptr<Side> side;
};

struct BenchReference::Sums {
  std::vector<double> squares;  // by output
  std::vector<double> frames;   // RMS of the worst output
  std::size_t count = 0;        // frames
};

BenchReference::BenchReference(std::optional<std::string> variant, std::optional<std::string> rival)
    : variant_(std::move(variant)), rival_(std::move(rival)) {}
BenchReference::~BenchReference() = default;

Side* BenchReference::rival() const { return beside_ == nullptr ? nullptr : beside_->side.get(); }

Result<std::unique_ptr<BenchReference::Variant>> BenchReference::LoadVariant(
    const RigOpener& opener, const RigChange& change, const std::vector<std::string>& outputs,
    const std::vector<PointSet>& points, const SideOptions& options) {
  Result<std::unique_ptr<OpenRig>> open = opener.open(change);
  if (!open.ok()) return open.status();
  auto made = std::make_unique<Variant>();
  made->open = std::move(*open);
  const Rig& own = made->open->rig;
  Request request;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const Result<PlugRef> plug = own.graph->FindPlug(outputs[o]);
    if (!plug.ok()) return plug.status();
    request.outputs.push_back({*plug, points.empty() ? PointSet() : points[o]});
  }
  request.varying.push_back(own.scene.time);
  if (options.still) request.varying = VaryingPlugs(own);
  Compiler compiler;
  const auto plan = CompileFor(own, &compiler, request);
  if (!plan.ok()) return plan.status();
  made->side = std::make_unique<Side>(own, *plan, options);
  return made;
}

Status BenchReference::Load(const RigOpener& opener, const RigChange& clip, const Plan& full,
                            const SideOptions& options) {
  if (!variant_.has_value()) return Status();
  outputs_.clear(), points_.clear();
  for (const Plan::Output& output : full.outputs()) {
    const Index total = output.points.total();
    points_.push_back(output.type == Type::kColors ? PointSet::Of(GoldenSpread(total, kMostColors), total)
                                                   : PointSet::All(total));
    outputs_.push_back(output.name);
  }
  const auto load = [&](const std::string& name, const std::vector<PointSet>& points,
                        std::unique_ptr<Variant>* to) {
    Result<std::unique_ptr<Variant>> made = LoadVariant(opener, {clip.clip, name}, outputs_, points, options);
    if (made.ok()) *to = std::move(*made);
    return made.ok() ? Status() : made.status();
  };
  KPSA_RETURN_IF_ERROR(load(*variant_, points_, &reference_));
  return rival_.has_value() ? load(*rival_, {}, &beside_) : Status();
}

Status BenchReference::AddFrame(double time, const std::vector<Side*>& sides) {
  if (reference_ == nullptr) return Status();
  std::vector<Side*> compared = sides;
  if (beside_ != nullptr) compared.push_back(rival());
  KPSA_RETURN_IF_ERROR(reference_->side->Evaluate(time));
  if (beside_ != nullptr) KPSA_RETURN_IF_ERROR(rival()->Evaluate(time));
  sums_.resize(compared.size());
  for (std::size_t s = 0; s < compared.size(); ++s) {
    Sums& sums = sums_[s];
    sums.squares.resize(points_.size());
    double worst = 0;
    for (Index o = 0; o < points_.size(); ++o) {
      const ConstPointsView right = reference_->side->evaluator->Points(o),
                            other = compared[s]->evaluator->Points(o);
      double squares = 0;
      for (Index i = 0; i < points_[o].size(); ++i) {
        const Index p = points_[o][i];
        const Double3 d{static_cast<double>(other.x[p]) - static_cast<double>(right.x[i]),
                        static_cast<double>(other.y[p]) - static_cast<double>(right.y[i]),
                        static_cast<double>(other.z[p]) - static_cast<double>(right.z[i])};
        squares += Dot(d, d);
      }
      sums.squares[o] += squares;
      worst = std::max(worst, std::sqrt(squares / std::max<double>(1, points_[o].size())));
    }
    sums.frames.push_back(worst);
    ++sums.count;
  }
  return Status();
}

void BenchReference::AddTimes() {
  if (beside_ == nullptr) return;
  for (const std::vector<double>& runs : rival()->times.ns()) rival_ns_ += Median(runs), ++rival_frames_;
}

ReferenceTable BenchReference::Table(std::size_t accelerated, double full_ms, double accelerated_ms) const {
  ReferenceTable table;
  if (sums_.empty()) return table;
  table.variant = *variant_;
  table.outputs = outputs_;
  for (const PointSet& points : points_) table.points += points.size(), table.of_points += points.total();
  const auto add = [&](const std::string& name, const Sums& sums, double ms) {
    FromReference& row = table.rows.emplace_back();
    row.name = name, row.frames = sums.frames, row.ms = ms;
    for (std::size_t o = 0; o < points_.size(); ++o)
      row.rms.push_back(
          std::sqrt(sums.squares[o] / std::max(1.0, static_cast<double>(sums.count * points_[o].size()))));
  };
  add("accelerated", sums_[accelerated + 1], accelerated_ms);
  add("full", sums_[0], full_ms);
  if (beside_ != nullptr)
    add(*rival_, sums_.back(),
        rival_ns_ / 1e6 / static_cast<double>(std::max<std::size_t>(1, rival_frames_)));
  return table;
}

}  // namespace kpsa::engine
