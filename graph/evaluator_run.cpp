// How an Evaluator runs: one step, a unit, a segment; serially, by levels on threads, or cut at the steps of
// blocks.
#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <thread>
#include <utility>

#include "base/check.h"
#include "base/prefetch.h"
#include "graph/step_host.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kComparedBytes = 512;  // small outputs beyond are taken as changed
constexpr float kWorthThreadsNs = 20000;     // a level cheaper than this runs on the calling thread
// How many steps before its turn a kernel with points is fetched: what ran since the last frame has put it out of the
// first caches.
constexpr Index kFetchAhead = 2;

}  // namespace

inline ComputeContext Evaluator::ContextOf(const Plan::Step& step) {
  ComputeContext context;
  context.values = values();
  context.in = plan_->tables().data() + step.in;
  context.out = plan_->tables().data() + step.out;
  context.kernel = step.kernel;
  context.scratch = workspace_->data() + step.scratch;
  context.state = reinterpret_cast<std::byte*>(state_.data()) + step.state;
  if (step.branch != kNoIndex) context.chosen = chosen_[step.branch];
  return context;
}

// A dependency that changed after the step computed, or kNoIndex.
inline Index Evaluator::NewerDep(Index number) const {
  const Plan::Step& step = plan_->steps()[number];
  const Index* deps = plan_->deps().data() + step.deps;
  const std::uint32_t computed = computed_[number];
  for (Index d = 0; d < step.deps_count; ++d) {
    if (changed_[deps[d]] > computed) return deps[d];
  }
  return kNoIndex;
}

Index Evaluator::NewerLazyDep(Index number) const {
  const Plan::Branch& branch = plan_->branches()[plan_->steps()[number].branch];
  const std::uint64_t chosen = chosen_[plan_->steps()[number].branch];
  for (std::size_t i = 0; i < branch.lazy_deps.size(); ++i) {
    const Index dep = branch.lazy_deps[i];
    if ((chosen >> branch.bit_of_lazy[i] & 1) != 0 && dep != kNoIndex && changed_[dep] > computed_[number])
      return dep;
  }
  return kNoIndex;
}

void Evaluator::MarkComputed(Index step, bool changed) {
  computed_[step] = epoch_;
  if (changed) changed_[step] = epoch_;
}

// Runs the compute of a step; whether the bytes of its small outputs differ from what they were.
template <std::size_t kBytes>
inline bool ComputeAndCompare(const Plan::Step& step, ComputeContext& context) {
  std::uint64_t old[kBytes / 8], now[kBytes / 8], difference = 0;
  std::memcpy(old, context.values + step.value, kBytes);
  step.compute(context);
  std::memcpy(now, context.values + step.value, kBytes);
  for (std::size_t i = 0; i < kBytes / 8; ++i) difference |= old[i] ^ now[i];
  return difference != 0;
}
inline bool ComputeAndCompare(const Plan::Step& step, ComputeContext& context) {
  switch (step.value_size) {
    case 8:
      return ComputeAndCompare<8>(step, context);
    case sizeof(Double3):
      return ComputeAndCompare<sizeof(Double3)>(step, context);
    case sizeof(Matrix4):
      return ComputeAndCompare<sizeof(Matrix4)>(step, context);
    default:
      break;
  }
  std::byte old[kComparedBytes];
  std::memcpy(old, context.values + step.value, step.value_size);
  step.compute(context);
  return std::memcmp(old, context.values + step.value, step.value_size) != 0;
}

template <bool kRecord>
[[gnu::always_inline]] inline bool Evaluator::Compute(Index number, Index cause, bool stale) {
  const Plan::Step& step = plan_->steps()[number];
  StepHost host(this, number);
  ComputeContext context = ContextOf(step);
  context.host = &host;
  std::uint64_t begin = 0;
  if constexpr (kRecord) begin = ProfileClock();
  bool changed = stale;
  try {
    if (step.value_size > 0 && step.value_size <= kComparedBytes) {
      changed = ComputeAndCompare(step, context) || computed_[number] == 0;
    } else {
      step.compute(context);
    }
  } catch (...) {  // not on to a thread that nobody watches
    host.FailOfThrown(context);
  }
  if constexpr (kRecord) AddEvent(number, cause, begin, ProfileClock());
  if (host.failed) [[unlikely]] {
    computed_[number] = 0;  // what it left in its outputs is no value to compare with
    return false;
  }
  MarkComputed(number, changed);
  return true;
}

