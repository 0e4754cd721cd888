#include "graph/step_order.h"

#include <algorithm>

#include "base/check.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxUnit = 60000;  // Plan::Step counts the steps of a unit in 16 bits

class Orderer {
 public:
  Orderer(const InstanceTable& table, const PlanDraft& draft) : table_(table), draft_(draft) {}

  StepOrder Run() {
    // Copies inside of a unit can tie a knot (a later member depends on what the copy feeds): then those stay
    // outside
    for (bool copies_inside : {true, false}) {
      Merge(copies_inside);
      if (Levels()) return std::move(order_);
    }
    KPSA_CHECK(false);
    return {};
  }

 private:
  struct Readers {
    int direct = 0;
    bool outside = false;  // the request, or a step of another segment
    std::vector<Index> gathers;
  };

  void Merge(bool copies_inside) {
    const std::size_t n = draft_.steps.size();
    order_ = StepOrder();
    order_.overwrites.assign(n, kNoIndex);
    order_.segments.resize(draft_.segments.size());
    std::vector<Readers> readers(n);
    const auto note = [&](const DraftInput& input, Index reader) {
      if (input.kind != DraftInput::Kind::kStep || !IsPointType(input.type)) return;
      Readers& r = readers[input.step];
      if (reader == kNoIndex || draft_.steps[reader].segment != draft_.steps[input.step].segment ||
          input.lazy) {
        r.outside = true;
      } else if (draft_.steps[reader].instance == kNoIndex) {
        r.gathers.push_back(reader);
      } else {
        ++r.direct;
      }
    };
    for (Index s = 0; s < n; ++s) {
      for (const DraftInput& input : draft_.steps[s].inputs) note(input, s);
    }
    for (const DraftInput& output : draft_.outputs) note(output, kNoIndex);

    std::vector<Index> next(n, kNoIndex);  // the step that takes over a buffer
    std::vector<bool> follows(n, false);
    for (Index s = 0; s < n; ++s) {
      const Index source = InPlaceSource(s);
      if (source == kNoIndex || RunsAlone(source)) continue;
      const Readers& r = readers[source];
      if (r.direct != 1 || r.outside || (!copies_inside && !r.gathers.empty())) continue;
      order_.overwrites[s] = source;
      next[source] = s;
      follows[s] = true;
    }
    std::vector<bool> placed(n, false);
    for (Index s = 0; s < n; ++s) {
      if (follows[s] || next[s] == kNoIndex) continue;
      auto& units = order_.segments[draft_.steps[s].segment];
      units.emplace_back();
      for (Index at = s; at != kNoIndex; at = next[at]) {
        StepOrder::Unit* unit = &units.back();
        unit->steps.push_back(at);
        placed[at] = true;
        if (next[at] == kNoIndex) break;
        if (unit->steps.size() + readers[at].gathers.size() >=
            kMaxUnit) {  // a new unit, with a buffer of its own
          order_.overwrites[next[at]] = kNoIndex;
          units.emplace_back();
          continue;
        }
        for (Index gather : readers[at].gathers) {
          unit->steps.push_back(gather);
          placed[gather] = true;
        }
      }
    }
    for (Index s = 0; s < n; ++s) {
      if (!placed[s]) order_.segments[draft_.steps[s].segment].push_back({{s}, 0});
    }
  }

  bool IsBranch(const DraftStep& step) const {
    const ComputeGroup* group = GroupOf(step);
    return group != nullptr && (group->decide != nullptr || group->compute_block != nullptr);
  }
  // Units run again as a whole: not with steps that decide, and not with what must not run twice a frame.
  bool RunsAlone(Index s) const {
    const DraftStep& step = draft_.steps[s];
    return step.instance == kNoIndex || IsBranch(step) ||
           table_.graph().def(table_.instances()[step.instance].node).stateful;
  }

