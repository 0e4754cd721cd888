#include "graph/plan_draft.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "graph/static_eval.h"

namespace kpsa::engine {
namespace {

constexpr int kMaxLazyInputs = 64;   // bits of what decide returns
constexpr int kMaxLazyDepth = 1000;  // the evaluator descends into segments by recursion

class Drafter {
 public:
  Drafter(InstanceTable& table, StaticEvaluator& statics, const Request& request)
      : table_(table), statics_(statics), request_(request) {}

  Result<PlanDraft> Run(const std::vector<Source>& wanted) {
    const std::vector<Index> order = table_.Order();
    MarkVarying(order);
    KPSA_RETURN_IF_ERROR(CheckStructural());
    uses_.resize(table_.instances().size());
    draft_.passed.assign(table_.instances().size(), PlanDraft::Passed::kNo);
    draft_.segments.emplace_back();

    // The request's own reads
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      PointSet set;
      if (IsPointType(wanted[i].type)) {
        Result<Index> total = statics_.totals().OfSource(wanted[i]);
        if (!total.ok()) return total.status();
        set = request_.outputs[i].points;
        if (set.total() == 0) set = PointSet::All(*total);
        if (set.total() != *total) {
          return Status::Invalid("{} has {} points, the request is for an array of {}",
                                 table_.graph().PlugName(request_.outputs[i].plug), *total, set.total());
        }
      }
      draft_.outputs.emplace_back();
      KPSA_RETURN_IF_ERROR(Read(wanted[i], set, 0, {kNoIndex, static_cast<int>(i)}, &draft_.outputs.back()));
    }

    // Consumers before sources: when an instance's turn comes, all its uses are known
    for (auto it = order.rbegin(); it != order.rend(); ++it) {
      if (!uses_[*it].empty()) KPSA_RETURN_IF_ERROR(MakeSteps(*it));
      uses_[*it] = {};
    }
    InsertGathers();
    return std::move(draft_);
  }

 private:
  // A read of an instance's output: by input `input` of draft step `step`, or by request output `input`.
  struct Reader {
    Index step;
    int input;
  };
  struct Use {
    Reader reader;
    Index segment;
    int output, element;
    PointSet points;
  };

  void MarkVarying(const std::vector<Index>& order) {
    draft_.varying.assign(table_.instances().size(), false);
    for (Index i : order) {
      for (const Input& input : table_.instances()[i].inputs) {
        const Source& s = input.source;
        if (s.kind == Source::Kind::kVarying ||
            (s.kind == Source::Kind::kInstance && draft_.varying[s.instance]))
          draft_.varying[i] = true;
      }
    }
  }

  Status CheckStructural() {
    const auto refuse = [&](NodeId node, int attribute, int element, const std::string& driver) {
      return Status::Invalid(
          "{} is structural (it is baked into the plan) and cannot be driven by {}, which varies",
          table_.graph().PlugName({node, attribute, element, -1}), driver);
    };
    for (const Instance& instance : table_.instances()) {
      for (const StructuralInput& input : instance.structural) {
        const Source& s = input.source;
        if (s.kind == Source::Kind::kVarying) {
          return refuse(instance.node, input.attribute, input.element,
                        table_.graph().PlugName(table_.varying()[s.varying]));
        }
        if (s.kind != Source::Kind::kInstance || !draft_.varying[s.instance]) continue;
        return refuse(instance.node, input.attribute, input.element,
                      "node \"" + table_.graph().name(table_.instances()[s.instance].node) + "\"");
      }
    }
    for (const PlugRef& plug : table_.varying()) {
      const AttributeDef& a =
          table_.graph().def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
      if (a.structural)
        return Status::Invalid("{} is structural and cannot vary", table_.graph().PlugName(plug));
    }
    return Status();
  }

  // The source that an instance hands on unchanged; null if it computes something.
  const Source* PassedBy(Index number) {
    const Instance& instance = table_.instances()[number];
    if (instance.kind != Instance::Kind::kNode || table_.group(instance).passed_input < 0) return nullptr;
    const ComputeGroup& group = table_.group(instance);
    const Source* passed = nullptr;
    for (const Input& input : instance.inputs) {
      const Source& s = input.source;
      if (input.position == group.passed_input) passed = &s;
      if (std::find(group.held_inputs.begin(), group.held_inputs.end(), input.position) ==
          group.held_inputs.end())
        continue;
      if (s.kind == Source::Kind::kVarying ||
          (s.kind == Source::Kind::kInstance && draft_.varying[s.instance]))
        return nullptr;
      const Value* value = statics_.Get(s, false);
      const AttributeDef& a = table_.input_def(instance, input.position);
      std::byte now[sizeof(Matrix4)], held[sizeof(Matrix4)];
      if (value == nullptr) return nullptr;
      value->WriteSlot(a.type, now);
      a.default_value.WriteSlot(a.type, held);
      if (std::memcmp(now, held, SlotSize(a.type)) != 0) return nullptr;
    }
    return passed;
  }

