// What the KPSA nodes decided, frame after frame: hits, blends and misses, and why.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/acceleration.h"
#include "host/decisions.h"

namespace kpsa::engine {

// Of all nodes: the decision of the one with the largest share of the full evaluation, of equal ones with the
// largest score.
struct FrameRecord {
  std::int64_t frame = 0;
  FrameDecision decision;
};

// Why frames were no hits, counted.
class Reasons {
 public:
  void Add(const std::string& text, const std::string& frame);  // the name of the frame: "frame 12"
  // "most frequent reason (28 frames, first at frame 10): jaw.matrix is outside its trained range"; "" where
  // all hit.
  std::string MostFrequent() const;

 private:
  struct Reason {
    std::string text, first_frame;
    std::size_t count = 0;
  };
  std::vector<Reason> reasons_;
};

class Verdicts {
 public:
  explicit Verdicts(const std::vector<AppliedSubspace>& applied) : applied_(&applied) {}
  // Adds to a request what Add reads: four outputs a node.
  void Ask(const Rig& rig, Request* request);
  void Add(std::int64_t frame, const Evaluator& evaluator);  // its number, for texts

  const std::vector<FrameRecord>& records() const { return records_; }
  const std::vector<FrameDecision>& last() const { return last_; }  // of the last frame, one a node
  std::size_t frames() const { return records_.size(); }
  std::size_t count(FrameVerdict verdict) const { return counts_[static_cast<std::size_t>(verdict)]; }
  std::size_t hits() const { return count(FrameVerdict::kHit); }
  double hit_rate() const {
    return frames() == 0 ? 0 : static_cast<double>(hits()) / static_cast<double>(frames());
  }
  // The largest of those that were measured; not a number where none was.
  double worst_score() const { return worst_score_; }
  std::int64_t worst_frame() const { return worst_frame_; }  // that has it
  std::string MostFrequentReason() const { return reasons_.MostFrequent(); }

 private:
  const std::vector<AppliedSubspace>* applied_;
  Index first_output_ = 0;
  std::size_t counts_[3] = {};
  std::int64_t worst_frame_ = 0;
  double worst_score_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<FrameRecord> records_;
  std::vector<FrameDecision> last_;
  Reasons reasons_;
};

}  // namespace kpsa::engine