  // The step whose output step s may overwrite, if the definition allows it and the point sets agree.
  Index InPlaceSource(Index s) const {
    const DraftStep& step = draft_.steps[s];
    if (RunsAlone(s)) return kNoIndex;
    const Instance& instance = table_.instances()[step.instance];
    if (instance.kind != Instance::Kind::kNode) return kNoIndex;
    const ComputeGroup& group = table_.group(instance);
    if (group.in_place_input < 0) return kNoIndex;
    for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
      if (instance.inputs[i].position != group.in_place_input) continue;
      const DraftInput& input = step.inputs[i];
      if (input.kind != DraftInput::Kind::kStep || draft_.steps[input.step].segment != step.segment)
        return kNoIndex;
      if (!(input.points == step.sets.outputs[0][0])) return kNoIndex;
      const std::size_t outputs = draft_.steps[input.step].sets.outputs.size();
      return outputs == 1 && draft_.steps[input.step].sets.outputs[0].size() == 1 ? input.step : kNoIndex;
    }
    return kNoIndex;
  }

  const ComputeGroup* GroupOf(const DraftStep& step) const {
    if (step.instance == kNoIndex || table_.instances()[step.instance].kind != Instance::Kind::kNode)
      return nullptr;
    return &table_.group(table_.instances()[step.instance]);
  }
  // Numbers the groups whose steps can run together, by their first step; 0 for all others.
  std::vector<Index> BatchKinds() const {
    std::vector<Index> kinds(draft_.steps.size(), 0);
    std::vector<const ComputeGroup*> known;
    for (Index s = 0; s < draft_.steps.size(); ++s) {
      const ComputeGroup* group = GroupOf(draft_.steps[s]);
      if (group == nullptr || group->compute_batch == nullptr) continue;
      const auto it = std::find(known.begin(), known.end(), group);
      kinds[s] = static_cast<Index>(it - known.begin()) + 1;
      if (it == known.end()) known.push_back(group);
    }
    return kinds;
  }

  // Kahn's algorithm over units, segment by segment; false on a cycle.
  bool Levels() {
    std::vector<std::pair<Index, Index>> unit_of(draft_.steps.size());
    for (Index g = 0; g < order_.segments.size(); ++g) {
      for (Index u = 0; u < order_.segments[g].size(); ++u) {
        for (Index s : order_.segments[g][u].steps) unit_of[s] = {g, u};
      }
    }
    const std::vector<Index> kinds = BatchKinds();
    // What is to be ordered in a segment: its units, and behind them a place for each shared segment that lies in it,
    // after all that it reads there and before all that have it run
    std::vector<Index> size(order_.segments.size()), place(order_.segments.size(), kNoIndex);
    for (Index g = 0; g < size.size(); ++g) size[g] = static_cast<Index>(order_.segments[g].size());
    for (Index g = 1; g < size.size(); ++g) {
      if (!draft_.segments[g].users.empty()) place[g] = size[draft_.segments[g].parent]++;
    }
    std::vector<std::vector<std::vector<Index>>> consumers(order_.segments.size());
    std::vector<std::vector<Index>> waiting(order_.segments.size()), level(order_.segments.size());
    for (Index g = 0; g < order_.segments.size(); ++g) {
      consumers[g].resize(size[g]);
      waiting[g].assign(size[g], 0);
      level[g].assign(size[g], 0);
    }
    const auto depends = [&](Index g, Index reader, Index producer) {
      if (reader == producer) return;
      consumers[g][producer].push_back(reader);
      ++waiting[g][reader];
    };
    // What in `home` has that segment run, which lies in it: the unit of an owner, or a shared segment; kNoIndex where
    // it lies elsewhere
    const auto runs_it = [&](Index segment, Index home) {
      Index child = segment;
      while (child != 0 && draft_.segments[child].parent != home) child = draft_.segments[child].parent;
      if (child == 0) return kNoIndex;
      return place[child] != kNoIndex ? place[child] : unit_of[draft_.segments[child].owner].second;
    };
    for (Index s = 0; s < draft_.steps.size(); ++s) {
      for (const DraftInput& input : draft_.steps[s].inputs) {
        if (input.kind != DraftInput::Kind::kStep) continue;
        const auto [home, producer] = unit_of[input.step];
        const Index own = draft_.steps[s].segment;
        // What a lazy segment reads from outside must run before the segment's owner does. What it reads of a shared
        // one runs when it does
        const Index reader = own == home ? unit_of[s].second : runs_it(own, home);
        if (reader != kNoIndex) depends(home, reader, producer);
      }
    }
    for (Index g = 1; g < draft_.segments.size(); ++g) {
      const Index home = draft_.segments[g].parent;
      for (const Index user : draft_.segments[g].users) depends(home, runs_it(user, home), place[g]);
    }
    for (Index g = 0; g < order_.segments.size(); ++g) {
      auto& units = order_.segments[g];
      std::vector<Index> ready;
      for (Index u = 0; u < size[g]; ++u) {
        if (waiting[g][u] == 0) ready.push_back(u);
      }
      std::size_t done = 0;
      for (std::size_t at = 0; at < ready.size(); ++at, ++done) {
        for (Index c : consumers[g][ready[at]]) {
          level[g][c] = std::max(level[g][c], level[g][ready[at]] + 1);
          if (--waiting[g][c] == 0) ready.push_back(c);
        }
      }
      if (done != size[g]) return false;
      for (Index u = 0; u < units.size(); ++u) units[u].level = level[g][u];
      // Branches come last in their level: the parallel evaluator runs them after the others. Steps of a
      // batch lie side by side. Draft steps were made consumers first, so descending numbers keep sources
      // near their users.
      std::sort(units.begin(), units.end(), [&](const StepOrder::Unit& a, const StepOrder::Unit& b) {
        if (a.level != b.level) return a.level < b.level;
        const bool branch_a = IsBranch(draft_.steps[a.steps[0]]),
                   branch_b = IsBranch(draft_.steps[b.steps[0]]);
        if (branch_a != branch_b) return branch_b;
        const Index kind_a = kinds[a.steps[0]], kind_b = kinds[b.steps[0]];
        return kind_a != kind_b ? kind_a < kind_b : a.steps[0] > b.steps[0];
      });
    }
    return true;
  }

  const InstanceTable& table_;
  const PlanDraft& draft_;
  StepOrder order_;
};

}  // namespace

StepOrder OrderSteps(const InstanceTable& table, const PlanDraft& draft) {
  return Orderer(table, draft).Run();
}

}  // namespace kpsa::engine
