#include "kpsa/kpsa_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string_view>

#include "base/check.h"
#include "base/matrix.h"
#include "kpsa/activity.h"
#include "kpsa/bound_patches.h"
#include "kpsa/cue_gather.h"
#include "kpsa/matrix_entries.h"
#include "kpsa/near_stack.h"
#include "kpsa/output_reconstruction.h"
#include "kpsa/signals.h"
#include "kpsa/space_frame.h"

namespace kpsa::engine {
namespace {

using KpsaContext =
    NodeContext<In<"cues", ArrayView<ConstPointsView>>, In<"matrices", ArrayView<Matrix4>>,
                In<"scalars", ArrayView<double>>, In<"spaceMatrix", Matrix4>,
                In<"fullPoints", ArrayView<ConstPointsView>>, In<"regionPoints", ArrayView<ConstPointsView>>,
                Out<"outPoints", OutArray<PointsView>>, Out<"score", double>, Out<"hit", bool>,
                Out<"fullWeight", double>, Out<"missReason", std::int64_t>, Out<"offender", std::int64_t>>;

// What decide returns: all points, or regions.
constexpr std::uint64_t kFullBit = 1;
constexpr int kFirstRegionBit = 1;

constexpr double kLeastWeight = 1e-6;  // of the full evaluation, in what is no hit
constexpr int kGrowthSteps = 16;       // of sqrt(2): a space that is 256 times as large as at rest

// Adds the time of a scope to a part of the node's work, where somebody records it.
class Stopwatch {
 public:
  Stopwatch(KpsaContext c, KpsaPart part) : part_(part) {
    ComputeHost* const host = c.context().host;
    if (host != nullptr && host->recording()) host_ = host;
    if (host_ != nullptr) begin_ = ProfileClock();
  }
  ~Stopwatch() {
    if (host_ != nullptr) host_->AddPart(static_cast<int>(part_), ProfileClock() - begin_);
  }