void Evaluator::AddEvent(Index step, Index cause, std::uint64_t begin_ns, std::uint64_t end_ns) {
  int thread = 0;  // who it was shows in events that are kept alone
  if (profile_->keep_events)
    thread = static_cast<int>(std::hash<std::thread::id>()(std::this_thread::get_id()) % 1000000);
  profile_->Add({step, cause, begin_ns, end_ns, thread, frame_});
}

template <bool kRecord>
bool Evaluator::RunUnit(Index first) {
  // One buffer goes through all members: if one of them is stale, all run, from the first. Members before the
  // stale one give what they gave before, so their stamps stay.
  const Index end = first + plan_->steps()[first].unit_size;
  Index stale = first;
  while (stale < end && computed_[stale] != 0 && NewerDep(stale) == kNoIndex) ++stale;
  if (stale == end) return true;
  const Plan::Step* const steps = plan_->steps().data();
  const auto fetch = [&](Index s) {
    if (s < end) Prefetch(steps[s].kernel, steps[s].kernel_bytes);
  };
  for (Index s = first; s < first + kFetchAhead; ++s) fetch(s);
  for (Index s = first; s < end; ++s) {
    fetch(s + kFetchAhead);
    Index cause = kNoIndex;
    if constexpr (kRecord) cause = NewerDep(s);
    if (!Compute<kRecord>(s, cause, s >= stale)) {
      for (Index member = first; member < end; ++member) computed_[member] = 0;  // the buffer is torn
      return false;
    }
  }
  return true;
}

bool Evaluator::Decide(Index number, Index* cause) {
  const Plan::Branch& branch = plan_->branches()[plan_->steps()[number].branch];
  *cause = NewerDep(number);
  if (computed_[number] != 0 && *cause == kNoIndex) return true;  // the choice stands
  if (branch.decide == nullptr) return true;
  StepHost host(this, number);
  ComputeContext context = ContextOf(plan_->steps()[number]);
  context.host = &host;
  host.Guard(context, [&] { chosen_[plan_->steps()[number].branch] = branch.decide(context); });
  return !host.failed;
}

// A segment of lazy inputs: all of what is chosen is needed.
bool Evaluator::RunAll(Index g) { return RunShared(g) && RunSegment(g); }

// What it shares with others and has not run yet in this run: sources come later in the plan than what needs them.
bool Evaluator::RunShared(Index g) {
  if (plan_->segments()[g].needs.empty()) return true;
  const std::size_t begin = shared_.size();  // others before it, where it is within one that is shared
  const auto ask = [&](Index segment) {
    for (const Index needed : plan_->segments()[segment].needs) {
      if (std::exchange(asked_[needed], run_) != run_) shared_.push_back(needed);
    }
  };
  ask(g);
  for (std::size_t at = begin; at < shared_.size(); ++at) ask(shared_[at]);
  std::sort(shared_.begin() + static_cast<std::ptrdiff_t>(begin), shared_.end(), std::greater<>());
  bool fine = true;
  for (std::size_t at = begin; at < shared_.size() && fine; ++at) fine = RunSegment(shared_[at]);
  shared_.resize(begin);
  return fine;
}

bool Evaluator::RunSegment(Index g) {
  const Plan::Segment& segment = plan_->segments()[g];
  if (segment.uses_workspace) OwnWorkspace(g);
  const std::uint64_t* const wanted = std::exchange(wanted_, nullptr);
  const bool fine = Run(segment, segment.begin, segment.end);
  wanted_ = wanted;
  return fine;
}

bool Evaluator::RunChosen(Index number) {
  const Index b = plan_->steps()[number].branch;
  const Plan::Branch& branch = plan_->branches()[b];
  Index before = kNoIndex;
  for (std::size_t i = 0; i < branch.segment_of_lazy.size(); ++i) {
    const Index g = branch.segment_of_lazy[i];
    if ((chosen_[b] >> branch.bit_of_lazy[i] & 1) == 0 || g == kNoIndex || g == before) continue;
    before = g;
    if (!RunAll(g)) return false;
  }
  return true;
}

// Where another evaluator used the buffers since this segment ran, what it left in them is gone. Segments
// that do not run now are left as they are: marked as dirty, they would hide later changes from their owners.
void Evaluator::OwnWorkspace(Index g) {
  if (workspace_->owner_ != this) {
    workspace_->owner_ = this;
    ++takings_;
  }
  if (taking_[g] == takings_) return;
  taking_[g] = takings_;
  const Plan::Segment& segment = plan_->segments()[g];
  std::fill(computed_.begin() + segment.begin, computed_.begin() + segment.end, 0);
  SetDirty(segment.begin, segment.end);
}

