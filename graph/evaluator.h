// Values, stamps and pulls: everything that changes while a plan is evaluated. One evaluator a thread; the
// plan is shared.
//
// Setting a varying plug marks what depends on it as dirty (bits, no computation). A pull runs the dirty
// steps that the wanted outputs need, in plan order: a step is stale if an input changed since it last
// computed; small outputs that come out equal do not make their consumers stale. Lazy segments run only when
// their owner's decide says so. A warm evaluation allocates nothing and takes no lock.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/plan.h"
#include "graph/profile.h"
#include "graph/workspace.h"

namespace kpsa::engine {

struct EvaluatorOptions {
  bool parallel = false;           // independent steps and wide kernels on the thread pool; the same bytes
  Workspace* workspace = nullptr;  // shared by evaluators of one thread, outlives them; null: one of its own
};

class Evaluator final {
 public:
  explicit Evaluator(std::shared_ptr<const Plan> plan, EvaluatorOptions options = {});
  ~Evaluator();
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;
  const Plan& plan() const { return *plan_; }

  // Where a plug takes values. A plug that the request did not name as varying is an error.
  Result<PlugHandle> FindVarying(const Graph& graph, const PlugRef& plug) const;
  // Sets what a handle of this plan names, in the runtime's units; an equal value changes nothing. A value of
  // another type (whole numbers fit doubles, and doubles without a fraction fit int, enum and bool), one that
  // is not finite or outside of the attribute's range, and a handle of another plan are errors, and change
  // nothing.
  Status Set(const PlugHandle& plug, const Value& value);
  // As many points as the plug had when the plan was made.
  Status SetPoints(const PlugHandle& plug, ConstPointsView points);

  // The same without a check of the value, for numbers of varying plugs that Plan::FindVarying gave: a wrong
  // type is a programmer's error. `component` sets one number of a double3 or quaternion.
  void Set(Index varying, double value, int component = -1);
  void SetInt(Index varying, std::int64_t value);
  void Set(Index varying, const Double3& value);
  void Set(Index varying, const Quaternion& value);
  void Set(Index varying, const Matrix4& value);
  void SetPoints(Index varying, ConstPointsView points);

  // Brings outputs up to date: all of them, or one. On failure the error names the node; other outputs may be
  // fine.
  Status Evaluate();
  Status Pull(Index output);
  // An output after a pull. T is the slot type. Points are in the order of the request's set.
  template <typename T>
  const T& Get(Index output) const {
    return *reinterpret_cast<const T*>(values() + plan_->outputs()[output].slot);
  }
  ConstPointsView Points(Index output) const { return Get<ConstPointsView>(output); }

  // Whether an output is up to date without a pull.
  bool IsFresh(Index output) const {
    const Index producer = plan_->outputs()[output].producer;
    return producer >= plan_->steps().size() || !dirty(producer);
  }

  // Records what runs from now on, as of that frame. Null to stop: then evaluation pays nothing for it.
#ifndef KPSA_WITHOUT_RECORDING  // defined by the test that compares the two
  void Record(Profile* profile, int frame = 0) { profile_ = profile, frame_ = frame; }
#endif
  // Forgets every computed value (not the set ones): the next pull computes everything.
  void Invalidate();
  // As Invalidate; nodes that remember their previous frame (NodeDef::stateful) forget it, too, so that
  // frames may start from the first one again.
  void Restart();
  std::size_t MemoryBytes() const;

  // For blocks of frames (graph/frames.h): one evaluation, cut at the steps of segment 0 that blocks share.
  // Serial only.
  //   BeginRun; for every such step in plan order: RunUntil(step), PrepareBlockStep, FinishBlockStep; EndRun.
  // After a failure nothing more runs; EndRun tells.
  void BeginRun();
  void RunUntil(Index end);  // the steps of segment 0 before `end`
  // Runs the decide of a stale step. True if it needs none of its lazy inputs: then *context is ready for a
  // block compute, to be followed by FinishBlockStep. Otherwise the step is done: it is fresh, has run by
  // itself, or has failed.
  bool PrepareBlockStep(Index step, ComputeContext* context);
  void FinishBlockStep(Index step, std::uint64_t begin_ns, std::uint64_t end_ns);  // times for the profile
  Status EndRun();

