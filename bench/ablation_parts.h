// What each part of training is worth: a rig is trained as `kpsa train` does, once with everything and then
// without one part at a time, and all that comes out takes turns on the test clips, as `kpsa bench` times it.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine::ablation {

struct PartsOptions {
  std::string folder;  // for the subspaces
  int runs = 5;
  std::size_t key_points = 80;  // of paper mode
  // As those of `kpsa train`; 0: as many as the rig says, or as training chooses.
  std::size_t samples = 0, calibration_poses = 0;
  std::function<void(const std::string& what)> progress;  // may be null
};

struct PartsRow {
  std::string what;                        // "everything", "no world matrices"
  bool by_tile = false, in_parts = false;  // cues of each tile; parts miss by themselves
  std::size_t cue_points = 0, cue_scalars = 0, cue_products = 0;
  double training_seconds = 0, bytes_per_point = 0;
  double held_out_hits = 0;                 // ExpectedHitRate
  double expected_speedup = 0;              // as `kpsa train` predicts it: of such poses, misses included
  double hits = 0;                          // of the test frames
  double ms = 0, full_ms = 0;               // a test frame, misses included
  double speedup_on_hits = 0, speedup = 0;  // not a number where there are none
  bool accepts = false;                     // a test frame
  double largest_accepted = 0;              // tolerances
  bool kept = false;                        // the promise, on the test frames
  double rms = 0, max = 0;                  // where every test frame is reconstructed, % of the diagonal
};

// One part of TrainOptions that is switched off, or the paper's method.
struct Part {
  const char* what;
  std::function<void(TrainOptions*)> change;
};
std::vector<Part> Parts();

// The rig's first accelerate entry, on its test clips.
Result<std::vector<PartsRow>> CompareParts(const std::string& rig, std::span<const Part> parts,
                                           const PartsOptions& options);

std::string PartsText(std::span<const PartsRow> rows);
std::string PartsMarkdown(std::span<const PartsRow> rows);

}  // namespace kpsa::engine::ablation