  // Whether the number is 0 and stays that.
  bool RestsAtZero(const Instance& instance, int position) {
    const auto input = std::ranges::find(instance.inputs, position, &Input::position);
    if (input == instance.inputs.end()) return false;
    const Source& s = input->source;
    if (s.kind == Source::Kind::kVarying || (s.kind == Source::Kind::kInstance && draft_.varying[s.instance]))
      return false;
    const Value* value = statics_.Get(s, false);
    return value != nullptr && value->AsDouble() == 0;
  }

  // The points that come into an instance, where it touches none of these; else null.
  const Source* UntouchedBy(Index number, const PointSet& points) {
    const Instance& instance = table_.instances()[number];
    if (instance.kind != Instance::Kind::kNode || !table_.group(instance).touches ||
        table_.graph().def(instance.node).stateful)
      return nullptr;
    const ComputeGroup& group = table_.group(instance);
    if (statics_.Touches(number, points) && !RestsAtZero(instance, group.strength_input)) return nullptr;
    const auto input = std::ranges::find(instance.inputs, group.touched_input, &Input::position);
    return input == instance.inputs.end() ? nullptr : &input->source;
  }

  Status Read(Source source, const PointSet& points, Index segment, Reader reader, DraftInput* input) {
    while (source.kind == Source::Kind::kInstance && draft_.varying[source.instance]) {
      auto why = PlanDraft::Passed::kEquals;
      const Source* passed = PassedBy(source.instance);
      if (passed == nullptr && IsPointType(source.type)) {
        why = PlanDraft::Passed::kTouchesNone;
        passed = UntouchedBy(source.instance, points);
      }
      if (passed == nullptr || passed->type != source.type) break;
      draft_.passed[source.instance] = why;
      source = *passed;
    }
    input->component = source.component;
    input->type = source.type;
    input->points = points;
    if (source.kind == Source::Kind::kVarying) {
      input->kind = DraftInput::Kind::kVarying;
      input->varying = source.varying;
    } else if (source.kind == Source::Kind::kInstance && draft_.varying[source.instance]) {
      input->kind = DraftInput::Kind::kStep;
      uses_[source.instance].push_back({reader, segment, source.output, source.element, points});
    } else {
      input->value = statics_.Get(source, false);
      if (input->value == nullptr) return statics_.status();
      input->component = -1;  // the static value has it taken
    }
    return Status();
  }

  bool Varies(const Source& source) const {
    return source.kind == Source::Kind::kInstance && draft_.varying[source.instance];
  }
  int Depth(Index segment) const { return draft_.segments[segment].depth; }
  Index AncestorAt(Index segment, int depth) const {
    while (Depth(segment) > depth) segment = draft_.segments[segment].parent;
    return segment;
  }
  bool IsAncestorOrSelf(Index ancestor, Index segment) const {
    return AncestorAt(segment, Depth(ancestor)) == ancestor;
  }
  Index CommonAncestor(Index a, Index b) const {
    a = AncestorAt(a, Depth(b));
    b = AncestorAt(b, Depth(a));
    while (a != b) a = draft_.segments[a].parent, b = draft_.segments[b].parent;
    return a;
  }

  void Answer(const Use& use, Index step) {
    DraftInput& input =
        use.reader.step == kNoIndex
            ? draft_.outputs[static_cast<std::size_t>(use.reader.input)]
            : draft_.steps[use.reader.step].inputs[static_cast<std::size_t>(use.reader.input)];
    input.step = step;
    input.output = use.output;
    input.element = use.element;
  }

  Status MakeSteps(Index number) {
    std::vector<Use> uses = std::move(uses_[number]);
    const Instance& instance = table_.instances()[number];
    bool has_points = false;
    for (std::size_t p = 0; p < instance.output_sizes.size(); ++p) {
      has_points = has_points || IsPointType(table_.OutputType(instance, static_cast<int>(p)));
    }
    if (!has_points)
      return MakeStep(number, SegmentOf(uses), uses);  // one step, where all its users can see it
    // Demands are unioned within a segment, never across; a segment that holds what a descendant wants serves
    // it
    std::map<std::pair<int, Index>, std::vector<Use>> by_segment;
    for (Use& use : uses) by_segment[{Depth(use.segment), use.segment}].push_back(std::move(use));
    const auto first = static_cast<Index>(draft_.steps.size());
    for (auto& [key, group] : by_segment) {
      Index serving = kNoIndex;
      for (Index s = first; s < draft_.steps.size() && serving == kNoIndex; ++s) {
        if (draft_.steps[s].instance != number || !IsAncestorOrSelf(draft_.steps[s].segment, key.second))
          continue;
        const bool holds = std::all_of(group.begin(), group.end(), [&](const Use& use) {
          const PointSet& set =
              draft_.steps[s]
                  .sets.outputs[static_cast<std::size_t>(use.output)][static_cast<std::size_t>(use.element)];
          return use.points.total() == 0 || set.Includes(use.points);
        });
        if (holds) serving = s;
      }
      if (serving == kNoIndex) {
        KPSA_RETURN_IF_ERROR(MakeStep(number, key.second, group));
      } else {
        for (const Use& use : group) Answer(use, serving);
      }
    }
    return Status();
  }