 private:
  ComputeHost* host_ = nullptr;
  KpsaPart part_;
  std::uint64_t begin_ = 0;
};

// What a plan's binding adds: the threshold, and which points of the outputs are wanted.
struct KpsaKernel {
  std::shared_ptr<const KpsaConfig> config;
  SoftCacheThreshold threshold;
  // The same where errors are larger, since the space has grown: [j] for a growth of sqrt(2)^j. Errors are
  // lengths of the space, the tolerance is one of the world.
  std::vector<double> grown_tau;
  std::vector<OutputReconstruction> outputs;
  BoundPatches patches;
  CueGather gather;
  std::size_t tiles = 0;  // whose doubts are kept where there are patches
};

// Kept from decide to compute, per evaluator; the normalised measurement y follows it, padded to 16, then z
// where tiles read that, or the inputs of all tiles where the doubt has needed them, then the doubts of tiles
// where there are patches.
struct KpsaState {
  Verdict verdict;
  Matrix4 world_from_space;
  PatchChoice patches;
};
float* Measured(KpsaContext c) {
  return reinterpret_cast<float*>(c.state() + (sizeof(KpsaState) + 63) / 64 * 64);
}

std::span<const float> TileInputsOf(KpsaContext c, const Subspace& subspace) {
  const std::size_t y = subspace.latent.empty() ? 0 : subspace.soft_cache.padded_rows();
  return {Measured(c) + y, subspace.tile_inputs()};
}

// Of output m, where the verdict has left them; else null.
const float* DoubtInputsOf(KpsaContext c, const Subspace& subspace, std::size_t m) {
  if (subspace.score.doubt == 0) return nullptr;
  const float* inputs = Measured(c) + subspace.soft_cache.padded_rows();
  for (std::size_t i = 0; i < m; ++i) inputs += subspace.tiles[i].input_size();
  return inputs;
}

// What the guards ask for, of all points and of patches, and the ones that ask most.
struct GuardVerdict {
  double all = 0, part = 0;
  Index offender = kNoIndex, offender_of_part = kNoIndex;
  std::array<float, kMaxPatches> patches{};
  void Add(double weight, Index guard, std::uint64_t of) {
    if (!(weight > 0)) return;
    if (of == kAllPatches) {
      if (weight > all) all = weight, offender = guard;
      return;
    }
    if (weight > part) part = weight, offender_of_part = guard;
    RaisePatches(of, static_cast<float>(weight), patches);
  }
};

// in_parts: patches miss by themselves; else every guard is one of all points.
GuardVerdict AskGuards(KpsaContext c, const KpsaConfig::Data& data, bool in_parts) {
  GuardVerdict verdict;
  const ArrayView<Matrix4> matrices = c.get<"matrices">();
  const auto next = [&](std::uint32_t from) {
    return FirstBeyond(matrices, from, data.matrix_lo.data(), data.matrix_hi.data());
  };
  for (std::uint32_t j = next(0); j < matrices.size(); j = next(j + 1)) {
    const Matrix4& m = matrices[j];
    const double *lo = data.matrix_lo.data() + 12 * j, *hi = data.matrix_hi.data() + 12 * j;
    const double* ramp = data.matrix_ramp.data() + 12 * j;
    for (std::size_t e = 0; e < 12; ++e)
      verdict.Add(GuardWeight(lo[e], hi[e], ramp[e], m.m[4 * (e / 3) + e % 3]), j,
                  in_parts ? data.matrix_patches[j] : kAllPatches);
    if (verdict.all >= 1) return verdict;
  }
  const ArrayView<double> scalars = c.get<"scalars">();
  for (std::uint32_t k = 0; k < scalars.size(); ++k) {
    if (scalars[k] >= data.scalar_lo[k] && scalars[k] <= data.scalar_hi[k]) continue;
    verdict.Add(GuardWeight(data.scalar_lo[k], data.scalar_hi[k], data.scalar_ramp[k], scalars[k]),
                matrices.size() + k, in_parts ? data.scalar_patches[k] : kAllPatches);
    if (verdict.all >= 1) return verdict;
  }
  return verdict;
}

// The share of the full evaluation that is asked for by how much is far from rest at once.
double ManyAtOnce(KpsaContext c, const KpsaConfig::Data& data) {
  const double limit = data.subspace->activity_limit;
  if (!(limit < std::numeric_limits<double>::infinity())) return 0;
  double activity = 0;
  const ArrayView<Matrix4> matrices = c.get<"matrices">();
  for (std::uint32_t j = 0; j < matrices.size(); ++j) {
    const double *rest = data.matrix_rest.data() + 12 * j, *per_reach = data.matrix_per_reach.data() + 12 * j;
    double most = 0;
    for (std::size_t e = 0; e < 12; ++e)
      most = std::max(most, ActivityOf(matrices[j].m[4 * (e / 3) + e % 3], rest[e], per_reach[e]));
    activity += most;
  }
  const ArrayView<double> scalars = c.get<"scalars">();
  for (std::uint32_t k = 0; k < scalars.size(); ++k)
    activity += ActivityOf(scalars[k], data.scalar_rest[k], data.scalar_per_reach[k]);
  return ActivityWeight(limit, activity);
}

constexpr double kStretchSlack = 0.05;  // of the tolerance: displacement that a stretch may cause unnoticed,
constexpr double kStretchRamp = 1;      // and by which the full evaluation is alone
constexpr double kStretchRounding = 2e-6;  // matrices of a file are products of floats

// The share of the full evaluation that a stretch asks for.
double StretchWeight(const KpsaConfig::Data& data, const SpaceFrame& frame) {
  double stretch = frame.stretch;
  if (!data.space_scales) stretch = std::max(stretch, std::fabs(frame.scale - 1));
  const Subspace& s = *data.subspace;
  const double unit = s.extent > 0 ? s.tolerance / s.extent : 0;
  return GuardWeight(0, kStretchRounding + kStretchSlack * unit, kStretchRamp * unit, stretch);
}

// The threshold where the space is `scale` times as large as at rest. Between the steps of the table it falls
// from one value to the next, never above the one that belongs to the scale (but for the first 1 %).
SoftCacheThreshold ThresholdAt(const KpsaKernel& kernel, double scale) {
  constexpr double kFirst = 1.01;
  SoftCacheThreshold threshold = kernel.threshold;
  if (scale <= 1 || !(threshold.tau < std::numeric_limits<double>::infinity())) return threshold;
  const double place = scale <= kFirst ? (scale - 1) / (kFirst - 1) : 1 + 2 * std::log2(scale / kFirst);
  const auto step = static_cast<std::size_t>(std::min(place, 1e6));
  if (step + 1 >= kernel.grown_tau.size()) {
    threshold.tau = -1;
    return threshold;
  }
  const double part = place - static_cast<double>(step);
  threshold.tau = (1 - part) * kernel.grown_tau[step] + part * kernel.grown_tau[step + 1];
  return threshold;
}

std::uint64_t Decide(KpsaContext c) {
  const auto& kernel = c.kernel_as<KpsaKernel>();
  const KpsaConfig::Data& data = kernel.config->data();
  const Subspace& subspace = *data.subspace;
  KpsaState& state = c.state_as<KpsaState>();
  state.verdict = Verdict{};
  state.patches.all = 1;
  const auto miss = [&](MissReason reason, Index offender) {
    state.verdict.hit = false;
    state.verdict.full_weight = 1;
    state.verdict.score = std::numeric_limits<double>::infinity();
    state.verdict.reason = reason;
    state.verdict.offender = offender;
    return kFullBit;
  };
  // What comes after it binds to the rest points: to the exact ones
  if (c.context().at_rest || data.always_miss || kernel.threshold.tau < 0)
    return miss(MissReason::kNeverHit, kNoIndex);
  SpaceFrame frame;
  if (data.has_space) frame = SpaceFrameOf(c.get<"spaceMatrix">(), subspace.inverse_rest_stretch);
  state.world_from_space = frame.world_from_space;
  const bool any = kernel.threshold.tau == std::numeric_limits<double>::infinity();
  const std::size_t r = subspace.rows();
  const std::span<double> raw(reinterpret_cast<double*>(c.scratch()), r);
  const std::size_t padded = subspace.soft_cache.padded_rows();
  const std::span<float> y(Measured(c), padded), g(c.scratch() + 2 * padded, padded);
  const std::size_t patches = kernel.patches.count();
  GuardVerdict guard;
  double stretch = 0, many = 0;
  {
    const Stopwatch watch(c, KpsaPart::kCues);
    if (!any) {
      guard = AskGuards(c, data, patches > 0);
      if (guard.all >= 1) return miss(MissReason::kOutOfRange, guard.offender);
      stretch = StretchWeight(data, frame);
      if (stretch >= 1) return miss(MissReason::kSpace, kNoIndex);
      many = ManyAtOnce(c, data);
      if (many >= 1) return miss(MissReason::kManyAtOnce, kNoIndex);
    }
    kernel.gather.Gather({c.get<"cues">(), c.get<"matrices">(), c.get<"scalars">(), frame.world_from_space},
                         c.scratch() + 3 * padded, raw);
  }
  const Stopwatch watch(c, KpsaPart::kProjection);
  Normalize(subspace, raw, y);
  for (std::size_t j = r; j < padded; ++j) y[j] = 0;
  Verdict& verdict = state.verdict;
  const std::span<float> inputs(Measured(c) + padded, subspace.score.doubt > 0 ? subspace.doubt_inputs() : 0);
  const SoftCacheThreshold threshold = ThresholdAt(kernel, frame.scale);
  std::array<double, kMaxPatches> scores;
  verdict = JudgePatches(subspace, threshold, y, g, inputs, {inputs.data() + inputs.size(), kernel.tiles},
                         {scores.data(), patches});
  const bool finite = verdict.reason != MissReason::kNotFinite;
  // The largest weight counts: of all points, or of patches
  double all = patches == 0 || !finite ? verdict.full_weight : 0;
  const auto ask = [&](double weight, MissReason reason, Index offender) {
    if (weight > verdict.full_weight)
      verdict.full_weight = weight, verdict.reason = reason, verdict.offender = offender;
  };
  all = std::max({all, guard.all, stretch, many});
  ask(guard.all, MissReason::kOutOfRange, guard.offender);
  ask(guard.part, MissReason::kOutOfRange, guard.offender_of_part);
  ask(stretch, MissReason::kSpace, kNoIndex);
  ask(many, MissReason::kManyAtOnce, kNoIndex);
  verdict.hit = verdict.full_weight == 0;
  state.patches.all = all;
  if (patches > 0 && finite) {
    for (std::size_t p = 0; p < patches; ++p)
      state.patches.weights[p] =
          std::max(static_cast<float>(FullWeight(scores[p], threshold)), guard.patches[p]);
    ChooseRegions(subspace.patches, all, &state.patches);
    if (!verdict.hit)
      verdict.full_weight =
          state.patches.all + (1 - state.patches.all) * std::max(state.patches.mean, kLeastWeight);
  }
  if (!subspace.latent.empty() && verdict.full_weight < 1)
    ToLatent(subspace, y, {Measured(c) + padded, subspace.tile_inputs()});
  if (verdict.hit) return 0;
  return patches == 0 || !finite || state.patches.full ? kFullBit : state.patches.regions << kFirstRegionBit;
}

void WriteVerdict(KpsaContext c) {
  const Verdict& v = c.state_as<KpsaState>().verdict;
  c.out<"score">() = v.score;
  c.out<"hit">() = v.hit;
  c.out<"fullWeight">() = v.full_weight;
  c.out<"missReason">() = static_cast<std::int64_t>(v.reason);
  c.out<"offender">() = v.offender == kNoIndex ? -1 : static_cast<std::int64_t>(v.offender);
}

// What output m is reconstructed from in a frame, and where to.
OutputReconstruction::Frame FrameOf(KpsaContext c, const KpsaConfig::Data& data, std::size_t m) {
  OutputReconstruction::Frame frame;
  frame.inputs = DoubtInputsOf(c, *data.subspace, m);
  frame.y = TileInputsOf(c, *data.subspace);
  frame.measured = Measured(c);
  const Matrix4& matrix = c.state_as<KpsaState>().world_from_space;
  if (data.outputs_in_space[m] != 0 && !(matrix == Matrix4())) frame.world_from_space = &matrix;
  frame.out = c.out<"outPoints">()[static_cast<std::uint32_t>(m)];
  return frame;
}

void CopyFull(ConstPointsView from, PointsView to) {
  std::memcpy(to.x, from.x, from.count * sizeof(float));
  std::memcpy(to.y, from.y, from.count * sizeof(float));
  std::memcpy(to.z, from.z, from.count * sizeof(float));
}

void Compute(KpsaContext c) {
  const auto& kernel = c.kernel_as<KpsaKernel>();
  WriteVerdict(c);
  const KpsaState& state = c.state_as<KpsaState>();
  const Verdict& verdict = state.verdict;
  const ArrayView<ConstPointsView> full = c.get<"fullPoints">(), regions = c.get<"regionPoints">();
  for (std::uint32_t m = 0; m < kernel.outputs.size(); ++m) {
    const PointsView& out = c.out<"outPoints">()[m];
    if (out.count == 0) continue;
    if (verdict.full_weight >= 1) {
      CopyFull(full[m], out);
      continue;
    }
    const Stopwatch watch(c, KpsaPart::kReconstruction);
    const OutputReconstruction::Frame frame = FrameOf(c, kernel.config->data(), m);
    kernel.outputs[m].Run({&frame, 1}, c.scratch());
    if (verdict.hit) continue;
    kernel.patches.Blend(state.patches, m, full[m], regions, out);
    if (state.patches.all > 0) BlendPoints(state.patches.all, full[m], out);
  }
}

// Hits only: the engine evaluates misses one by one.
void ComputeBlock(ComputeContext* contexts, std::size_t count) {
  const auto& kernel = contexts[0].kernel_as<KpsaKernel>();
  const auto at = [&](std::size_t i) { return KpsaContext(contexts[i]); };
  for (std::size_t i = 0; i < count; ++i) WriteVerdict(at(i));
  for (std::size_t m = 0; m < kernel.outputs.size(); ++m) {
    if (at(0).out<"outPoints">()[static_cast<std::uint32_t>(m)].count == 0) continue;
    // Frames that share a pass over the subspace
    const Stopwatch watch(at(0), KpsaPart::kReconstruction);
    for (std::size_t first = 0; first < count; first += kBlockFrames) {
      const std::size_t frames = std::min(kBlockFrames, count - first);
      OutputReconstruction::Frame some[kBlockFrames];
      for (std::size_t f = 0; f < frames; ++f) some[f] = FrameOf(at(first + f), kernel.config->data(), m);
      kernel.outputs[m].Run({some, frames}, at(first).scratch());
    }
  }
}

void DemandKpsa(Demand& demand) {
  const auto* config = demand.structural().asset<KpsaConfig>("config");
  if (config == nullptr) return;
  for (std::size_t c = 0; c < config->data().cues.size(); ++c) {
    const int element = static_cast<int>(c);
    const Index total = demand.input_total("cues", element);
    const std::vector<Index>& points = config->data().cues[c].points;
    if (points.empty() || points.back() >= total) continue;  // bind reports it
    demand.Require("cues", element, PointSet::Of(points, total));
  }
  for (std::size_t m = 0; m < config->data().subspace->outputs.size(); ++m) {
    demand.Require("fullPoints", static_cast<int>(m), demand.output("outPoints", static_cast<int>(m)));
  }
  if (config->data().patches.empty()) return;
  const std::vector<PatchRegion>& regions = config->data().subspace->patches.regions;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const PointSet& wanted = demand.output("outPoints", static_cast<int>(regions[r].output));
    demand.Require("regionPoints", static_cast<int>(r),
                   WantedOfRegion(regions[r], config->data().patches, wanted));
  }
}

Result<BoundKernel> BindKpsa(const Binding& binding) {
  const Structural& s = binding.structural();
  if (s.asset<KpsaConfig>("config") == nullptr) return Status::Invalid("config is not set");
  KpsaKernel kernel;
  kernel.config = std::dynamic_pointer_cast<const KpsaConfig>(s.value("config").get<AssetPtr>());
  const KpsaConfig::Data& data = kernel.config->data();
  const Subspace& subspace = *data.subspace;
  for (std::size_t c = 0; c < data.cues.size(); ++c) {
    if (binding.input("cues", static_cast<int>(c)).size() != data.cues[c].points.size()) {
      return Status::Invalid("cues[{}] has too few points for the subspace's cues", c);
    }
  }
  const double tolerance = s.get_double("tolerance") >= kAnyError ? std::numeric_limits<double>::infinity()
                                                                  : s.get_double("tolerance");
  const double rate = s.get_double("violationRate");
  kernel.threshold = Calibrate(subspace.calibration, tolerance, rate, subspace.blend_start).threshold;
  if (data.space_scales && kernel.threshold.tau > 0) {
    kernel.grown_tau = {kernel.threshold.tau};
    for (int j = 1; j <= kGrowthSteps && kernel.grown_tau.back() > 0; ++j) {
      const double smaller = tolerance * std::exp2(-0.5 * j);
      kernel.grown_tau.push_back(
          std::max(0.0, Calibrate(subspace.calibration, smaller, rate, subspace.blend_start).threshold.tau));
    }
  }
  std::size_t scratch = 0;  // floats
  for (std::size_t m = 0; m < subspace.outputs.size(); ++m) {
    const PointSet& wanted = binding.output("outPoints", static_cast<int>(m));
    OutputReconstruction output(data.subspace, m, wanted, data.steps.empty() ? nullptr : data.steps[m].get());
    scratch = std::max(scratch, output.scratch_floats());
    kernel.outputs.push_back(std::move(output));
  }
  kernel.patches = BoundPatches(
      subspace.patches, data.patches,
      [&](Index output) { return binding.output("outPoints", static_cast<int>(output)); },
      [&](Index region) { return binding.input("regionPoints", static_cast<int>(region)); });
  kernel.tiles = data.patches.empty() ? 0 : subspace.tile_count();
  kernel.gather = CueGather(data);
  const std::size_t padded = subspace.soft_cache.padded_rows();
  // Or raw cue values (doubles), g, joints
  scratch = std::max(scratch, 3 * padded + kernel.gather.scratch_floats());
  const std::size_t after = subspace.score.doubt > 0  ? subspace.doubt_inputs()
                            : subspace.latent.empty() ? 0
                                                      : subspace.tile_inputs();
  const std::size_t state =
      (sizeof(KpsaState) + 63) / 64 * 64 + (padded + after + kernel.tiles) * sizeof(float);
  return BoundKernel{std::make_shared<const KpsaKernel>(std::move(kernel)), scratch, state};
}

}  // namespace

