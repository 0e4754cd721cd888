// VRM's expressions (VRMC_vrm 1.0, expressions.md): what each one is worth beside the others, and what they
// add to the morph weights of a mesh.
#include <algorithm>
#include <array>

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// What may be held back, by its number in `kind`: 1 blink, 2 lookAt, 3 mouth.
constexpr std::size_t kHeldKinds = 3;
enum class HoldingBack { kNone, kAll, kSome };
constexpr auto kMostOverride = static_cast<std::int64_t>(HoldingBack::kSome);
const char* const kOverrideNames[kHeldKinds] = {"overrideBlink", "overrideLookAt", "overrideMouth"};

struct ExpressionRule {
  bool binary = false;
  std::size_t kind = 0;
  std::array<HoldingBack, kHeldKinds> overrides = {};
};
struct ExpressionsKernel {
  std::vector<ExpressionRule> rules;
  // Input weight[i], as its rule has it; also of what has no number.
  double Value(const ArrayView<double>& weights, std::uint32_t i) const {
    const double weight = i < weights.size() && weights[i] > 0 ? std::min(weights[i], 1.0) : 0.0;
    if (i < rules.size() && rules[i].binary) return weight > 0.5 ? 1 : 0;
    return weight;
  }
};

Result<BoundKernel> BindExpressions(const Binding& binding) {
  const Structural& s = binding.structural();
  ExpressionsKernel kernel;
  // Calls set(rule, value) for each entry of a list of choices.
  const auto read = [&](const char* name, std::int64_t most, const auto& set) -> Status {
    const auto& list = s.value(name).get<std::vector<std::int64_t>>();
    kernel.rules.resize(std::max(kernel.rules.size(), list.size()));
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i] < 0 || list[i] > most)
        return Status::Invalid("{}: entry {} is {}, expected 0 to {}", name, i, list[i], most);
      set(&kernel.rules[i], list[i]);
    }
    return {};
  };
  KPSA_RETURN_IF_ERROR(
      read("isBinary", 1, [](ExpressionRule* rule, std::int64_t v) { rule->binary = v != 0; }));
  KPSA_RETURN_IF_ERROR(read("kind", kHeldKinds, [](ExpressionRule* rule, std::int64_t v) {
    rule->kind = static_cast<std::size_t>(v);
  }));
  for (std::size_t held = 0; held < kHeldKinds; ++held) {
    KPSA_RETURN_IF_ERROR(
        read(kOverrideNames[held], kMostOverride, [held](ExpressionRule* rule, std::int64_t v) {
          rule->overrides[held] = static_cast<HoldingBack>(v);
        }));
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeExpressions(NodeContext<In<"weight", ArrayView<double>>, Out<"output", OutArray<double>>> c) {
  const auto& k = c.kernel_as<ExpressionsKernel>();
  const ArrayView<double> weights = c.get<"weight">();
  std::array<double, kHeldKinds> held_back = {};
  for (std::uint32_t i = 0; i < k.rules.size(); ++i) {
    const double value = k.Value(weights, i);
    if (!(value > 0)) continue;
    for (std::size_t held = 0; held < kHeldKinds; ++held) {
      if (k.rules[i].kind == held + 1 || k.rules[i].overrides[held] == HoldingBack::kNone) continue;
      held_back[held] += k.rules[i].overrides[held] == HoldingBack::kAll ? 1 : value;
    }
  }
  const OutArray<double> out = c.out<"output">();
  for (std::uint32_t i = 0; i < out.size(); ++i) {
    double value = k.Value(weights, i);
    if (i < k.rules.size() && k.rules[i].kind != 0) {
      const double back = held_back[k.rules[i].kind - 1];
      value = back > 0 && k.rules[i].binary ? 0 : value * (1 - std::min(back, 1.0));
    }
    out[i] = value;
  }
}

struct MorphBind {
  std::uint32_t target, expression;
  double share;
};
struct MorphWeightsKernel {
  std::vector<MorphBind> binds;  // by target; those of one in their order
};

Result<BoundKernel> BindMorphWeights(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto& targets = s.value("targets").get<std::vector<std::int64_t>>();
  const auto& expressions = s.value("expressions").get<std::vector<std::int64_t>>();
  const auto& shares = s.value("shares").get<std::vector<double>>();
  if (targets.size() != expressions.size() || targets.size() != shares.size()) {
    return Status::Invalid("targets has {} entries, expressions {}, shares {}; expected as many of each",
                           targets.size(), expressions.size(), shares.size());
  }
  MorphWeightsKernel kernel;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    for (const auto& [name, value] :
         {std::pair("targets", targets[i]), std::pair("expressions", expressions[i])}) {
      if (value < 0 || value >= kMaxArrayElements)
        return Status::Invalid("{}: entry {} is {}, expected an index below {}", name, i, value,
                               kMaxArrayElements);
    }
    kernel.binds.push_back(
        {static_cast<std::uint32_t>(targets[i]), static_cast<std::uint32_t>(expressions[i]), shares[i]});
  }
  std::stable_sort(kernel.binds.begin(), kernel.binds.end(),
                   [](const MorphBind& a, const MorphBind& b) { return a.target < b.target; });
  return MakeBound(std::move(kernel), 0);
}

