#include "graph/evaluator.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/check.h"
#include "graph/step_host.h"

namespace kpsa::engine {

Evaluator::Evaluator(std::shared_ptr<const Plan> plan, EvaluatorOptions options)
    : plan_(std::move(plan)),
      options_(options),
      buffers_(plan_->buffer_floats()),
      state_((plan_->state_bytes() + 3) / 4) {
  if (options_.workspace == nullptr) own_workspace_ = std::make_unique<Workspace>(*plan_);
  workspace_ = options_.workspace != nullptr ? options_.workspace : own_workspace_.get();
  KPSA_CHECK_LE(plan_->workspace_floats(), workspace_->size());
  values_ = std::make_unique<std::uint64_t[]>(plan_->initial_values().size() / 8 + 1);
  if (!plan_->initial_values().empty())
    std::memcpy(values_.get(), plan_->initial_values().data(), plan_->initial_values().size());
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
  walked_.assign(steps / 64 + 1, 0);
  taking_.assign(plan_->segments().size(), 0);
  asked_.assign(plan_->segments().size(), 0);
  shared_.reserve(plan_->segments().size());
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
  clean_ = false;
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

void Evaluator::Restart() {
  std::fill(state_.data(), state_.data() + state_.size(), 0.0f);
  Invalidate();
}

Result<PlugHandle> Evaluator::FindVarying(const Graph& graph, const PlugRef& plug) const {
  if (const PlugHandle handle = plan_->Handle(plug)) return handle;
  if (plan_->FindVarying(plug) != kNoIndex)
    return Status::Invalid("{} is a part of points that vary together: set all of them",
                           graph.PlugName(plug));
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
  for (const auto& [target, source] :
       {std::pair(to.x, points.x), std::pair(to.y, points.y), std::pair(to.z, points.z)}) {
    if (target == nullptr || size == 0 || std::memcmp(target, source, size) == 0) continue;
    std::memcpy(target, source, size);
    equal = false;
  }
  if (!equal) Changed(varying);
}

// The steps that an output needs: as the plan has them, or those of the last output that was asked for.
const std::uint64_t* Evaluator::NeedsOf(Index output) {
  if (const auto needs = plan_->needs(output); !needs.empty()) return needs.data();
  if (walked_output_ != output) {
    std::fill(walked_.begin(), walked_.end(), 0);
    plan_->AddNeeds(plan_->outputs()[output].producer, walked_, &stack_);
    walked_output_ = output;
  }
  return walked_.data();
}

void Evaluator::RecordFailure(Index step, std::string_view message) {
  std::lock_guard<std::mutex> lock(failure_mutex_);
  if (failed_step_ != kNoIndex && failed_step_ <= step)
    return;  // the first in plan order, for any thread count
  failed_step_ = step;
  failure_ = message;
}

void Evaluator::RecordCancelled(Index step) {
  std::lock_guard<std::mutex> lock(failure_mutex_);
  cancelled_ = true;
  failed_step_ = std::min(failed_step_, step);
}

Status Evaluator::TakeFailure() {
  if (failed_step_ == kNoIndex) return Status();
  if (std::exchange(cancelled_, false)) {
    failed_step_ = kNoIndex;
    return Status::Make(ErrorKind::kInterrupted, "interrupted");
  }
  Status status = Status::Evaluation("node \"{}\" ({}): {}", plan_->step_name(failed_step_),
                                     plan_->step_type(failed_step_), failure_)
                      .OfNode(plan_->step_name(failed_step_));
  failed_step_ = kNoIndex;
  return status;
}

Status Evaluator::EndRun() {
  RunUntil(plan_->segments()[0].end);
  clean_ = clean_ || failed_step_ == kNoIndex;
  return TakeFailure();
}

Status Evaluator::Evaluate() {
  if (clean_) return Status();
  BeginRun();
  return EndRun();
}

Status Evaluator::Pull(Index output) {
  if (IsFresh(output)) return Status();
  set_since_run_ = false;
  NextRun();
  wanted_ = NeedsOf(output);
  Run(plan_->segments()[0], plan_->segments()[0].begin, plan_->segments()[0].end);
  wanted_ = nullptr;
  return TakeFailure();
}

std::size_t Evaluator::MemoryBytes() const {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + plan_->initial_values().size() + buffers_.size() * 4 + state_.size() * 4 +
         bytes(changed_) + bytes(computed_) + bytes(chosen_) + bytes(dirty_) + bytes(walked_) +
         bytes(taking_) + bytes(asked_) + bytes(shared_) + bytes(stack_) + bytes(ready_);
}

}  // namespace kpsa::engine
