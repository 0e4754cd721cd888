// The trained object: immutable, shared by all threads and evaluators, and its file (.kpsa). At run time:
//
//   SubspaceScratch scratch(subspace);                     // once a thread
//   Measure(subspace, raw, &scratch);                      // raw cue values -> y
//   Verdict v = Judge(subspace, threshold, &scratch);      // SoftCache
//   subspace.tiles[output].Reconstruct(scratch.inputs(), points)  // -> points, or inner ones (kpsa/tiles.h)
//
// None of these allocates. The file is safetensors (files/safetensors.h) with kind "kpsa-subspace".
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "kpsa/calibration.h"
#include "kpsa/patches.h"
#include "kpsa/signature.h"
#include "kpsa/soft_cache.h"
#include "kpsa/stepped_points.h"
#include "kpsa/tile_mends.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {

// What a file may be of; 9 is what is written, or 10 where inner points are reconstructed, 11 where points are mended,
// 12 where inner points are of some tiles, 13 where calibration poses hold controls over clips, 14 where there is a limit
// of activity, 15 where patches miss by themselves in blends only, 16 where a last step is of single points, 17 where patches
// miss there. 3: without products of latents, world matrices as
// cues, and doubts; 4: without products as cues; 5: without patches; 6: without guards of patches; 7: without calibration
// poses near clips; 8: cues, ranges and the trained rig are JSON, and not tensors; 9: without inner points
inline constexpr int kSubspaceVersion = 17, kSteppedPatchesVersion = 17, kSteppedPointsVersion = 16,
                     kBlendsVersion = 15, kActivityVersion = 14, kHeldVersion = 13, kPartialVersion = 12,
                     kMendsVersion = 11, kInnerVersion = 10, kListsVersion = 9, kOldestVersion = 3;
inline constexpr std::size_t kMaxCueJoints = 64;
inline constexpr const char* kLightUnits = "light";

// A factor of a product, of a measured value: (value - centre) * scale, as a hinge at least 0.
struct ProductCurve {
  double centre = 0, scale = 1;
  bool hinge = false;
  double Of(double value) const {
    const double moved = (value - centre) * scale;
    return hinge && moved < 0 ? 0 : moved;  // not a number stays that
  }
  friend bool operator==(const ProductCurve&, const ProductCurve&) = default;
};

// Where a cue is measured. A point has 3 rows (x, y, z), others 1; rows follow the order of the cues.
struct CueDescription {
  enum class Kind : std::uint8_t { kPoint, kScalar, kProduct } kind = Kind::kPoint;
  std::string plug;   // scalars: "node.attr"; points: ""
  std::string stage;  // points: the stage of the deformer stack, "mush"
  Index mesh = 0;     // points: index among the outputs
  Index point = 0;    // points: index within the mesh, in stored order
  // The joint in whose space it is measured, by its world matrix, or "": points, and entries of world
  // matrices.
  std::string joint = {};
  // Products: of one or two scalars (kpsa/training/cue_products.h), within [lo, hi].
  struct Factor {
    std::string plug;
    ProductCurve curve;
    friend bool operator==(const Factor&, const Factor&) = default;
  };
  std::vector<Factor> factors = {};
  double lo = 0, hi = 0;
  friend bool operator==(const CueDescription&, const CueDescription&) = default;
};

// What the score of a pose is made of: the larger of SoftCache's own (kpsa/soft_cache.h) and of the largest
// doubt of all tiles (kpsa/tiles.h, scene units), each times its weight; at 0 a part does not count.
struct ScoreMix {
  double measured = 1, doubt = 0;
  double Of(double measured_score, double largest_doubt) const {
    return std::max(measured * measured_score, doubt * largest_doubt);
  }
  friend bool operator==(const ScoreMix&, const ScoreMix&) = default;
};

struct SubspaceOutput {
  std::string name;  // "head_mesh@mush"
  std::size_t points = 0;
  std::string stage = {};  // of a mesh: what comes after its '@'; either may hold more of them
  // What is reconstructed instead of them: the inner points of the last step (graph/last_step.h) of the node that they
  // come from, which then runs; 0: the points themselves.
  std::size_t inner = 0;
  // Where only some points go through the step, and the others are reconstructed as they come out (kpsa/partial_step.h);
  // empty: all do.
  SteppedPoints stepped = {};
  std::size_t reconstructed() const { return inner > 0 ? inner : points; }
  bool HoldsInner(std::size_t tile) const;  // a point of the tile is an inner one
  friend bool operator==(const SubspaceOutput&, const SubspaceOutput&) = default;
};

// [rows x columns], column by column.
struct ModeMatrix {
  std::size_t rows = 0, columns = 0;
  std::vector<float> values;  // rows * columns
  friend bool operator==(const ModeMatrix&, const ModeMatrix&) = default;
};

