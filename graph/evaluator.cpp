#include "graph/evaluator.h"

#include <bit>
#include <cstring>
#include <thread>

#include "base/check.h"

namespace kpsa {
namespace {

constexpr std::size_t kComparedBytes = 512;    // small outputs beyond are taken as changed
constexpr float kWorthThreadsNs = 20000;       // a level cheaper than this runs on the calling thread

}  // namespace

// What a compute may ask for; one on the stack for every run, so that a failure knows its step.
class Evaluator::StepHost final : public ComputeHost {
 public:
  StepHost(Evaluator* evaluator, Index step) : step(step), evaluator_(evaluator) {}
  void Fail(std::string_view message) override {
    failed = true;
    evaluator_->RecordFailure(step, message);
  }
  void For(std::size_t count, std::size_t grain, RangeBody body) override {
    if (evaluator_->options_.parallel) {
      ParallelFor(count, grain, body);
    } else {
      body(0, count);
    }
  }
  bool failed = false;
  Index step;

 private:
  Evaluator* evaluator_;
};

Evaluator::Evaluator(std::shared_ptr<const Plan> plan, EvaluatorOptions options)
    : plan_(std::move(plan)), options_(options), buffers_(plan_->buffer_floats()), state_((plan_->state_bytes() + 3) / 4) {
  if (options_.workspace == nullptr) own_workspace_ = std::make_unique<Workspace>(*plan_);
  workspace_ = options_.workspace != nullptr ? options_.workspace : own_workspace_.get();
  KPSA_CHECK_LE(plan_->workspace_floats(), workspace_->size());
  values_ = std::make_unique<std::uint64_t[]>(plan_->initial_values().size() / 8 + 1);
  if (!plan_->initial_values().empty()) std::memcpy(values_.get(), plan_->initial_values().data(), plan_->initial_values().size());
  for (const Plan::Buffer& buffer : plan_->buffers()) {
    float* x = (buffer.workspace ? workspace_->data() : buffers_.data()) + buffer.offset;
    const std::size_t padded = PaddedCount(buffer.count);
    PointsView view{x, nullptr, nullptr, buffer.count};
    if (buffer.components == 3) view.y = x + padded, view.z = x + 2 * padded;
    std::memcpy(values() + buffer.slot, &view, sizeof(view));
    if (buffer.initial != nullptr && buffer.count > 0) {
      const ConstPointsView from = buffer.initial->view();
      std::memcpy(view.x, from.x, buffer.count * sizeof(float));
      if (view.y == nullptr) continue;
      std::memcpy(view.y, from.y, buffer.count * sizeof(float));
      std::memcpy(view.z, from.z, buffer.count * sizeof(float));
    }
  }
  const std::size_t steps = plan_->steps().size();
  changed_.assign(steps + plan_->varying().size(), 1);
  computed_.assign(steps, 0);
  chosen_.assign(plan_->branches().size(), 0);
  dirty_.assign(steps / 64 + 1, 0);
  wanted_.assign(steps / 64 + 1, 0);
  stack_.reserve(steps);
  block_host_ = std::make_unique<StepHost>(this, kNoIndex);
  if (options_.parallel) ready_.reserve(steps);
  SetDirty(0, static_cast<Index>(steps));
}

Evaluator::~Evaluator() {
  if (workspace_ != nullptr && workspace_->owner_ == this) workspace_->owner_ = nullptr;
}

void Evaluator::SetDirty(Index begin, Index end) {
  if (begin >= end) return;
  const std::uint64_t head = ~std::uint64_t{0} << (begin % 64);
  const std::uint64_t tail = ~std::uint64_t{0} >> (63 - (end - 1) % 64);
  Index w = begin / 64;
  const Index last = (end - 1) / 64;
  if (w == last) {
    dirty_[w] |= head & tail;
    return;
  }
  dirty_[w++] |= head;
  for (; w < last; ++w) dirty_[w] = ~std::uint64_t{0};
  dirty_[last] |= tail;
}

void Evaluator::Invalidate() {
  std::fill(computed_.begin(), computed_.end(), 0);
  SetDirty(0, static_cast<Index>(computed_.size()));
}

Result<Index> Evaluator::FindVarying(const Graph& graph, const PlugRef& plug) const {
  const Index varying = plan_->FindVarying(plug);
  if (varying != kNoIndex) return varying;
  return Status::Invalid("{} does not vary in this plan: name it in Request::varying", graph.PlugName(plug));
}

void Evaluator::Changed(Index varying) {
  if (!set_since_run_) {
    set_since_run_ = true;
    if (++epoch_ == 0) {  // 2^32 evaluations: start the count anew
      epoch_ = 2;
      std::fill(changed_.begin(), changed_.end(), 1);
      Invalidate();
    }
  }
  const auto steps = static_cast<Index>(plan_->steps().size());
  changed_[steps + varying] = epoch_;
  const auto ranges = plan_->closure(varying);
  for (const auto& [begin, end] : ranges) SetDirty(begin, end);
  if (!ranges.empty()) return;
  // No ranges kept: walk forward, as far as nobody was there before
  const auto visit = [&](Index producer) {
    for (Index consumer : plan_->consumers(producer)) {
      if (dirty(consumer)) continue;
      SetDirty(consumer, consumer + 1);
      stack_.push_back(consumer);
    }
  };
  visit(steps + varying);
  while (!stack_.empty()) {
    const Index top = stack_.back();
    stack_.pop_back();
    visit(top);
  }
}

template <typename T>
void Evaluator::Write(Index varying, const T& value, std::size_t offset) {
  std::byte* slot = values() + plan_->varying()[varying].slot + offset;
  if (std::memcmp(slot, &value, sizeof(T)) == 0) return;
  std::memcpy(slot, &value, sizeof(T));
  Changed(varying);
}

void Evaluator::Set(Index varying, double value, int component) {
  const Type type = plan_->varying()[varying].type;
  KPSA_CHECK(component < 0 ? type == Type::kDouble : type == Type::kDouble3 || type == Type::kQuaternion);
  KPSA_CHECK_LT(component, static_cast<int>(SlotSize(type) / 8));
  Write(varying, value, component < 0 ? 0 : static_cast<std::size_t>(8 * component));
}
void Evaluator::SetInt(Index varying, std::int64_t value) {
  const Type type = plan_->varying()[varying].type;
  KPSA_CHECK(type == Type::kInt || type == Type::kBool || type == Type::kEnum);
  Write(varying, value, 0);
}
void Evaluator::Set(Index varying, const Double3& value) {
  KPSA_CHECK(plan_->varying()[varying].type == Type::kDouble3);
  Write(varying, value, 0);
}
void Evaluator::Set(Index varying, const Quaternion& value) {
  KPSA_CHECK(plan_->varying()[varying].type == Type::kQuaternion);
  Write(varying, value, 0);
}
void Evaluator::Set(Index varying, const Matrix4& value) {
  KPSA_CHECK(plan_->varying()[varying].type == Type::kMatrix);
  Write(varying, value, 0);
}
void Evaluator::SetPoints(Index varying, ConstPointsView points) {
  KPSA_CHECK_EQ(points.count, plan_->varying()[varying].points);
  const PointsView to = *reinterpret_cast<const PointsView*>(values() + plan_->varying()[varying].slot);
  const std::size_t size = points.count * sizeof(float);
  bool equal = true;
  for (const auto& [target, source] : {std::pair(to.x, points.x), std::pair(to.y, points.y), std::pair(to.z, points.z)}) {
    if (target == nullptr || size == 0 || std::memcmp(target, source, size) == 0) continue;
    std::memcpy(target, source, size);
    equal = false;
  }
  if (!equal) Changed(varying);
}

// Marks the dirty steps that `step` needs, itself included, as wanted.
void Evaluator::MarkWanted(Index step) {
  const auto steps = static_cast<Index>(plan_->steps().size());
  const auto want = [&](Index producer) {
    if (producer >= steps || !dirty(producer)) return;
    const std::uint64_t bit = std::uint64_t{1} << (producer % 64);
    if ((wanted_[producer / 64] & bit) != 0) return;
    wanted_[producer / 64] |= bit;
    stack_.push_back(producer);
  };
  want(step);
  while (!stack_.empty()) {
    const Index top = stack_.back();
    stack_.pop_back();
    const Plan::Step& s = plan_->steps()[top];
    for (Index d = 0; d < s.deps_count; ++d) want(plan_->deps()[s.deps + d]);
    if (s.branch != kNoIndex) {
      for (Index producer : plan_->branches()[s.branch].lazy_deps) want(producer);
    }
    // A unit runs as a whole: the first of its members to come here wants all of them, and marks the unit's first step
    const Index first = top - s.unit_offset;
    const Index size = plan_->steps()[first].unit_size;
    if (size == 1 || (top != first && wanted(first))) continue;
    for (Index member = first; member < first + size; ++member) want(member);
    wanted_[first / 64] |= std::uint64_t{1} << (first % 64);
  }
}

ComputeContext Evaluator::ContextOf(Index number) {
  const Plan::Step& step = plan_->steps()[number];
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
    if ((chosen >> branch.bit_of_lazy[i] & 1) != 0 && dep != kNoIndex && changed_[dep] > computed_[number]) return dep;
  }
  return kNoIndex;
}

