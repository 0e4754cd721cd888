#include "graph/node_binding.h"

#include <algorithm>

#include "base/near_names.h"
#include "graph/authored.h"

namespace kpsa::engine {
namespace {

[[noreturn]] void ThrowUnknown(const InstanceTable& table, const Instance& instance, std::string_view name,
                               bool output) {
  std::vector<std::string> names;
  for (const AttributeDef& a : table.graph().def(instance.node).attributes) {
    if (a.output == output && !a.structural) names.push_back(a.name);
  }
  ThrowMisuse("it asks for the points of \"{}\", which is no {} of it{}; it has {}", name,
              output ? "output" : "input", DidYouMean(std::string(name), names), fmt::join(names, ", "));
}

// Positions of attributes in a group, by name; -1 where an array has no such element, or another group reads it.
int InputNumber(const InstanceTable& table, const Instance& instance, std::string_view name, int element) {
  const ComputeGroup& group = table.group(instance);
  for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
    const Input& input = instance.inputs[i];
    const AttributeDef& a = table.input_def(instance, input.position);
    if (a.name != name) continue;
    const bool one = !a.array || (a.per_geometry && group.per_geometry);
    if (one || input.element == element) return static_cast<int>(i);
  }
  const NodeDef& def = table.graph().def(instance.node);
  const auto declared = std::ranges::any_of(
      def.attributes, [&](const AttributeDef& a) { return a.name == name && !a.output && !a.structural; });
  if (!declared) ThrowUnknown(table, instance, name, false);
  return -1;
}

int OutputPosition(const InstanceTable& table, const Instance& instance, std::string_view name) {
  for (std::size_t p = 0; p < instance.output_sizes.size(); ++p) {
    if (table.output_def(instance, static_cast<int>(p)).name == name) return static_cast<int>(p);
  }
  ThrowUnknown(table, instance, name, true);
}

const PointSet& OutputSet(const InstanceTable& table, const Instance& instance, const InstanceSets& sets,
                          std::string_view name, int element) {
  static const PointSet kNone;
  const auto& elements = sets.outputs[static_cast<std::size_t>(OutputPosition(table, instance, name))];
  const auto e = static_cast<std::size_t>(table.group(instance).per_geometry ? 0 : element);
  return e < elements.size() ? elements[e] : kNone;
}

class DemandOf final : public Demand {
 public:
  DemandOf(InstanceTable& table, const Instance& instance, const Structural& structural, InstanceSets* sets)
      : table_(table), instance_(instance), structural_(structural), sets_(sets) {}
  const Structural& structural() const override { return structural_; }
  const PointSet& output(std::string_view name, int element) const override {
    return OutputSet(table_, instance_, *sets_, name, element);
  }
  Index input_total(std::string_view name, int element) const override {
    const int i = InputNumber(table_, instance_, name, element);
    return i < 0 ? 0 : sets_->inputs[static_cast<std::size_t>(i)].total();
  }
  void Require(std::string_view name, int element, const PointSet& points) override {
    const int i = InputNumber(table_, instance_, name, element);
    if (i < 0) return;
    PointSet& set = sets_->inputs[static_cast<std::size_t>(i)];
    if (set.total() == points.total()) {
      set = set.Union(points);
    } else {
      mismatch = fmt::format("{} asks for points of an array of {}, its input has {}", name, points.total(),
                             set.total());
    }
  }
  void Skip(std::string_view name, int element) override {
    const int i = InputNumber(table_, instance_, name, element);
    if (i < 0) return;
    const Input& input = instance_.inputs[static_cast<std::size_t>(i)];
    if (input.lazy || !IsSmallType(table_.input_def(instance_, input.position).type))
      ThrowMisuse("it skips \"{}\"; expected an input that is neither lazy nor points", name);
    sets_->skipped.resize(instance_.inputs.size(), false);
    sets_->skipped[static_cast<std::size_t>(i)] = true;
  }
  std::string mismatch;

