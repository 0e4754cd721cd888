#include "host/bench/tolerances.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/rig_frames.h"
#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

// As of CalibrationPair::error.
double ErrorOf(ConstPointsView exact, ConstPointsView other, bool light) {
  double largest = 0, sum = 0;
  for (std::size_t i = 0; i < exact.count; ++i) {
    const Double3 d{double{exact.x[i]} - other.x[i], double{exact.y[i]} - other.y[i],
                    double{exact.z[i]} - other.z[i]};
    const double square = Dot(d, d);
    if (!std::isfinite(square)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, square), sum += square;
  }
  return std::sqrt(light ? sum / static_cast<double>(std::max<std::size_t>(1, exact.count)) : largest);
}

// The node that an output's points come from.
std::size_t NodeOf(const Rig& rig, const std::vector<AppliedSubspace>& applied, const PlugRef& output) {
  for (std::size_t n = 0; n < applied.size(); ++n) {
    if (applied[n].node == output.node) return n;
    for (const AcceleratedPoints& points : applied[n].entry.points) {
      if (!points.colors && rig.scene.meshes[points.mesh].points == output) return n;
    }
  }
  return applied.size();
}

}  // namespace

Status BenchTolerances::Load(const RigOpener& opener, const RigChange& clip, const Compared& compared,
                             const SideOptions& options) {
  in_force_ = wide_ = 0, light_ = false;
  nodes_.clear();
  for (const AppliedSubspace& one : *compared.applied) {
    nodes_.push_back({one.subspace, one.tolerance, one.violation_rate});
    in_force_ = std::max(in_force_, one.tolerance);
    wide_ = std::max(wide_, LargestError(one.subspace->calibration));
    light_ = light_ || one.subspace->of_light();
  }
  const std::vector<double> tolerances = TolerancesAround(in_force_);
  side_.reset(), verdicts_.reset(), applied_.clear();  // of the clip before, which refer to its rig
  if (tolerances.empty()) return Status();
  wide_ = std::max(wide_, tolerances.back());
  clip_begin_ = frames_.size();

  Result<std::unique_ptr<OpenRig>> open = opener.open(clip);
  if (!open.ok()) return open.status();
  open_ = std::move(*open);
  AccelerationChoice choice = *compared.choice;
  choice.tolerance = wide_;
  choice.with_modes = false;
  Compiler compiler;
  Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&open_->rig, &compiler, choice);
  if (!applied.ok()) return applied.status();
  applied_ = std::move(*applied);
  // Rigs of one file have the same nodes
  Request request;
  request.outputs.assign(compared.request->outputs.begin(),
                         compared.request->outputs.begin() + static_cast<std::ptrdiff_t>(compared.outputs));
  request.varying = compared.request->varying;
  verdicts_ = std::make_unique<Verdicts>(applied_);
  verdicts_->Ask(open_->rig, &request);
  const auto plan = CompileFor(open_->rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  side_ = std::make_unique<Side>(open_->rig, *plan, options);
  node_of_output_.clear();
  for (std::size_t o = 0; o < compared.outputs; ++o)
    node_of_output_.push_back(NodeOf(open_->rig, applied_, request.outputs[o].plug));
  return Status();
}

Status BenchTolerances::AddFrame(double time, std::int64_t frame, const Evaluator& full) {
  if (side_ == nullptr) return Status();
  KPSA_RETURN_IF_ERROR(side_->Evaluate(time));
  verdicts_->Add(frame, *side_->evaluator);
  Frame added{verdicts_->last(), {}};
  for (Index o = 0; o < node_of_output_.size(); ++o)
    added.errors.push_back(ErrorOf(full.Points(o), side_->evaluator->Points(o), light_));
  frames_.push_back(std::move(added));
  return Status();
}

