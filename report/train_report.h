// What training gave, as text and as JSON.
#pragma once

#include <memory>
#include <string>

#include "host/bench/tolerance_table.h"
#include "host/checks/expected_speedup.h"
#include "host/checks/subspace_check.h"
#include "kpsa/calibration.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

struct TrainResult {
  std::string rig, path;  // of the files
  bool own_path = true;   // the rig names this subspace itself
  std::shared_ptr<const Subspace> subspace;
  TrainingRecord record;
  Calibration calibration;
  SubspaceCheck check;
  double seconds = 0;      // of training and the check
  std::string worst_path;  // of the pose file, "": no pose is accepted
  ToleranceTable tolerances;
  std::size_t points() const;
  double hit_rate() const { return ExpectedHitRate(calibration); }
  double speedup() const { return ExpectedSpeedup(check, calibration); }
};

// Times in milliseconds, lengths in metres.
std::string TrainJson(const TrainResult& r);
// The accepted calibration pose that is farthest off, as a pose file (rig/build/rig_builder.h).
std::string WorstPoseText(const TrainingRecord& record, const std::string& subspace);
// For people, with the next command.
std::string TrainText(const TrainResult& r);

}  // namespace kpsa::engine