 private:
  InstanceTable& table_;
  const Instance& instance_;
  const Structural& structural_;
  InstanceSets* sets_;
};

class BindingOf final : public Binding {
 public:
  BindingOf(InstanceTable& table, const Instance& instance, const Structural& structural,
            const InstanceSets& sets)
      : table_(table), instance_(instance), structural_(structural), sets_(sets) {}
  const Structural& structural() const override { return structural_; }
  const PointSet& output(std::string_view name, int element) const override {
    return OutputSet(table_, instance_, sets_, name, element);
  }
  const PointSet& input(std::string_view name, int element) const override {
    static const PointSet kNone;
    const int i = InputNumber(table_, instance_, name, element);
    return i < 0 ? kNone : sets_.inputs[static_cast<std::size_t>(i)];
  }

 private:
  InstanceTable& table_;
  const Instance& instance_;
  const Structural& structural_;
  const InstanceSets& sets_;
};

}  // namespace

std::string Describe(const InstanceTable& table, const Instance& instance) {
  return fmt::format("node \"{}\" ({})", table.graph().name(instance.node),
                     table.graph().def(instance.node).name);
}

Status CheckChildren(const InstanceTable& table, const Instance& instance, std::size_t count) {
  for (int child : instance.children) {
    if (static_cast<std::size_t>(child / 4) < count) continue;
    const PlugRef plug{instance.node, instance.attribute, child / 4, child % 4 == 3 ? -1 : child % 4};
    return Status::Invalid("{} is driven, but there are {} points", table.graph().PlugName(plug), count);
  }
  return Status();
}

Result<Index> PointTotals::OfSource(const Source& source) {
  if (source.kind == Source::Kind::kInstance) return OfOutput(source.instance, source.output, source.element);
  const PointBuffer* points = source.value->points();
  return points == nullptr ? Index{0} : static_cast<Index>(points->count());
}

Result<Index> PointTotals::OfOutput(Index number, int position, int element) {
  // Follows the chain of first points inputs without recursion: stacks may be long
  struct Key {
    Index instance;
    int position, element;
  };
  std::vector<Key> chain;
  Index total = 0;
  for (Key key{number, position, element};;) {
    if (memo_.size() < table_.instances().size()) memo_.resize(table_.instances().size());
    const Instance& instance = table_.instances()[key.instance];
    auto& memo = memo_[key.instance];
    if (memo.empty()) {
      for (int size : instance.output_sizes) memo.emplace_back(static_cast<std::size_t>(size), kNoIndex);
    }
    const Index known = memo[static_cast<std::size_t>(key.position)][static_cast<std::size_t>(key.element)];
    if (known != kNoIndex) {
      total = known;
      break;
    }
    chain.push_back(key);
    if (instance.kind == Instance::Kind::kNode) {
      const ComputeGroup& group = table_.group(instance);
      if (group.point_count) {
        const StructuralView view(table_, instance.node, instance.geometry, &instance, &statics_);
        Result<Index> count = CallAuthored(table_, instance.node, [&] {
          return group.point_count(view, table_.output_def(instance, key.position).name, key.element);
        });
        if (!count.ok())
          return Status::Invalid("{}: {}", Describe(table_, instance), count.status().ToString())
              .OfNode(table_.graph().name(instance.node));
        total = *count;
        break;
      }
    }
    const Source* next = nullptr;
    for (const Input& input : instance.inputs) {
      if (IsPointType(input.source.type)) {
        next = &input.source;
        break;
      }
    }
    if (next == nullptr || next->kind != Source::Kind::kInstance) {
      total = next == nullptr || next->value->points() == nullptr
                  ? 0
                  : static_cast<Index>(next->value->points()->count());
      break;
    }
    key = {next->instance, next->output, next->element};
  }
  for (const Key& key : chain) {
    memo_[key.instance][static_cast<std::size_t>(key.position)][static_cast<std::size_t>(key.element)] =
        total;
  }
  return total;
}

