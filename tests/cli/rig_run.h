// Rigs that a test trains and runs in its own process: with or without a subspace, posed by plugs' names.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// All node types and the KPSA node.
const NodeRegistry& AcceleratedRegistry();

// A rig of m.gltf, both written into the folder, m.yaml by what follows "character: m.gltf".
Result<Rig> LoadRigOf(const TemporaryFolder& folder, const std::string& gltf, const std::string& yaml);

// Trains the first entry of the rig's accelerate section. Fails the test and gives null where that does not
// work.
std::shared_ptr<const Subspace> TrainRig(const std::string& path, const TrainOptions& options,
                                         const std::vector<std::string>& clips = {});
// A copy of the subspace that calls a hit what scores at most `tau_lo`, and blends up to `tau`, at any finite
// tolerance; misses are of all points.
std::shared_ptr<const Subspace> WithThreshold(const Subspace& subspace, double tau_lo, double tau);
// A copy of the subspace that accepts any finite score, at any finite tolerance: nothing but its guards, its
// space and cues that are no numbers ask for the full evaluation. (An infinite tolerance skips guards, too.)
std::shared_ptr<const Subspace> WithGuardsOnly(const Subspace& subspace);

// What one evaluation gave.
struct RunFrame {
  std::vector<float> points;  // x, y, z of every mesh
  bool hit = false;           // false for a rig without a subspace
  double score = 0;
  double full_weight = 0;  // share of the full evaluation: 0 a hit, 1 a full miss
  MissReason reason = MissReason::kNone;
  std::string text;  // of the reason
};
inline bool SameBytes(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}
// The largest distance of two points of x.., y.., z.. of one mesh; infinite where one is not finite.
double LargestDistance(const std::vector<float>& a, const std::vector<float>& b);

struct RigRunOptions {
  std::shared_ptr<const Subspace> subspace = {};  // null: the rig itself
  AccelerateOptions accelerate = {};
  std::optional<std::string> clip = {};   // unset: the rest pose
  std::vector<std::string> varying = {};  // besides time and the controls, and known to the subspace's guards
  std::vector<std::string> secret = {};   // the same, but no guard knows of them
  EvaluatorOptions evaluator = {};
};

class RigRun {
 public:
  explicit RigRun(const std::string& path, const RigRunOptions& options = {});
  bool ok() const { return evaluator != nullptr; }

  void Set(const std::string& plug, double value) { Set(plug, value, evaluator.get()); }
  void Set(const std::string& plug, double value, Evaluator* to) const;
  void SetTime(double seconds) { evaluator->Set(plan->FindVarying(rig.scene.time), seconds); }
  // Values by control, in the rig's order.
  void Pose(std::span<const double> values) { Pose(values, evaluator.get()); }
  void Pose(std::span<const double> values, Evaluator* to) const;
  RunFrame Evaluate();
  RunFrame Frame(const Evaluator& from) const;  // of an evaluator of this plan that is up to date
  // How often steps of a node computed, all evaluations of `evaluator` together.
  std::uint64_t Computes(const std::string& node) const;

  Rig rig;
  AccelerationTarget target;
  Accelerated accelerated;
  Compiler compiler;
  std::shared_ptr<const Plan> plan;
  std::unique_ptr<Evaluator> evaluator;
  std::unique_ptr<Profile> profile;
  std::string error;  // why there is no evaluator

 private:
  Status Start(const std::string& path, const RigRunOptions& options);
  bool has_subspace_ = false;
};

// How many frames of a clip hit, the first ones, at 24 a second.
std::size_t HitsOf(const std::string& path, std::shared_ptr<const Subspace> subspace, const std::string& clip,
                   int frames);

// Poses along a smooth path through the controls' ranges, `reach` times as far as they go.
std::vector<std::vector<double>> SmoothPoses(const Rig& rig, std::size_t count, double reach,
                                             double speed = 0.37);

// Some points of the first output of the KPSA node, evaluated alone, have the bits that they have among all.
void ExpectBitsOfAll(RigRun* run, const std::vector<std::vector<Index>>& sets);

}  // namespace kpsa::engine
