#include "tests/support/twin_rounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>
#include <set>
#include <vector>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "graph/frames.h"
#include "tests/support/random_graph.h"

namespace kpsa::engine {
namespace {

using Plug = NaiveTwin::Plug;

// Which of two values that are no number comes out of a sum is the compiler's choice.
void AddBytes(double v, std::string* bytes) {
  if (std::isnan(v)) v = std::numeric_limits<double>::quiet_NaN();
  bytes->append(reinterpret_cast<const char*>(&v), sizeof(v));
}

// One plan of the graph.
class Rounds {
 public:
  Rounds(RandomGraph& g, const TwinMistakes& mistakes, TwinCounts* counts)
      : g_(g), mistakes_(mistakes), counts_(*counts) {}

  bool Compile(Compiler& compiler);
  void Run(int rounds);

 private:
  static constexpr std::size_t kSerial = 0, kParallel = 1, kSharing = 2, kOther = 3;
  // Of an output: its bytes, what it lacks where the request wants it.
  struct Expected {
    std::string bytes;
    NaiveTwin::Failures lacks = 0;
  };
  void MakeRequest();
  void MakeEvaluators();
  Expected Expect(Index output);
  static std::string Bytes(const Evaluator& evaluator, Index output);
  void CheckValue(const Evaluator& evaluator, Index output, const std::string& who);
  // What an evaluation is to do.
  struct Needs {
    std::set<std::string> computed;  // what may run
    NaiveTwin::Failures failed = 0;  // where it may fail
    NaiveTwin::Failures must = 0;    // not 0: it has to fail
  };
  Needs NeedsOf(Index output, bool eager = false);
  Needs NeedsOfPull(Index output);
  void WholeUnits();
  void CheckStatus(const Status& status, const Needs& needs, const std::string& who);
  void CheckRuns(const std::vector<std::uint64_t>& before, const Needs& needs, bool evaluated);
  void Apply(Evaluator& evaluator, std::size_t v, const NaiveTwin::Held& value) const;
  NaiveTwin::Held RandomOf(std::size_t v) { return g_.RandomValue(leaves_[v].attribute, KindOf(v)); }
  ToyKind KindOf(std::size_t v) const;
  void SetSome();
  void UseOther();
  void Evaluate(Index output);
  void Frames();
  bool fine() const { return g_.fault().empty(); }