Result<InstanceSets> FullOutputs(InstanceTable& table, PointTotals& totals, Index number) {
  InstanceSets sets;
  const Instance& instance = table.instances()[number];
  for (std::size_t p = 0; p < instance.output_sizes.size(); ++p) {
    sets.outputs.emplace_back();
    for (int e = 0; e < instance.output_sizes[p]; ++e) {
      if (!IsPointType(table.OutputType(instance, static_cast<int>(p)))) {
        sets.outputs.back().emplace_back();
        continue;
      }
      Result<Index> total = totals.OfOutput(number, static_cast<int>(p), e);
      if (!total.ok()) return total.status();
      sets.outputs.back().push_back(PointSet::All(*total));
    }
  }
  return sets;
}

Status FillDemand(InstanceTable& table, PointTotals& totals, StaticValues& statics, Index number,
                  InstanceSets* sets) {
  const Instance& instance = table.instances()[number];
  sets->inputs.clear();
  sets->skipped.clear();
  for (const Input& input : instance.inputs) {
    Index total = 0;
    if (IsPointType(input.source.type)) {
      Result<Index> known = totals.OfSource(input.source);
      if (!known.ok()) return known.status();
      total = *known;
    }
    sets->inputs.push_back(PointSet::None(total));
  }
  if (instance.kind == Instance::Kind::kAssemble) {
    if (!IsPointType(instance.type)) return Status();
    sets->inputs[0] = sets->outputs[0][0];
    return CheckChildren(table, instance, sets->inputs[0].total());
  }
  if (instance.kind == Instance::Kind::kConvert) return Status();
  const ComputeGroup& group = table.group(instance);
  if (group.demand) {
    const StructuralView view(table, instance.node, instance.geometry, &instance, &statics);
    DemandOf demand(table, instance, view, sets);
    CallAuthored(table, instance.node, [&] {
      group.demand(demand);
      return true;
    });
    if (!demand.mismatch.empty())
      return Status::Invalid("{}: {}", Describe(table, instance), demand.mismatch)
          .OfNode(table.graph().name(instance.node));
    return Status();
  }
  // The default: the same points of every points input
  const PointSet* wanted = nullptr;
  for (const auto& elements : sets->outputs) {
    for (const PointSet& set : elements) {
      if (set.total() > 0 && wanted == nullptr) wanted = &set;
    }
  }
  for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
    if (!IsPointType(instance.inputs[i].source.type)) continue;
    if (wanted == nullptr) {  // only small outputs are wanted (a measure of all points)
      sets->inputs[i] = PointSet::All(sets->inputs[i].total());
      continue;
    }
    if (sets->inputs[i].total() != wanted->total()) {
      return Status::Invalid("{}: {} has {} points, its output {}", Describe(table, instance),
                             table.input_def(instance, instance.inputs[i].position).name,
                             sets->inputs[i].total(), wanted->total())
          .OfNode(table.graph().name(instance.node));
    }
    sets->inputs[i] = *wanted;
  }
  return Status();
}

Result<BoundKernel> Bind(InstanceTable& table, StaticValues& statics, Index number,
                         const InstanceSets& sets) {
  const Instance& instance = table.instances()[number];
  if (instance.kind != Instance::Kind::kNode || !table.group(instance).bind) return BoundKernel();
  const StructuralView view(table, instance.node, instance.geometry, &instance, &statics);
  const BindingOf binding(table, instance, view, sets);
  Result<BoundKernel> kernel =
      CallAuthored(table, instance.node, [&] { return table.group(instance).bind(binding); });
  if (!kernel.ok())
    return Status::Invalid("{}: {}", Describe(table, instance), kernel.status().ToString())
        .OfNode(table.graph().name(instance.node));
  return kernel;
}

}  // namespace kpsa::engine
