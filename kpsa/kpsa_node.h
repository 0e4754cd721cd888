// The KPSA node: stands in for a deformer stack. It measures its cues, asks SoftCache for a verdict, and
// either reconstructs all points from a trained subspace or lets the full stack run and passes it on bit for
// bit.
//
// Attributes (arrays in the order of KpsaConfig):
//   cues[c]         points of a mesh at a stage, of which only the cue points are demanded
//   matrices[j]     local matrices of transforms: guards and cues
//   scalars[k]      other values: guards and cues
//   spaceMatrix     the frame that the subspace lives in, world space (identity: none)
//   fullPoints[m]   the full evaluation of each mesh; lazy, all together
//   regionPoints[r] the full evaluation of each region of patches (kpsa/patches.h); lazy, each by itself
//   config          KpsaConfig (structural)
//   tolerance       metres, violationRate (structural): SoftCache's threshold follows from the calibration
//   poses outPoints[m], score, hit, fullWeight, missReason, offender
// The engine has no special case for it: everything here could come from a plugin.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "graph/last_step.h"
#include "graph/node_registry.h"
#include "graph/profile.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

// What ties a subspace to the inputs of a node.
class KpsaConfig final : public Asset {
 public:
  struct PointCues {            // of input cues[c]
    std::vector<Index> points;  // ascending
    bool in_space = true;       // measured in spaceMatrix's frame; false: as they are (mesh space)
    bool near = false;          // less what the space has moved since rest (kpsa/near_stack.h)
  };
  // Where row r of the measurement comes from. Points take three rows in a row.
  struct Row {
    enum class Kind : std::uint8_t { kPoint, kMatrix, kScalar, kProduct } kind = Kind::kPoint;
    Index input = 0;         // which cues[], matrices[], scalars[] or Data::products
    Index element = 0;       // position among the cue points; entry of the matrix
    Index joint = kNoIndex;  // into joints: measured in its space
  };
  // Of entries of matrices or of scalars; b may be missing (Row::Kind::kPoint).
  struct Product {
    Row a, b;
    ProductCurve of_a, of_b;
    double lo = 0, hi = 0;
  };
  struct Data {
    std::shared_ptr<const Subspace> subspace;
    std::vector<PointCues> cues;
    std::vector<Row> rows;  // one a cue, in the order of the subspace's
    std::vector<Product> products;
    std::vector<PatchPoints> patches;    // [patches of the subspace]
    std::vector<char> outputs_in_space;  // [outputs] as of cues: they are given in spaceMatrix's frame
    // [outputs] what gives the points from inner ones, where these are reconstructed; else null
    std::vector<std::shared_ptr<const LastStep>> steps;
    // Trained ranges and how guards come in outside of them (TrainedRange); see MatrixEntries
    std::vector<double> matrix_lo, matrix_hi, matrix_ramp;      // [12 * matrices]
    std::vector<double> scalar_lo, scalar_hi, scalar_ramp;      // [scalars]
    std::vector<std::uint64_t> matrix_patches, scalar_patches;  // [matrices], [scalars] TrainedRange::patches
    // TrainedRange::rest and per_reach of the same, where there is a limit (kpsa/activity.h); else empty
    std::vector<double> matrix_rest, matrix_per_reach;  // [12 * matrices]
    std::vector<double> scalar_rest, scalar_per_reach;  // [scalars]
    std::vector<Index> joints;   // into matrices: in whose spaces cues are measured, at most kMaxCueJoints
    std::vector<char> relative;  // [matrices] world matrices, measured relative to spaceMatrix's frame
    std::vector<std::string> guard_names;  // matrices, then scalars
    Double3 rest_origin;                   // of the space
    bool has_space = false;                // spaceMatrix is connected
    bool space_scales = false;             // a uniform scale of it is taken into account
    std::string stretched;                 // what may stretch it: a transform
    bool always_miss = false;              // every frame is evaluated fully:
    std::string always_miss_reason;        // why
  };
  explicit KpsaConfig(Data data);
  const char* kind() const override { return "kpsaConfig"; }
  Digest digest() const override { return digest_; }
  const Data& data() const { return data_; }

 private:
  Data data_;
  Digest digest_;
};

// A tolerance from here on accepts everything that is finite, whatever guards say.
inline constexpr double kAnyError = 1e30;

void AddKpsaNode(NodeRegistry& registry);

// What the node decided, for reports: from its outputs missReason and offender.
std::string MissText(const KpsaConfig& config, MissReason reason, Index offender);

// The parts of the node's work, as a profile counts them (Profile::part_ns).
enum class KpsaPart { kCues, kProjection, kReconstruction };

// Of all KPSA nodes of a plan, as recorded; nanoseconds.
struct KpsaTimes {
  std::uint64_t cues = 0, projection = 0, reconstruction = 0;
};
KpsaTimes KpsaTimesOf(const Plan& plan, const Profile& profile);

}  // namespace kpsa::engine