void ComputeMorphWeights(NodeContext<In<"weight", ArrayView<double>>, In<"expression", ArrayView<double>>,
                                     Out<"output", OutArray<double>>>
                             c) {
  const auto& k = c.kernel_as<MorphWeightsKernel>();
  const ArrayView<double> weights = c.get<"weight">(), expressions = c.get<"expression">();
  auto bind = k.binds.begin();
  const OutArray<double> out = c.out<"output">();
  for (std::uint32_t i = 0; i < out.size(); ++i) {
    double weight = i < weights.size() ? weights[i] : 0.0;
    if (bind != k.binds.end() && bind->target == i) {
      for (; bind != k.binds.end() && bind->target == i; ++bind)
        weight += bind->expression < expressions.size() ? expressions[bind->expression] * bind->share : 0.0;
      weight = std::clamp(weight, 0.0, 1.0);
    }
    out[i] = weight;
  }
}

}  // namespace

KPSA_NODES(vrm_expressions, registry) {
  const std::vector<std::int64_t> none;
  registry
      .add("vrmExpressions",
           "A VRM character's expressions: controls, and what they are worth beside each other.")
      .in("weight", 0.0, {.min = 0, .max = 1, .doc = "control of an expression, by its name"})
      .array()
      .structural("isBinary", none,
                  {.doc = "1: above 0.5 all of the expression, else nothing; 0 where the list ends"})
      .structural("kind", none, {.doc = "what it moves: 1 blink, 2 lookAt, 3 mouth, 0 anything else"})
      .structural(
          "overrideBlink", none,
          {.doc = "what it does to those of kind 1: 1 none of them while it is above 0, 2 less of them by "
                  "as much as it is"})
      .structural("overrideLookAt", none, {.doc = "likewise to those of kind 2"})
      .structural("overrideMouth", none, {.doc = "likewise to those of kind 3"})
      .out("output", Type::kDouble, "0 to 1")
      .array()
      .compute<ComputeExpressions>()
      .bind(BindExpressions)
      .cost(50, 0);
  registry.add("vrmMorphWeights", "A mesh's morph weights: its own, and what the expressions add.")
      .in("weight", 0.0, {.doc = "own weight of a morph target, or the clip's"})
      .array()
      .in("expression", 0.0, {.doc = "output of a vrmExpressions"})
      .array()
      .structural("targets", none,
                  {.doc = "a morph target; with expressions and shares one entry for each bind"})
      .structural("expressions", none, {.doc = "the element of expression that adds to it"})
      .structural("shares", std::vector<double>{}, {.doc = "its weight at all of the expression"})
      .out("output", Type::kDouble, "the sum; 0 to 1 for what expressions add to")
      .array()
      .compute<ComputeMorphWeights>()
      .bind(BindMorphWeights)
      .cost(60, 0);
}

}  // namespace kpsa::engine