void Evaluator::MarkComputed(Index step, bool changed) {
  computed_[step] = epoch_;
  if (changed) changed_[step] = epoch_;
}

template <bool kRecord>
inline bool Evaluator::Compute(Index number, Index cause, bool stale) {
  const Plan::Step& step = plan_->steps()[number];
  StepHost host(this, number);
  ComputeContext context = ContextOf(number);
  context.host = &host;
  std::uint64_t begin = 0;
  if constexpr (kRecord) begin = ProfileClock();
  bool changed = stale;
  if (step.value_size == 8) {
    std::uint64_t old, now;
    std::memcpy(&old, values() + step.value, 8);
    step.compute(context);
    std::memcpy(&now, values() + step.value, 8);
    changed = old != now || computed_[number] == 0;
  } else if (step.value_size > 0 && step.value_size <= kComparedBytes) {
    std::byte old[kComparedBytes];
    std::memcpy(old, values() + step.value, step.value_size);
    step.compute(context);
    changed = computed_[number] == 0 || std::memcmp(old, values() + step.value, step.value_size) != 0;
  } else {
    step.compute(context);
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
  const auto thread = static_cast<int>(std::hash<std::thread::id>()(std::this_thread::get_id()) % 1000000);
  profile_->Add({step, cause, begin_ns, end_ns, thread, frame_});
}

template <bool kRecord>
bool Evaluator::RunUnit(Index first) {
  // One buffer goes through all members: if one of them is stale, all run, from the first. Members before the stale
  // one give what they gave before, so their stamps stay.
  const Index end = first + plan_->steps()[first].unit_size;
  bool run = false;
  for (Index s = first; s < end; ++s) run = run || computed_[s] == 0 || NewerDep(s) != kNoIndex;
  if (!run) return true;
  bool stale = false;
  for (Index s = first; s < end; ++s) {
    const Index cause = NewerDep(s);
    stale = stale || computed_[s] == 0 || cause != kNoIndex;
    if (!Compute<kRecord>(s, cause, stale)) {
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
  ComputeContext context = ContextOf(number);
  context.host = &host;
  chosen_[plan_->steps()[number].branch] = branch.decide(context);
  return !host.failed;
}

bool Evaluator::RunChosen(Index number) {
  const Index b = plan_->steps()[number].branch;
  const Plan::Branch& branch = plan_->branches()[b];
  Index before = kNoIndex;
  for (std::size_t i = 0; i < branch.segment_of_lazy.size(); ++i) {
    const Index g = branch.segment_of_lazy[i];
    if ((chosen_[b] >> branch.bit_of_lazy[i] & 1) == 0 || g == kNoIndex || g == before) continue;
    before = g;
    const Plan::Segment& segment = plan_->segments()[g];
    if (segment.uses_workspace) OwnWorkspace();
    const bool wanted_only = wanted_only_;
    wanted_only_ = false;  // all of a chosen segment is needed
    const bool fine = Run(segment, segment.begin, segment.end);
    wanted_only_ = wanted_only;
    if (!fine) return false;
  }
  return true;
}

void Evaluator::OwnWorkspace() {
  if (workspace_->owner_ == this) return;
  // Another evaluator used these buffers since: what this one left in them is gone
  workspace_->owner_ = this;
  for (std::size_t g = 1; g < plan_->segments().size(); ++g) {
    const Plan::Segment& segment = plan_->segments()[g];
    if (!segment.uses_workspace) continue;
    std::fill(computed_.begin() + segment.begin, computed_.begin() + segment.end, 0);
    SetDirty(segment.begin, segment.end);
  }
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

template <bool kRecord>
inline bool Evaluator::RunStep(Index number) {
  const Plan::Step& step = plan_->steps()[number];
  if (step.branch != kNoIndex) [[unlikely]] return RunBranch<kRecord>(number);
  if (step.unit_size > 1) [[unlikely]] return RunUnit<kRecord>(number);
  const Index cause = NewerDep(number);
  if (computed_[number] != 0 && cause == kNoIndex) return true;
  return Compute<kRecord>(number, cause, true);
}

template <bool kRecord>
bool Evaluator::RunRange(Index begin, Index end) {
  for (Index w = begin / 64; w * 64 < end; ++w) {
    std::uint64_t bits = dirty_[w];
    if (wanted_only_) bits &= wanted_[w];
    if (w == begin / 64) bits &= ~std::uint64_t{0} << (begin % 64);
    if ((w + 1) * 64 > end) bits &= ~std::uint64_t{0} >> ((64 - end % 64) % 64);
    for (; bits != 0; bits &= bits - 1) {
      Index step = w * 64 + static_cast<Index>(std::countr_zero(bits));
      if (!dirty(step)) continue;  // done with its unit
      step -= plan_->steps()[step].unit_offset;
      const Index size = plan_->steps()[step].unit_size;
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
    const Index first = std::max(begin, segment.levels[level]), last = std::min(end, segment.levels[level + 1]);
    if (first >= last) continue;
    // The stale units of the level; branches come after, one by one: their segments use the pool themselves
    ready_.clear();
    float cost = 0;
    for (Index step = first; step < last;) {
      const Plan::Step& s = plan_->steps()[step];
      const Index size = s.unit_size;
      bool run = false;
      for (Index member = step; member < step + size; ++member) {
        run = run || (dirty(member) && (!wanted_only_ || wanted(member)));
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
      ParallelFor(count, grain, run_some);
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
      if (wanted_only_ && !wanted(step)) continue;
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

void Evaluator::RecordFailure(Index step, std::string_view message) {
  std::lock_guard<std::mutex> lock(failure_mutex_);
  if (failed_step_ != kNoIndex && failed_step_ <= step) return;  // the first in plan order, for any thread count
  failed_step_ = step;
  failure_ = message;
}

Status Evaluator::TakeFailure() {
  if (failed_step_ == kNoIndex) return Status();
  Status status = Status::Evaluation("node \"{}\" ({}): {}", plan_->step_name(failed_step_), plan_->step_type(failed_step_), failure_);
  failed_step_ = kNoIndex;
  return status;
}

void Evaluator::BeginRun() {
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
  *context = ContextOf(step);
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

Status Evaluator::EndRun() {
  RunUntil(plan_->segments()[0].end);
  return TakeFailure();
}

Status Evaluator::Evaluate() {
  BeginRun();
  return EndRun();
}

Status Evaluator::Pull(Index output) {
  const Index producer = plan_->outputs()[output].producer;
  if (producer >= plan_->steps().size() || !dirty(producer)) return Status();
  set_since_run_ = false;
  MarkWanted(producer);
  wanted_only_ = true;
  Run(plan_->segments()[0], plan_->segments()[0].begin, plan_->segments()[0].end);
  wanted_only_ = false;
  std::fill(wanted_.begin(), wanted_.end(), 0);
  return TakeFailure();
}

std::size_t Evaluator::MemoryBytes() const {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + plan_->initial_values().size() + buffers_.size() * 4 + state_.size() * 4 + bytes(changed_) + bytes(computed_) +
         bytes(chosen_) + bytes(dirty_) + bytes(wanted_) + bytes(stack_) + bytes(ready_);
}

}  // namespace kpsa
