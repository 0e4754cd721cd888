// What a bench says of a variant of the rig that is nearer to the truth (light by more paths): how far the
// full side, the accelerated ones and a rival are from it. A rival is a variant that costs less than the full
// side.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/bench/side.h"
#include "host/open_rig.h"

namespace kpsa::engine {

// One evaluation.
struct FromReference {
  std::string name;            // "accelerated", "full", or the rival's variant
  std::vector<double> rms;     // by output, over all frames
  std::vector<double> frames;  // by frame: the largest of an output's RMS
  double ms = 0;               // a frame
};
struct ReferenceTable {
  std::string variant;
  std::vector<std::string> outputs;
  std::size_t points = 0, of_points = 0;  // a frame: where the reference was evaluated
  std::vector<FromReference> rows;
};

class BenchReference {
 public:
  BenchReference(std::optional<std::string> variant, std::optional<std::string> rival);
  ~BenchReference();

  // Anew for every clip; full: the plan whose outputs are compared. Without a variant nothing happens here
  // and in what follows.
  Status Load(const RigOpener& opener, const RigChange& clip, const Plan& full, const SideOptions& options);
  Side* rival() const;  // null where there is none; timed by the caller
  // A frame that all sides have evaluated, the full one first.
  Status AddFrame(double time, const std::vector<Side*>& sides);
  void AddTimes();  // of the rival's clip
  // Of the accelerated side with this number, counted from 0.
  ReferenceTable Table(std::size_t accelerated, double full_ms, double accelerated_ms) const;

 private:
  struct Variant;  // its rig and side
  struct Sums;     // of one evaluation
  // points: by output; none: all of them.
  static Result<std::unique_ptr<Variant>> LoadVariant(const RigOpener& opener, const RigChange& change,
                                                      const std::vector<std::string>& outputs,
                                                      const std::vector<PointSet>& points,
                                                      const SideOptions& options);

  const std::optional<std::string> variant_, rival_;
  std::unique_ptr<Variant> reference_, beside_;
  std::vector<PointSet> points_;  // by output
  std::vector<std::string> outputs_;
  std::vector<Sums> sums_;  // of the sides, then the rival
  double rival_ns_ = 0;
  std::size_t rival_frames_ = 0;
};

}  // namespace kpsa::engine