  // Where a step runs that has all these readers: in the segment of one that is around all others; else, where all are
  // lazy in what is around them, in a segment that they share.
  Index SegmentOf(const std::vector<Use>& uses) {
    std::vector<Index> readers;
    for (const Use& use : uses) readers.push_back(use.segment);
    std::sort(readers.begin(), readers.end());
    readers.erase(std::unique(readers.begin(), readers.end()), readers.end());
    Index around = readers[0];
    for (const Index reader : readers) around = CommonAncestor(around, reader);
    if (std::binary_search(readers.begin(), readers.end(), around)) return around;
    const auto [at, added] = shared_.emplace(readers, static_cast<Index>(draft_.segments.size()));
    if (!added) return at->second;
    DraftSegment shared{around, draft_.segments[readers[0]].owner, Depth(around) + 1, 0, readers, {}};
    for (const Index reader : readers) {
      DraftSegment& user = draft_.segments[reader];
      user.needs.push_back(at->second);
      shared.owners = std::max(shared.owners, user.owners);
      if (user.owner != shared.owner) shared.owner = kNoIndex;
    }
    draft_.segments.push_back(std::move(shared));
    return at->second;
  }

  // How many owners are nested, for the limit of that.
  Status CheckDepth(const Instance& instance, Index segment) const {
    if (draft_.segments[segment].owners <= kMaxLazyDepth) return Status();
    return Status::Invalid("{}: lazy inputs are nested more than {} deep", Describe(table_, instance),
                           kMaxLazyDepth)
        .OfNode(table_.graph().name(instance.node));
  }

  // The bit of each input in what decide returns, of an eager one the last bit before it. A lazy_together array has one
  // for all of its elements, also where it has none; what a demand skips keeps its own.
  std::vector<int> LazyBits(const Instance& instance) const {
    if (instance.kind != Instance::Kind::kNode) return std::vector<int>(instance.inputs.size(), -1);
    std::vector<int> bits;
    int bit = -1, position = -1;
    for (const Input& input : instance.inputs) {
      for (; position < input.position; ++position) {
        const AttributeDef& a = table_.input_def(instance, position + 1);
        bit += a.lazy && a.lazy_together ? 1 : 0;
      }
      if (input.lazy && !table_.input_def(instance, input.position).lazy_together) ++bit;
      bits.push_back(bit);
    }
    return bits;
  }

  // Opens a segment for what a step evaluates on demand.
  Index OpenSegment(Index parent, Index owner) {
    const int owners = draft_.segments[draft_.steps[owner].segment].owners + 1;
    draft_.segments.push_back({parent, owner, Depth(parent) + 1, owners, {}, {}});
    return static_cast<Index>(draft_.segments.size() - 1);
  }

