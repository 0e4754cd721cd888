// What the program makes of a character as it is: kpsa init, train and bench, each as a user types it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine::untouched {

// Figures as `kpsa train --json` and `kpsa bench --json` give them.
struct Row {
  std::string character, test_clip;
  std::size_t points = 0, joints = 0, morphs = 0;
  double training_seconds = 0;
  std::size_t training_bytes = 0;           // the most memory that training took at once
  double tolerance = 0;                     // metres
  double held_out_hits = 0;                 // share of the trainer's own poses
  double predicted = 0;                     // speedup, by the trainer
  double hits = 0;                          // share of the test clip's frames
  double speedup_on_hits = 0, speedup = 0;  // not a number where there are none
  double largest_error = 0;                 // in tolerances; infinite where it is not finite
  bool accepts = false;                     // at least one frame of the test clip, as a hit or a blend
  bool kept = false;                        // the promise, on the test clip
};

// `program` is kpsa; the rig and the subspace are written into the folder, which is there. training: arguments of
// `kpsa train` beside. What the program says comes to stderr. Errors: it cannot be started, it fails, it prints what is
// not its JSON.
Result<Row> TryCharacter(const std::string& program, const std::string& name, const std::string& character,
                         const std::string& folder, const std::vector<std::string>& training = {});

std::string RowsText(std::span<const Row> rows);
std::string RowsMarkdown(std::span<const Row> rows);

}  // namespace kpsa::engine::untouched