Status BenchTolerances::TimeHits(const std::vector<double>& times) {
  if (side_ == nullptr) return Status();
  const auto hit = [&](std::size_t f) {
    const std::vector<FrameDecision>& nodes = frames_[clip_begin_ + f].nodes;
    return std::all_of(nodes.begin(), nodes.end(), [](const FrameDecision& node) { return node.hit(); });
  };
  std::size_t hits = 0;
  for (std::size_t f = 0; f < times.size(); ++f) hits += hit(f);
  if (hits == 0) return Status();
  side_->StartAgain();
  KPSA_RETURN_IF_ERROR(side_->Turn(times, 0, times.size()));
  const std::vector<std::vector<double>>& ns = side_->times.Finish();
  for (std::size_t f = 0; f < times.size(); ++f) {
    if (hit(f)) hit_ns_ += Median(ns[f]);
  }
  timed_hits_ += hits;
  return Status();
}

ToleranceRow BenchTolerances::At(double tolerance, double full_ms, double hit_ms, double miss) const {
  std::vector<SoftCacheThreshold> thresholds;
  for (const Subspaces& node : nodes_) {
    // All grow as the largest does
    const double own = tolerance == in_force_ ? node.tolerance : tolerance * (node.tolerance / in_force_);
    thresholds.push_back(
        Calibrate(node.subspace->calibration, own, node.violation_rate, node.subspace->blend_start)
            .threshold);
  }
  ToleranceRow row;
  row.tolerance = tolerance;
  std::size_t hits = 0, accepted = 0;
  double worst = 0;
  for (const Frame& frame : frames_) {
    bool hit = true;
    // Of the errors at the wide tolerance: by node, and the largest
    std::vector<double> shares(thresholds.size() + 1, 0.0);
    for (std::size_t n = 0; n < thresholds.size(); ++n) {
      const FrameDecision& wide = frame.nodes[n];
      const double weight = std::max(FullWeight(wide.score, thresholds[n]), wide.full_weight);
      hit = hit && weight == 0;
      if (weight >= 1) continue;
      shares[n] = (1 - weight) / (1 - wide.full_weight);
      shares.back() = std::max(shares.back(), shares[n]);
    }
    hits += hit, accepted += shares.back() > 0;
    for (std::size_t o = 0; o < frame.errors.size(); ++o) {
      if (const double share = shares[node_of_output_[o]]; share > 0)
        worst = std::max(worst, share * frame.errors[o]);
    }
  }
  row.hits = static_cast<double>(hits) / static_cast<double>(std::max<std::size_t>(1, frames_.size()));
  if (accepted > 0) row.worst = worst / tolerance;
  const bool ever_hits = std::any_of(thresholds.begin(), thresholds.end(),
                                     [](const SoftCacheThreshold& one) { return one.tau >= 0; });
  row.speedup = SpeedupWithMisses(full_ms, hit_ms, row.hits, ever_hits, miss);
  return row;
}

double BenchTolerances::CostOfMiss(double full_ms, double hit_ms, double mean_ms) const {
  const bool in_parts = std::any_of(nodes_.begin(), nodes_.end(),
                                    [](const Subspaces& node) { return node.subspace->patches.tiles > 0; });
  const double hits = in_parts ? At(in_force_, full_ms, hit_ms, 1).hits : 1;
  if (!(hits < 1) || !(full_ms > 0) || !(hit_ms > 0)) return 1;
  return std::clamp((mean_ms - hit_ms) / ((1 - hits) * full_ms), 0.0, 1.0);
}

ToleranceTable BenchTolerances::Table(double full_ms, double hit_ms, double mean_ms,
                                      double wanted_speedup) const {
  if (frames_.empty()) return {};
  if (!(hit_ms > 0) && timed_hits_ > 0) hit_ms = hit_ns_ / static_cast<double>(timed_hits_) / 1e6;
  const double miss = CostOfMiss(full_ms, hit_ms, mean_ms);
  return MakeToleranceTable(in_force_, wide_, wanted_speedup,
                            [&](double tolerance) { return At(tolerance, full_ms, hit_ms, miss); });
}

}  // namespace kpsa::engine