struct Subspace {
  EstimatorMode mode = EstimatorMode::kMap;
  int components = 3;     // of the outputs: 3 or 1
  std::size_t modes = 0;  // M
  std::vector<SubspaceOutput> outputs;
  std::vector<CueDescription> cues;         // [K]
  std::vector<double> cue_mean, cue_scale;  // [r] y = (raw - mean) * scale
  SoftCacheModel soft_cache;
  ScoreMix score;
  PatchLayout patches;  // what may miss by itself; only where the score counts doubts
  std::vector<CalibrationPair>
      calibration;  // held-out poses; the threshold follows from a tolerance (Calibrate)
  double tolerance = 0, violation_rate = 0.01,
         blend_start = kBlendStart;  // the trained defaults; scene units
  std::vector<TileMap> tiles;        // [outputs]
  std::vector<TileMend> mends;       // of outputs without inner points, by output and tile
  // A [cN x M], of all outputs one after the other, where training was asked to keep it; else empty. Reports
  // split errors with it (kpsa/training/error_split.h); no frame needs it, so of a file it is copied and
  // checked only where asked for.
  ModeMatrix kept_modes;
  // Empty, and tiles read y; or, where all points depend on all cues (light), Q [M x r], column by column,
  // and tiles read z = Q y.
  std::vector<float> latent;
  std::vector<TrainedRange> ranges;  // every varying plug upstream
  // Of what is out of rest at once (kpsa/activity.h); infinite: there is none
  double activity_limit = std::numeric_limits<double>::infinity();
  bool of_light() const { return units == kLightUnits; }
  // Tiles have cues of their own, and their doubts alone judge: SoftCache's own score speaks of all points,
  // and would say of no part that it misses.
  bool by_tile() const { return doubt_inputs() > 0 && soft_cache.factor.size() == 0; }
  TrainedRig rig;                // what it was trained on,
  std::string rig_hash;          // and the SignatureDigest of that
  std::string units = "m";       // of points and errors; kLightUnits: numbers, and errors are RMS of a frame
  std::string space;             // "" world or mesh space, else the joint
  Matrix4 inverse_rest_stretch;  // of the space (kpsa/space_frame.h)
  double extent = 0;             // metres: diagonal of the mean shape, or 0 where a stretch is no length
  std::vector<std::string> carried;  // transforms up from the space that move the points with it: no guards
  bool space_scales = false;         // a uniform scale above the space scales the points in it and no more
  std::string training = "{}";       // JSON: summary of the training (kpsa/training_record.h)
  std::size_t rows() const { return cue_mean.size(); }  // r
  std::size_t doubt_inputs() const;                     // what LargestDoubt leaves; 0 without products
  std::size_t tile_inputs() const { return latent.empty() ? rows() : latent.size() / rows(); }
  bool of_inner() const;           // inner points of some output are reconstructed
  std::size_t tile_count() const;  // of all outputs
  std::vector<std::size_t> tiles_of_outputs() const;
};

// Where a cue is measured, in words: "head_mesh@skin", the mesh of a point at its stage, or a scalar's plug.
std::string CueName(const Subspace& subspace, const CueDescription& cue);

// Consistency of all sizes and indices; every error says what. ReadSubspace and WriteSubspace call it.
Status ValidateSubspace(const Subspace& subspace);

Status WriteSubspace(const Subspace& subspace, const std::string& path);
// Subspace::kept_modes, which may be most of a file: copied and checked, or left out.
enum class KeptModes : std::uint8_t { kSkip, kRead };
// Errors: as SafetensorsFile::Read; another kind of file; a newer version; any part that is missing or
// inconsistent.
Result<Subspace> ReadSubspace(const std::string& path, KeptModes modes = KeptModes::kSkip);

// Everything that changes while a subspace is used. One a thread.
struct SubspaceScratch {
  explicit SubspaceScratch(const Subspace& subspace);
  AlignedFloats y;  // [r, padded to 16]
  AlignedFloats g;  // the same size
  AlignedFloats t;  // [doubt_inputs()]
  AlignedFloats z;  // [M] what tiles read instead of y, or empty
  std::span<const float> inputs() const { return z.size() > 0 ? z.span() : y.span(); }
};

// y[j] = (raw[j] - mean) * scale, in float32.
void Normalize(const Subspace& subspace, std::span<const double> raw, std::span<float> y);
// z = Q y; the same bits on every SIMD target.
void ToLatent(const Subspace& subspace, std::span<const float> y, std::span<float> z);
// raw [r] in scene units -> scratch->y and inputs().
void Measure(const Subspace& subspace, std::span<const double> raw, SubspaceScratch* scratch);
// The verdict on y, padded with zeros as SubspaceScratch has it (g: as many). Guards are the caller's. For
// MissReason::kDoubt the offender is a tile, counted over all outputs. Where the score counts doubts, the
// inputs of all tiles are left in `inputs` [doubt_inputs()], output after output, unless y is not finite.
Verdict Judge(const Subspace& subspace, const SoftCacheThreshold& threshold, std::span<const float> y,
              std::span<float> g, std::span<float> inputs);
Verdict Judge(const Subspace& subspace, const SoftCacheThreshold& threshold, SubspaceScratch* scratch);
// The same where patches miss by themselves: the verdict is that of the worst of them; and the score of each
// patch. doubts: [tile_count()], as scratch.
Verdict JudgePatches(const Subspace& subspace, const SoftCacheThreshold& threshold, std::span<const float> y,
                     std::span<float> g, std::span<float> inputs, std::span<float> doubts,
                     std::span<double> scores);
// The largest doubt of all outputs; the tile counts over them. inputs: as above. doubts: of every tile
// [tile_count()], or empty.
Doubt LargestDoubt(const Subspace& subspace, std::span<const float> y, std::span<float> inputs,
                   std::span<float> doubts = {});
// The largest of each patch, of something that all tiles have: doubts, errors.
void LargestOfPatches(const Subspace& subspace, std::span<const float> of_tiles, std::span<double> patches);
// points = (1 - full_weight) * points + full_weight * full, where Verdict::full_weight is in (0, 1).
void BlendPoints(double full_weight, ConstPointsView full, PointsView points);

}  // namespace kpsa::engine