template <bool kRecord>
bool Evaluator::RunBranch(Index number) {
  Index cause;
  if (Decide(number, &cause)) return RunDecided<kRecord>(number, cause);
  computed_[number] = 0;  // decide again next time
  return false;
}

template <bool kRecord>
bool Evaluator::RunDecided(Index number, Index cause) {
  if (!RunChosen(number)) {
    computed_[number] = 0;
    return false;
  }
  if (cause == kNoIndex) cause = NewerLazyDep(number);
  if (computed_[number] != 0 && cause == kNoIndex) return true;
  return Compute<kRecord>(number, cause, true);
}

// A step that neither decides nor belongs to a unit.
template <bool kRecord>
inline bool Evaluator::RunPlain(Index number) {
  const Index cause = NewerDep(number);
  if (computed_[number] != 0 && cause == kNoIndex) return true;
  return Compute<kRecord>(number, cause, true);
}

// Copies the bytes where they differ; whether they did.
template <std::size_t kBytes>
inline bool Update(std::byte* slot, const std::byte* now) {
  std::uint64_t a[kBytes / 8], b[kBytes / 8], difference = 0;
  std::memcpy(a, slot, kBytes);
  std::memcpy(b, now, kBytes);
  for (std::size_t i = 0; i < kBytes / 8; ++i) difference |= a[i] ^ b[i];
  if (difference != 0) std::memcpy(slot, b, kBytes);
  return difference != 0;
}

// Runs the batch that begins with this step, if it ends before `end` and all of it is wanted and stale.
bool Evaluator::TryBatch(Index number, Index end) {
  const Plan::Batch& batch = plan_->batches()[plan_->steps()[number].batch];
  const Index last = batch.first + batch.count;
  if (number != batch.first || last > end) return false;
  for (Index s = number; s < last; ++s) {
    if (!dirty(s) || !wanted(s) || (computed_[s] != 0 && NewerDep(s) == kNoIndex)) return false;
  }
  BatchContext context;
  context.values = values();
  context.in = plan_->tables().data() + plan_->steps()[number].in;
  context.stride = batch.stride;
  context.kernel = batch.kernel;
  context.out = reinterpret_cast<std::byte*>(workspace_->data() + batch.scratch);
  context.count = batch.count;
  try {
    batch.compute(context);
  } catch (...) {  // one by one, they say whose it is
    return false;
  }
  const std::size_t size = plan_->steps()[number].value_size;
  const std::byte* now = context.out;
  for (Index s = number; s < last; ++s, now += size) {
    std::byte* slot = values() + plan_->steps()[s].value;
    bool changed;
    if (size == sizeof(Matrix4)) {
      changed = Update<sizeof(Matrix4)>(slot, now);
    } else {
      changed = std::memcmp(slot, now, size) != 0;
      if (changed) std::memcpy(slot, now, size);
    }
    MarkComputed(s, changed || computed_[s] == 0);
    ClearDirty(s);
  }
  return true;
}

template <bool kRecord>
bool Evaluator::RunStep(Index number) {
  const Plan::Step& step = plan_->steps()[number];
  if (step.branch != kNoIndex) return RunBranch<kRecord>(number);
  return step.unit_size > 1 ? RunUnit<kRecord>(number) : RunPlain<kRecord>(number);
}

template <bool kRecord>
bool Evaluator::RunRange(Index begin, Index end) {
  const Plan::Step* const steps = plan_->steps().data();
  for (Index w = begin / 64; w * 64 < end; ++w) {
    std::uint64_t bits = dirty_[w];
    if (wanted_ != nullptr) bits &= wanted_[w];
    if (w == begin / 64) bits &= ~std::uint64_t{0} << (begin % 64);
    if ((w + 1) * 64 > end) bits &= ~std::uint64_t{0} >> ((64 - end % 64) % 64);
    for (; bits != 0; bits &= bits - 1) {
      Index step = w * 64 + static_cast<Index>(std::countr_zero(bits));
      if (steps[step].runs_plainly()) [[likely]] {
        dirty_[w] &= ~(bits & (~bits + 1));
        if (RunPlain<kRecord>(step)) [[likely]]
          continue;
        SetDirty(step, step + 1);
        return false;
      }
      if (!dirty(step)) continue;  // done with its unit or batch
      if (!kRecord && steps[step].batch != kNoIndex && TryBatch(step, end)) continue;
      step -= steps[step].unit_offset;
      const Index size = steps[step].unit_size;
      for (Index member = step; member < step + size; ++member) ClearDirty(member);
      if (!RunStep<kRecord>(step)) {
        SetDirty(step, step + size);
        return false;
      }
    }
  }
  return true;
}