  RandomGraph& g_;
  const TwinMistakes& mistakes_;
  TwinCounts& counts_;
  Request request_;
  std::vector<Plug> outputs_;
  std::shared_ptr<const Plan> plan_;
  std::vector<Plug> leaves_;              // by varying plug
  std::vector<NaiveTwin::Held> now_;      // likewise
  std::vector<int> changed_at_;           // likewise: the time when it got another value
  std::vector<NaiveTwin::Leaves> cones_;  // by step
  std::vector<int> ran_at_;               // by step; -1: it may run whatever was set
  int time_ = 0;
  std::unique_ptr<Profile> profile_;  // of the serial one
  std::unique_ptr<Workspace> workspace_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;
  std::vector<bool> forgot_;  // by step: it has not run since all was invalidated
};

// Some outputs, some of their points, and some inputs that vary.
void Rounds::MakeRequest() {
  for (int i = 1 + g_.choices.Pick(6); i > 0; --i) {
    const auto node = static_cast<std::size_t>(g_.choices.Pick(static_cast<int>(g_.nodes.size())));
    const ToyType& type = g_.TypeOf(node);
    outputs_.push_back({g_.nodes[node].first, type.output});
    PointSet set;
    if (type.kind == ToyKind::kPoints && g_.choices.Chance(60)) {
      std::vector<Index> some;
      for (int k = 1 + g_.choices.Pick(5); k > 0; --k)
        some.push_back(static_cast<Index>(g_.choices.Pick(kToyPoints)));
      set = PointSet::Of(some, kToyPoints);
    }
    request_.outputs.push_back({g_.Ref(outputs_.back()), set});
  }
  for (std::size_t node = 0; node < g_.nodes.size(); ++node) {
    for (const ToyAttribute& a : g_.TypeOf(node).inputs) {
      Plug plug{g_.nodes[node].first, a.name, a.array ? 0 : -1};
      if (a.structural || !g_.choices.Chance(40) || g_.twin.Overlaps(plug, false)) continue;
      if (request_.varying.size() == NaiveTwin::kMostLeaves) return;
      if (a.kind == ToyKind::kVector && g_.choices.Chance(30)) plug.component = 1;
      request_.varying.push_back(g_.Ref(plug));
      if (a.array && g_.twin.held.count(plug) == 0)  // now it is an element for the twin, too
        g_.Set(plug, a.kind == ToyKind::kMatrix ? NaiveTwin::Held(Matrix4()) : NaiveTwin::Held(0.0));
    }
  }
}

bool Rounds::Compile(Compiler& compiler) {
  MakeRequest();
  Result<std::shared_ptr<const Plan>> plan = compiler.Compile(g_.graph, request_);
  if (!plan.ok()) {  // rightly, where constants cannot be had
    CheckStatus(plan.status(), NeedsOf(kNoIndex, true), "compiling");
    ++counts_.refused;
    return false;
  }
  plan_ = *plan;
  MakeEvaluators();
  ++counts_.plans;
  counts_.steps += static_cast<int>(plan_->steps().size());
  counts_.segments += static_cast<int>(plan_->segments().size()) - 1;
  counts_.passed_by += static_cast<int>(plan_->excluded().size());
  for (const Plan::Segment& segment : plan_->segments()) counts_.shared_segments += !segment.users.empty();
  for (Index s = 0; s < plan_->steps().size(); ++s) {
    counts_.unit_steps += plan_->steps()[s].unit_size > 1;
    counts_.gathers += std::string_view(plan_->step_label(s)) == "gather";
  }
  return true;
}

void Rounds::MakeEvaluators() {
  workspace_ = std::make_unique<Workspace>(*plan_);
  for (std::size_t e : {kSerial, kParallel, kSharing, kOther}) {
    EvaluatorOptions options;
    options.parallel = e == kParallel;
    if (e == kSharing || e == kOther) options.workspace = workspace_.get();
    evaluators_.push_back(std::make_unique<Evaluator>(plan_, options));
  }
  profile_ = std::make_unique<Profile>(*plan_);
  evaluators_[kSerial]->Record(profile_.get());
  // What varies, and which steps depend on it
  for (const Plan::Varying& varying : plan_->varying()) {
    const PlugRef& ref = varying.plug;
    leaves_.push_back({g_.graph.name(ref.node),
                       g_.graph.def(ref.node).attributes[static_cast<std::size_t>(ref.attribute)].name,
                       ref.element});
  }
  changed_at_.assign(leaves_.size(), 0);
  g_.twin.Begin();
  for (std::size_t v = 0; v < leaves_.size(); ++v) {
    switch (KindOf(v)) {
      case ToyKind::kNumber:
        now_.push_back(g_.twin.Number(leaves_[v]).value);
        break;
      case ToyKind::kVector:
        now_.push_back(g_.twin.Vector(leaves_[v]).value);
        break;
      case ToyKind::kMatrix:
        now_.push_back(g_.twin.Matrix(leaves_[v]).value);
        break;
      case ToyKind::kPoints:
        now_.push_back(g_.twin.AllPoints(leaves_[v]));
        break;
    }
  }
  std::map<Plug, NaiveTwin::Leaves> memo;
  ran_at_.assign(plan_->steps().size(), -1);
  forgot_.assign(plan_->steps().size(), true);
  for (Index s = 0; s < plan_->steps().size(); ++s)
    cones_.push_back(g_.twin.Cone(plan_->step_name(s), leaves_, &memo));
  for (Index s = 0; s < plan_->steps().size(); ++s) {  // a unit runs as a whole
    const Index first = s - plan_->steps()[s].unit_offset;
    cones_[first] |= cones_[s];
  }
  for (Index s = 0; s < plan_->steps().size(); ++s) cones_[s] = cones_[s - plan_->steps()[s].unit_offset];
}

ToyKind Rounds::KindOf(std::size_t v) const {
  switch (plan_->varying()[v].type) {
    case Type::kDouble3:
      return ToyKind::kVector;
    case Type::kMatrix:
      return ToyKind::kMatrix;
    case Type::kPoints:
      return ToyKind::kPoints;
    default:
      return ToyKind::kNumber;
  }
}

Rounds::Expected Rounds::Expect(Index output) {
  const Plug& plug = outputs_[output];
  Expected expected;
  const ToyKind kind = [&] {
    for (std::size_t node = 0;; ++node) {
      if (g_.nodes[node].first == plug.node) return g_.TypeOf(node).kind;
    }
  }();
  if (kind == ToyKind::kPoints) {
    const NaiveTwin::Points all = g_.twin.AllPoints(plug);
    PointSet set = request_.outputs[output].points;
    if (set.total() == 0) set = PointSet::All(kToyPoints);
    for (int c = 0; c < 3; ++c) {
      for (Index i = 0; i < set.size(); ++i) AddBytes(all[set[i]].value[c], &expected.bytes);
    }
    for (Index i = 0; i < set.size(); ++i) expected.lacks |= all[set[i]].lacks;
  } else if (kind == ToyKind::kVector) {
    const auto v = g_.twin.Vector(plug);
    for (int c = 0; c < 3; ++c) AddBytes(v.value[c], &expected.bytes);
    expected.lacks = v.lacks;
  } else if (kind == ToyKind::kMatrix) {
    const auto m = g_.twin.Matrix(plug);
    for (double entry : m.value.m) AddBytes(entry, &expected.bytes);
    expected.lacks = m.lacks;
  } else {
    const auto n = g_.twin.Number(plug);
    AddBytes(n.value, &expected.bytes);
    expected.lacks = n.lacks;
  }
  return expected;
}

std::string Rounds::Bytes(const Evaluator& evaluator, Index output) {
  std::string bytes;
  const Type type = evaluator.plan().outputs()[output].type;
  if (type == Type::kPoints) {
    const ConstPointsView view = evaluator.Points(output);
    for (const float* component : {view.x, view.y, view.z}) {
      for (std::size_t i = 0; i < view.count; ++i) AddBytes(component[i], &bytes);
    }
  } else {
    const double* numbers = &evaluator.Get<double>(output);
    for (std::size_t i = 0; i < SlotSize(type) / 8; ++i) AddBytes(numbers[i], &bytes);
  }
  return bytes;
}

void Rounds::CheckValue(const Evaluator& evaluator, Index output, const std::string& who) {
  const Expected expected = Expect(output);
  if (expected.lacks != 0) {
    g_.Report(fmt::format("{}: {} is there, and what it reads failed", who, outputs_[output].Name()));
  } else if (Bytes(evaluator, output) != expected.bytes) {
    g_.Report(fmt::format("{}: {} is another value", who, outputs_[output].Name()));
  }
}

// Of an output, or of all of them.
Rounds::Needs Rounds::NeedsOf(Index output, bool eager) {
  Needs needs;
  g_.twin.Begin(eager);
  for (Index o = 0; o < outputs_.size(); ++o) {
    if (output == kNoIndex || o == output) needs.must |= Expect(o).lacks;
  }
  if (output != kNoIndex) WholeUnits();
  needs.computed = g_.twin.computed();
  needs.failed = g_.twin.failed();
  return needs;
}

// Deformers that run in place are one unit: one that is needed needs all.
void Rounds::WholeUnits() {
  for (std::size_t before = 0; before != g_.twin.computed().size();) {
    before = g_.twin.computed().size();
    for (Index first = 0; first < plan_->steps().size(); ++first) {
      const Index end = first + plan_->steps()[first].unit_size;
      bool needed = false;
      for (Index s = first; s < end; ++s) {
        needed = needed || g_.twin.computed().count(plan_->step_name(s)) != 0;
        for (const Index reader : plan_->consumers(s))  // of an input that is read on, without the node
          needed = needed || g_.twin.computed().count(plan_->step_name(reader)) != 0;
      }
      for (Index s = first; s < end && needed && end > first + 1; ++s) {
        const std::string node = plan_->step_name(s);
        if (*plan_->step_label(s) == 0) {
          (void)g_.twin.AllPoints({node, "outPoints"});
          continue;
        }
        for (const char* input : {"points", "cuePoints", "full"}) (void)g_.twin.AllPoints({node, input});
      }
    }
  }
}

// A pull brings up to date what its lazy inputs may choose, too, as far as other outputs need that in any case: it
// is not in a lazy segment.
Rounds::Needs Rounds::NeedsOfPull(Index output) {
  if (output == kNoIndex) return NeedsOf(kNoIndex);
  Needs needs = NeedsOf(output);
  const Needs all = NeedsOf(kNoIndex), eager = NeedsOf(output, true);
  std::set_intersection(all.computed.begin(), all.computed.end(), eager.computed.begin(),
                        eager.computed.end(), std::inserter(needs.computed, needs.computed.end()));
  needs.failed |= all.failed & eager.failed;
  return needs;
}

// An evaluation fails if what is wanted lacks something, and at a node that failed for the twin.
void Rounds::CheckStatus(const Status& status, const Needs& needs, const std::string& who) {
  if (status.ok()) {
    if (needs.must != 0) g_.Report(who + ": a node that is needed fails, and the evaluation does not");
  } else if (status.errors().size() != 1 || !g_.twin.Failed(status.errors().front().node, needs.failed)) {
    g_.Report(fmt::format("{}: {}; the twin knows of no such failure", who, status.ToString()));
  }
}

// After an evaluation of the serial one: what ran had a reason.
void Rounds::CheckRuns(const std::vector<std::uint64_t>& before, const Needs& needs, bool evaluated) {
  const auto name = [&](Index s) {
    return fmt::format("{} ({}, segment {})", plan_->step_name(s), plan_->step_type(s),
                       plan_->infos()[s].segment);
  };
  for (Index s = 0; s < before.size(); ++s) {
    const std::uint64_t runs = profile_->counts()[s] - before[s];
    const Plan::StepInfo& info = plan_->infos()[s];
    if (runs > 1) g_.Report(fmt::format("{} ran {} times", name(s), runs));
    if (runs == 0) {
      if (evaluated && forgot_[s] && info.segment == 0)
        g_.Report(fmt::format("{} did not run after it was invalidated", name(s)));
      continue;
    }
    counts_.lazy_runs += info.segment != 0;
    if (*plan_->step_label(s) == 0 && needs.computed.count(plan_->step_name(s)) == 0)
      g_.Report(fmt::format("{} ran, and nobody needs it", name(s)));
    bool reason = ran_at_[s] < 0;
    for (std::size_t v = 0; v < leaves_.size() && !reason; ++v)
      reason = cones_[s].test(v) && changed_at_[v] > ran_at_[s];
    if (!reason && *plan_->step_label(s) == 0)
      g_.Report(fmt::format("{} ran, and nothing that it reads has changed", name(s)));
    ran_at_[s] = time_;
    forgot_[s] = false;
  }
}

void Rounds::Apply(Evaluator& evaluator, std::size_t v, const NaiveTwin::Held& value) const {
  const auto index = static_cast<Index>(v);
  const Type type = plan_->varying()[v].type;
  if (type == Type::kPoints) {
    std::vector<Double3> places;
    for (const auto& p : std::get<NaiveTwin::Points>(value)) places.push_back(p.value);
    const PointBuffer buffer = PointBuffer::FromPlaces(places);
    evaluator.SetPoints(index, buffer.view());
  } else if (type == Type::kDouble3) {
    evaluator.Set(index, std::get<Double3>(value));
  } else if (type == Type::kMatrix) {
    evaluator.Set(index, std::get<Matrix4>(value));
  } else if (type == Type::kDouble) {
    evaluator.Set(index, std::get<double>(value));
  } else {
    const double number = std::get<double>(value);
    evaluator.SetInt(index, type == Type::kBool ? number != 0 : static_cast<std::int64_t>(number));
  }
}

void Rounds::SetSome() {
  ++time_;
  for (std::size_t v = 0; v < leaves_.size(); ++v) {
    if (!g_.choices.Chance(25)) continue;
    NaiveTwin::Held value = RandomOf(v);
    if (plan_->varying()[v].type == Type::kBool) value = std::get<double>(value) != 0 ? 1.0 : 0.0;
    if (!(value == now_[v])) changed_at_[v] = time_;
    now_[v] = value;
    g_.twin.Set(leaves_[v], value);
    if (mistakes_.forgets_to_set && g_.choices.Chance(10)) continue;
    for (std::size_t e : {kSerial, kParallel, kSharing}) Apply(*evaluators_[e], v, value);
  }
  if (mistakes_.hidden != nullptr) *mistakes_.hidden = g_.twin.hidden = g_.RandomNumber();
  if (mistakes_.invalidates) evaluators_[kSerial]->Invalidate();
  if (g_.choices.Chance(10)) {
    for (const auto& e : evaluators_) g_.choices.Chance(50) ? e->Invalidate() : e->Restart();
    std::fill(ran_at_.begin(), ran_at_.end(), -1);
    forgot_.assign(forgot_.size(), true);
    ++counts_.invalidated;
  }
}

// Something else in the workspace of the sharing one.
void Rounds::UseOther() {
  for (std::size_t v = 0; v < leaves_.size(); ++v) {
    if (g_.choices.Chance(25)) Apply(*evaluators_[kOther], v, RandomOf(v));
  }
  (void)evaluators_[kOther]->Evaluate();
}

// Pulls an output, or evaluates all if it is kNoIndex.
void Rounds::Evaluate(Index output) {
  const Needs needs = NeedsOfPull(output);
  const std::vector<std::uint64_t> before = profile_->counts();
  bool failed = false;
  for (std::size_t e : {kSerial, kParallel, kSharing}) {
    const std::string who = e == kSerial ? "serial" : e == kParallel ? "parallel" : "sharing a workspace";
    const Status status = output == kNoIndex ? evaluators_[e]->Evaluate() : evaluators_[e]->Pull(output);
    CheckStatus(status, needs, who);
    if (e == kSerial) CheckRuns(before, needs, status.ok() && output == kNoIndex);
    failed = failed || !status.ok();
  }
  ++counts_.evaluations;
  counts_.failures += failed;
  g_.twin.Begin();
  if (failed) std::fill(ran_at_.begin(), ran_at_.end(), -1);
  for (std::size_t e : {kSerial, kParallel, kSharing}) {
    for (Index o = 0; o < outputs_.size() && fine(); ++o) {
      if (evaluators_[e]->IsFresh(o)) CheckValue(*evaluators_[e], o, fmt::format("evaluator {}", e));
    }
  }
  if (output != kNoIndex || failed || !fine()) return;
  const std::vector<std::uint64_t> done = profile_->counts();
  if (!evaluators_[kSerial]->Evaluate().ok() || profile_->counts() != done)
    g_.Report("nothing was set, and something ran");
}

// Many frames side by side.
void Rounds::Frames() {
  std::vector<std::vector<NaiveTwin::Held>> frames(static_cast<std::size_t>(1 + g_.choices.Pick(9)), now_);
  for (auto& frame : frames) {
    for (std::size_t v = 0; v < leaves_.size(); ++v) {
      if (g_.choices.Chance(25)) frame[v] = RandomOf(v);
    }
  }
  FrameOptions options;
  options.threads = 1 + g_.choices.Pick(3);
  options.block = 1 + g_.choices.Pick(4);
  const auto set = [&](std::size_t frame, Evaluator& evaluator) {
    for (std::size_t v = 0; v < leaves_.size(); ++v) Apply(evaluator, v, frames[frame][v]);
  };
  const auto sink = [&](std::size_t frame, const Evaluator& evaluator, const Status& evaluated) {
    for (std::size_t v = 0; v < leaves_.size(); ++v) g_.twin.Set(leaves_[v], frames[frame][v]);
    const Needs needs = NeedsOf(kNoIndex);
    const std::string who = fmt::format("frame {} of {}, {} threads, blocks of {}", frame, frames.size(),
                                        options.threads, options.block);
    CheckStatus(evaluated, needs, who);
    ++counts_.frames;
    counts_.failed_frames += !evaluated.ok();
    for (Index o = 0; o < outputs_.size() && evaluated.ok() && fine(); ++o) CheckValue(evaluator, o, who);
    return Status();
  };
  const Status status = EvaluateFrames(plan_, frames.size(), options, set, sink);
  if (!status.ok()) g_.Report("frames: " + status.ToString());
  for (std::size_t v = 0; v < leaves_.size(); ++v) g_.twin.Set(leaves_[v], now_[v]);
}

void Rounds::Run(int rounds) {
  for (int round = 0; round < rounds && fine() && !g_.choices.over(); ++round) {
    if (round > 0) SetSome();
    if (g_.choices.Chance(50)) UseOther();
    Evaluate(g_.choices.Chance(40) ? static_cast<Index>(g_.choices.Pick(static_cast<int>(outputs_.size())))
                                   : kNoIndex);
  }
  if (fine() && mistakes_.hidden == nullptr) Frames();
}

}  // namespace

std::string Disagreement(const NodeRegistry& registry, Choices choices, const TwinSizes& sizes,
                         TwinCounts* counts, const TwinMistakes& mistakes) {
  RandomGraph g(registry, choices, mistakes.disguises);
  Compiler compiler;
  for (int i = 0; i < sizes.nodes && (i == 0 || !g.choices.over()); ++i) g.AddNode();
  for (int edition = 0; edition < sizes.editions && g.fault().empty(); ++edition) {
    Rounds rounds(g, mistakes, counts);
    if (rounds.Compile(compiler)) rounds.Run(sizes.rounds);
    if (g.choices.over()) break;
    // A varying plug keeps its last value in the twin: so it does in the graph
    for (const auto& [plug, value] : std::map<Plug, NaiveTwin::Held>(g.twin.held)) g.Set(plug, value);
    for (int i = 0; i < sizes.edits && !g.choices.over(); ++i) g.Edit();
  }
  return g.fault();
}

}  // namespace kpsa::engine