void AddKpsaNode(NodeRegistry& registry) {
  AddNearNodes(registry);
  registry
      .add(
          "kpsa",
          "Stands in for a deformer stack: measures a few cues, reconstructs all points from a trained "
          "subspace, and lets "
          "the full stack run where that is not good enough (KPSA, Meyer and Anderson 2007, with SoftCache).")
      .category("acceleration")
      .points_in("cues", "points of a mesh at a stage; only the cue points are evaluated")
      .array()
      .in("matrices", Matrix4(), {.doc = "local matrices of transforms: guards and cues"})
      .array()
      .in("scalars", 0.0, {.doc = "other values: guards and cues"})
      .array()
      .in("spaceMatrix", Matrix4(), {.doc = "the frame that the subspace lives in"})
      .points_in("fullPoints", "the full evaluation")
      .array()
      .lazy(true)
      .points_in("regionPoints", "the full evaluation of each region that may miss by itself")
      .array()
      .lazy()
      .structural("config", Type::kAsset)
      .structural("tolerance", 1e-4,
                  {.min = 0, .unit = Unit::kLength, .doc = "largest point error that may pass"})
      .structural("violationRate", 0.01,
                  {.min = 0, .max = 1, .doc = "share of frames that may pass although they exceed it"})
      .out("outPoints", Type::kPoints)
      .array()
      .out("score", Type::kDouble)
      .out("hit", Type::kBool, "the full evaluation is not needed at all")
      .out("fullWeight", Type::kDouble,
           "share of the full evaluation in the points: 0 a hit, between 0 and 1 a blend, 1 a miss")
      .out("missReason", Type::kInt)
      .out("offender", Type::kInt)
      .compute<Compute>()
      .decide<Decide>()
      .block(&ComputeBlock)
      .demand(DemandKpsa)
      .bind(BindKpsa)
      .point_count([](const Structural& s, std::string_view, int element) -> Result<Index> {
        const auto* config = s.asset<KpsaConfig>("config");
        if (config == nullptr) return Status::Invalid("config is not set");
        const auto& outputs = config->data().subspace->outputs;
        return element < static_cast<int>(outputs.size())
                   ? static_cast<Index>(outputs[static_cast<std::size_t>(element)].points)
                   : 0;
      })
      .cost(20000, 5);
}

KpsaTimes KpsaTimesOf(const Plan& plan, const Profile& profile) {
  std::array<std::uint64_t, ComputeHost::kMaxParts> sum{};
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (std::string_view(plan.step_type(s)) != "kpsa") continue;
    for (std::size_t part = 0; part < sum.size(); ++part) sum[part] += profile.part_ns()[s][part];
  }
  const auto of = [&](KpsaPart part) { return sum[static_cast<std::size_t>(part)]; };
  return {of(KpsaPart::kCues), of(KpsaPart::kProjection), of(KpsaPart::kReconstruction)};
}

}  // namespace kpsa::engine