bool Evaluator::RunLevels(const Plan::Segment& segment, Index begin, Index end) {
  for (std::size_t level = 0; level + 1 < segment.levels.size(); ++level) {
    const Index first = std::max(begin, segment.levels[level]),
                last = std::min(end, segment.levels[level + 1]);
    if (first >= last) continue;
    // The stale units of the level; branches come after, one by one: their segments use the pool themselves
    ready_.clear();
    float cost = 0;
    for (Index step = first; step < last;) {
      const Plan::Step& s = plan_->steps()[step];
      if (s.batch != kNoIndex && profile_ == nullptr && TryBatch(step, last)) {
        step += plan_->batches()[s.batch].count;
        continue;
      }
      const Index size = s.unit_size;
      bool run = false;
      for (Index member = step; member < step + size; ++member) {
        run = run || (dirty(member) && wanted(member));
      }
      if (run && s.branch == kNoIndex) {
        for (Index member = step; member < step + size; ++member) {
          ClearDirty(member);
          cost += plan_->infos()[member].cost_ns;
        }
        ready_.push_back(step);
      }
      step += size;
    }
    const std::size_t count = ready_.size();
    const auto run_some = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const bool fine = profile_ != nullptr ? RunStep<true>(ready_[i]) : RunStep<false>(ready_[i]);
        if (!fine) continue;  // recorded; the level is finished all the same
      }
    };
    const float each = count == 0 ? 0 : cost / static_cast<float>(count);
    const auto grain = static_cast<std::size_t>(each > 0 ? kWorthThreadsNs / 2 / each : 64) + 1;
    if (cost > kWorthThreadsNs && count > 1) {
      try {
        ParallelFor(count, grain, run_some);
      } catch (const Cancelled&) {  // between steps
        RecordCancelled(ready_.front());
      }
    } else {
      run_some(0, count);
    }
    if (failed_step_ != kNoIndex) {  // what did not compute stays dirty
      for (Index step : ready_) {
        for (Index member = step; member < step + plan_->steps()[step].unit_size; ++member) {
          if (computed_[member] == 0 || NewerDep(member) != kNoIndex) SetDirty(member, member + 1);
        }
      }
      return false;
    }
    for (Index step = first; step < last; ++step) {
      if (plan_->steps()[step].branch == kNoIndex || !dirty(step)) continue;
      if (!wanted(step)) continue;
      ClearDirty(step);
      const bool fine = profile_ != nullptr ? RunBranch<true>(step) : RunBranch<false>(step);
      if (!fine) {
        SetDirty(step, step + 1);
        return false;
      }
    }
  }
  return true;
}

bool Evaluator::Run(const Plan::Segment& segment, Index begin, Index end) {
  if (options_.parallel) return RunLevels(segment, begin, end);
  return profile_ != nullptr ? RunRange<true>(begin, end) : RunRange<false>(begin, end);
}

void Evaluator::NextRun() {
  if (++run_ != 0) return;
  std::fill(asked_.begin(), asked_.end(), 0);
  run_ = 1;
}

void Evaluator::BeginRun() {
  NextRun();
  set_since_run_ = false;
  cursor_ = 0;
}

void Evaluator::RunUntil(Index end) {
  if (cursor_ >= end || failed_step_ != kNoIndex) return;
  const Index begin = cursor_;
  cursor_ = end;
  Run(plan_->segments()[0], begin, end);
}

bool Evaluator::PrepareBlockStep(Index step, ComputeContext* context) {
  if (!dirty(step) || failed_step_ != kNoIndex) return false;
  ClearDirty(step);
  cursor_ = step + 1;
  Index cause;
  if (!Decide(step, &cause)) {
    computed_[step] = 0;
    SetDirty(step, step + 1);
    return false;
  }
  if (chosen_[plan_->steps()[step].branch] != 0) {
    const bool fine = profile_ != nullptr ? RunDecided<true>(step, cause) : RunDecided<false>(step, cause);
    if (!fine) SetDirty(step, step + 1);
    return false;
  }
  if (computed_[step] != 0 && cause == kNoIndex) return false;
  block_cause_ = cause;
  block_host_->step = step;
  block_host_->failed = false;
  *context = ContextOf(plan_->steps()[step]);
  context->host = block_host_.get();
  return true;
}

void Evaluator::FinishBlockStep(Index step, std::uint64_t begin_ns, std::uint64_t end_ns) {
  if (profile_ != nullptr) AddEvent(step, block_cause_, begin_ns, end_ns);
  if (block_host_->failed) {
    computed_[step] = 0;
    SetDirty(step, step + 1);
    return;
  }
  MarkComputed(step, true);
}

}  // namespace kpsa::engine