  Status MakeStep(Index number, Index segment, const std::vector<Use>& uses) {
    const Instance& instance = table_.instances()[number];
    const auto step_number = static_cast<Index>(draft_.steps.size());
    DraftStep step;
    step.instance = number;
    step.segment = segment;
    for (std::size_t p = 0; p < instance.output_sizes.size(); ++p) {
      step.sets.outputs.emplace_back();
      for (int e = 0; e < instance.output_sizes[p]; ++e) {
        Index total = 0;
        if (IsPointType(table_.OutputType(instance, static_cast<int>(p)))) {
          Result<Index> known = statics_.totals().OfOutput(number, static_cast<int>(p), e);
          if (!known.ok()) return known.status();
          total = *known;
        }
        step.sets.outputs.back().push_back(PointSet::None(total));
      }
    }
    for (const Use& use : uses) {
      PointSet& set =
          step.sets.outputs[static_cast<std::size_t>(use.output)][static_cast<std::size_t>(use.element)];
      if (use.points.total() > 0) set = set.Union(use.points);
    }
    KPSA_RETURN_IF_ERROR(FillDemand(table_, statics_.totals(), statics_, number, &step.sets));
    step.inputs.resize(instance.inputs.size());
    draft_.steps.push_back(std::move(step));
    for (const Use& use : uses) Answer(use, step_number);

    Index together = kNoIndex;  // the segment of the lazy inputs that have the last bit
    const std::vector<int> bit_of = LazyBits(instance);
    const int bits = bit_of.empty() ? 0 : bit_of.back() + 1;
    if (bits > kMaxLazyInputs) {
      return Status::Invalid("{} has more than {} lazy inputs", Describe(table_, instance), kMaxLazyInputs)
          .OfNode(table_.graph().name(instance.node));
    }
    int last_bit = -1;
    for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
      const Input& input = instance.inputs[i];
      const std::vector<bool>& skipped = draft_.steps[step_number].sets.skipped;
      if (!skipped.empty() && skipped[i]) {
        const AttributeDef& a = table_.input_def(instance, input.position);
        draft_.steps[step_number].inputs[i].type = a.type;
        draft_.steps[step_number].inputs[i].value = &a.default_value;
        continue;
      }
      Index reads_in = segment;
      if (input.lazy) {
        if (std::exchange(last_bit, bit_of[i]) != bit_of[i]) together = kNoIndex;
        Index child = kNoIndex;
        if (Varies(input.source)) {
          if (together == kNoIndex) {
            together = OpenSegment(segment, step_number);
            KPSA_RETURN_IF_ERROR(CheckDepth(instance, together));
          }
          child = reads_in = together;
        }
        draft_.steps[step_number].lazy_segments.push_back(child);
        draft_.steps[step_number].lazy_bits.push_back(static_cast<std::uint8_t>(bit_of[i]));
      }
      DraftInput read;
      const PointSet points = draft_.steps[step_number].sets.inputs[i];
      KPSA_RETURN_IF_ERROR(Read(input.source, points, reads_in, {step_number, static_cast<int>(i)}, &read));
      read.lazy = input.lazy;
      draft_.steps[step_number].inputs[i] = std::move(read);
    }
    if (bits > 0 && table_.group(instance).decide == nullptr) {
      return Status::Invalid("{} has lazy inputs but does not decide about them", Describe(table_, instance))
          .OfNode(table_.graph().name(instance.node));
    }
    return Status();
  }

  // A reader whose set is not the buffer's gets a compact copy, shared by readers of one segment.
  void InsertGathers() {
    std::map<std::tuple<Index, Index, Index, int, int, Digest>, Index>
        made;  // by what is read, where, and which points
    const auto serve = [&](DraftInput& input, Index segment) {
      if (!IsPointType(input.type) || input.kind == DraftInput::Kind::kConstant) return;
      const bool varying = input.kind == DraftInput::Kind::kVarying;
      const PointSet held =
          varying ? PointSet::All(input.points.total())
                  : draft_.steps[input.step].sets.outputs[static_cast<std::size_t>(input.output)]
                                                         [static_cast<std::size_t>(input.element)];
      if (held == input.points) return;
      const auto number = static_cast<Index>(draft_.steps.size());
      const auto [it, added] = made.emplace(std::make_tuple(input.step, input.varying, segment, input.output,
                                                            input.element, input.points.digest()),
                                            number);
      const DraftInput read = input;
      input.kind = DraftInput::Kind::kStep;
      input.step = it->second;
      input.output = input.element = 0;
      if (!added) return;
      DraftStep gather;
      gather.segment = segment;
      gather.gather_type = input.type;
      gather.sets.inputs = {held};
      gather.sets.outputs = {{input.points}};
      gather.inputs = {read};
      gather.inputs[0].points = held;
      gather.inputs[0].lazy = false;
      draft_.steps.push_back(std::move(gather));
    };
    for (Index s = 0, end = static_cast<Index>(draft_.steps.size()); s < end; ++s) {
      for (std::size_t i = 0, lazy = 0; i < draft_.steps[s].inputs.size(); ++i) {
        Index segment = draft_.steps[s].segment;
        if (draft_.steps[s].inputs[i].lazy) {
          const Index child = draft_.steps[s].lazy_segments[lazy++];
          if (child != kNoIndex) segment = child;
        }
        DraftInput input = draft_.steps[s].inputs[i];
        serve(input, segment);
        draft_.steps[s].inputs[i] = std::move(input);
      }
    }
    for (DraftInput& output : draft_.outputs) serve(output, 0);
  }

  InstanceTable& table_;
  StaticEvaluator& statics_;
  const Request& request_;
  PlanDraft draft_;
  std::vector<std::vector<Use>> uses_;
  std::map<std::vector<Index>, Index> shared_;  // segments, by those that read them
};

}  // namespace

Result<PlanDraft> DraftPlan(InstanceTable& table, StaticEvaluator& statics, const std::vector<Source>& wanted,
                            const Request& request) {
  return Drafter(table, statics, request).Run(wanted);
}

}  // namespace kpsa::engine
