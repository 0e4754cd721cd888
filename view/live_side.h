// A rig, full or accelerated, that follows a page: what is asked for again costs nothing, what changes a little costs
// little, and poses in any order are as those of a fresh evaluation.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "graph/evaluator.h"
#include "host/acceleration.h"
#include "host/decisions.h"
#include "host/playing.h"
#include "host/run_up.h"
#include "view/live_pose.h"

namespace kpsa::engine {

// Used by one thread at a time. Keeps an evaluator for each of the kMostKept clips, with the plugs that take over from
// them, that were asked for last.
class LiveSide {
 public:
  // `rest`: no clip plays; it outlives this. No acceleration: the full evaluation.
  LiveSide(const Rig& rest, std::optional<AccelerationChoice> acceleration);
  // Matrices alone are evaluated, and no points: plugs of the rig's graph.
  LiveSide(const Rig& rest, std::vector<PlugRef> matrices);

  // Brings the points of the shown meshes up to date. Errors, with places in the rig's files: what does not compile or
  // evaluate; nothing below is of any use then.
  Status Evaluate(const LivePose& pose);

  // Of the latest pose. x y z of each vertex of all shown meshes, metres, world space; [V, 3] of
  // StackedVertices (report/page_rig.h).
  Status CopyPoints(std::span<float> xyz) const;
  const Matrix4& MatrixOf(std::size_t n) const {
    return now_->evaluator->Get<Matrix4>(static_cast<Index>(n));
  }
  // What it took to bring the points here from those of the pose before.
  double microseconds() const { return now_->microseconds; }
  // Of an accelerated side: of the entry with the largest share of the full evaluation.
  std::optional<FrameDecision> Decision() const;
  // Controls that are not where the rig rests them, because the clip drives them or the rig was posed: names, and
  // numbers in the file's units.
  Result<std::vector<std::pair<std::string, double>>> Values();
  // The rig as it plays, with plugs taken over from the clip, and the subspaces where it is accelerated.
  const Playing& playing() const { return *now_->playing; }
  const Plan& plan() const { return *now_->plan; }

  static constexpr std::size_t kMostKept = 6;

 private:
  struct Touched {  // a varying plug that some pose moved
    PlugRef plug;
    PlugHandle handle;
    Value initial;
  };
  struct Shown {  // a control whose value is told
    const Control* control = nullptr;
    Index output = kNoIndex;  // of the plan; kNoIndex: it is `number` where no pose moves it
    double number = 0;        // runtime units
  };
  struct Kept {
    std::optional<std::string> clip;
    std::vector<MovedPlug>
        taken;  // that the graph has: driven by the clip elsewhere (number 0), or no controls
    std::shared_ptr<Playing> playing;
    std::shared_ptr<const Plan> plan;
    Index wanted = 0;  // outputs that every pose evaluates
    std::unique_ptr<Evaluator> evaluator;
    std::optional<RunUp> run_up;
    std::vector<Touched> touched;
    std::vector<Shown> shown;
    std::vector<MovedPlug> moved;  // by the latest pose, that failed or not
    std::optional<LivePose> at;    // what the evaluator's points are of
    double microseconds = 0;
    std::uint64_t used = 0;
  };
  Result<Kept*> Find(const std::optional<std::string>& clip, const std::vector<MovedPlug>& taken);
  Result<std::unique_ptr<Kept>> Make(const std::optional<std::string>& clip,
                                     const std::vector<MovedPlug>& taken);
  void AskForControls(Request* request, Kept* kept) const;
  void AddPosedControls(Kept* kept) const;
  static void Forget(const LivePose& pose, Kept* kept);
  static Status Move(const LivePose& pose, Kept* kept);
  Status Pull(const LivePose& pose, Kept* kept) const;

  const Rig& rest_;
  std::optional<AccelerationChoice> acceleration_;
  std::vector<PlugRef> matrices_;  // instead of points
  std::vector<std::unique_ptr<Kept>> kept_;
  Kept* now_ = nullptr;
  std::uint64_t uses_ = 0;
};

}  // namespace kpsa::engine