 private:
  class StepHost;
  std::byte* values() { return reinterpret_cast<std::byte*>(values_.get()); }
  const std::byte* values() const { return reinterpret_cast<const std::byte*>(values_.get()); }
  template <typename T>
  void Write(Index varying, const T& value, std::size_t offset);
  void Changed(Index varying);
  const std::uint64_t* NeedsOf(Index output);
  ComputeContext ContextOf(const Plan::Step& step);
  Index NewerDep(Index step) const;
  Index NewerLazyDep(Index step) const;
  template <bool kRecord>
  bool RunRange(Index begin, Index end);
  template <bool kRecord>
  bool RunPlain(Index step);
  bool TryBatch(Index step, Index end);
  template <bool kRecord>
  bool RunStep(Index step);
  template <bool kRecord>
  bool RunUnit(Index first);
  template <bool kRecord>
  bool RunBranch(Index step);
  template <bool kRecord>
  bool RunDecided(Index step, Index cause);
  template <bool kRecord>
  bool Compute(Index step, Index cause, bool stale);
  bool Run(const Plan::Segment& segment, Index begin, Index end);
  bool RunLevels(const Plan::Segment& segment, Index begin, Index end);
  bool Decide(Index step, Index* cause);
  bool RunChosen(Index step);
  bool RunAll(Index segment);
  bool RunShared(Index segment);
  bool RunSegment(Index segment);
  void NextRun();
  void OwnWorkspace(Index segment);
  void AddEvent(Index step, Index cause, std::uint64_t begin_ns, std::uint64_t end_ns);
  void RecordFailure(Index step, std::string_view message);
  void RecordCancelled(Index step);
  Status TakeFailure();
  void MarkComputed(Index step, bool changed);
  bool dirty(Index step) const { return (dirty_[step / 64] >> (step % 64) & 1) != 0; }
  bool wanted(Index step) const { return wanted_ == nullptr || (wanted_[step / 64] >> (step % 64) & 1) != 0; }
  void SetDirty(Index begin, Index end);
  void ClearDirty(Index step) { dirty_[step / 64] &= ~(std::uint64_t{1} << (step % 64)); }

  std::shared_ptr<const Plan> plan_;
  EvaluatorOptions options_;
  std::unique_ptr<Workspace> own_workspace_;
  Workspace* workspace_;
  std::unique_ptr<std::uint64_t[]> values_;
  AlignedFloats buffers_;
  AlignedFloats state_;
  std::vector<std::uint32_t> changed_;     // by producer: the epoch in which its value last changed
  std::vector<std::uint32_t> computed_;    // by step: the epoch in which it last computed; 0 never
  std::vector<std::uint64_t> chosen_;      // by branch
  std::vector<std::uint64_t> dirty_;       // bits, by step
  const std::uint64_t* wanted_ = nullptr;  // bits, by step, during a pull of one output; null: all
  std::vector<std::uint64_t> walked_;      // those of walked_output_, where the plan does not have them
  Index walked_output_ = kNoIndex;
  std::vector<std::uint64_t> taking_;  // by segment: the taking of the workspace in which it ran
  std::uint64_t takings_ = 0;
  std::vector<Index> stack_;          // steps to visit
  std::vector<Index> ready_;          // first steps of units of a level, for the parallel evaluation
  Index cursor_ = 0;                  // of RunUntil
  std::uint32_t run_ = 0;             // counts BeginRun and Pull
  std::vector<std::uint32_t> asked_;  // by segment: the run in which it was needed by another one
  std::vector<Index> shared_;         // of RunShared, and of those around it
  std::uint32_t epoch_ = 1;
  bool set_since_run_ = false;
  bool clean_ = false;  // nothing is dirty that Evaluate would run
#ifndef KPSA_WITHOUT_RECORDING
  Profile* profile_ = nullptr;
#else
  static constexpr Profile* profile_ = nullptr;
#endif
  int frame_ = 0;
  std::unique_ptr<StepHost> block_host_;  // of the step between PrepareBlockStep and FinishBlockStep
  Index block_cause_ = kNoIndex;
  std::mutex failure_mutex_;  // taken on failures only
  std::string failure_;
  Index failed_step_ = kNoIndex;
  bool cancelled_ = false;  // that, rather than a failure
};

}  // namespace kpsa::engine
