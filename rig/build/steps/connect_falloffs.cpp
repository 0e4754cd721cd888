#include "rig/build/steps/connect_falloffs.h"

#include <algorithm>
#include <map>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr int kMaxFalloffDepth = 64, kMaxFalloffUses = 1024;

class FalloffNodes {
 public:
  FalloffNodes(const BuildInput& in, MadeNodes* nodes, std::vector<FalloffUse>* uses, Graph* graph)
      : in_(in), nodes_(nodes), uses_(uses), graph_(graph) {}

  // The weights that a falloff node gives the points of a deformer's geometry; none after an error.
  std::optional<PlugRef> Of(const YamlNode& name, const MadeNode& deformer, std::size_t geometry, int depth) {
    if (name.is_map() || name.is_sequence()) {
      in_.errors->Add(name, "expected the name of a falloff node, found {}", name.kind_name());
      return std::nullopt;
    }
    const std::optional<NodeId> found = FindWithOutputs(in_, *nodes_, name, {"outputWeights"}, "falloff");
    if (!found.has_value()) return std::nullopt;
    MadeNode& falloff = *nodes_->Find(*found);
    if (depth > kMaxFalloffDepth || elements_[found->index] >= kMaxFalloffUses) {
      in_.errors->Add(name, "\"{}\" is made of itself, or used too often", name.scalar);
      return std::nullopt;
    }
    GraphEditor edit(graph_);
    if (edit.Has(*found, "weights")) {  // a map for this geometry
      std::vector<DeformedGeometry>& maps = falloff.geometries;
      const DeformedGeometry& of = deformer.geometries[geometry];
      auto map = std::find_if(maps.begin(), maps.end(),
                              [&](const DeformedGeometry& m) { return m.name == of.name; });
      if (map == maps.end()) map = maps.insert(map, of);
      return edit.Plug(*found, "outputWeights", static_cast<int>(map - maps.begin()));
    }
    const auto g = static_cast<int>(geometry);
    const int element = elements_[found->index]++;
    const PlugRef weights = edit.Plug(*found, "outputWeights", element);
    if (edit.Has(*found, "inPoints")) {
      const PlugRef from = edit.Plug(deformer.id, "inPoints", g), to = edit.Plug(*found, "inPoints", element);
      if (const Connection* connection = graph_->FindConnection(from)) {
        edit.Connect(PlugRef(connection->source), to);
      } else if (const Value* points = graph_->FindValue(from)) {
        edit.Set(*found, "inPoints", element, Value(*points));
      }
      uses_->push_back({*found, deformer.id, element, g});
      return in_.Fail(name.where(), edit.Take()) ? std::optional(weights) : std::nullopt;
    }
    const RigAttribute* parts = falloff.Find("falloffs");
    if (parts == nullptr || !parts->value.is_sequence() || parts->value.items.size() != 2) {
      in_.errors->Add(parts == nullptr ? name : parts->value,
                      "\"{}\" ({}): expected two falloff nodes, falloffs: [a, b]", name.scalar,
                      graph_->def(*found).name);
      return std::nullopt;
    }
    for (const std::size_t side : {0u, 1u}) {
      const std::optional<PlugRef> part = Of(parts->value.items[side], deformer, geometry, depth + 1);
      if (!part.has_value()) return std::nullopt;
      edit.Connect(*part, edit.Plug(*found, side == 0 ? "input1" : "input2", element));
    }
    return in_.Fail(name.where(), edit.Take()) ? std::optional(weights) : std::nullopt;
  }

 private:
  const BuildInput& in_;
  MadeNodes* nodes_;
  std::vector<FalloffUse>* uses_;
  Graph* graph_;
  std::map<Index, int> elements_;  // by falloff node: how many geometries it measures
};

}  // namespace

void ConnectFalloffs(const BuildInput& in, MadeNodes* nodes, std::vector<FalloffUse>* uses, Graph* graph) {
  FalloffNodes falloffs(in, nodes, uses, graph);
  for (const MadeNode& made : *nodes) {
    if (in.errors->full()) return;
    const RigAttribute* key = made.Find("falloff");
    if (key == nullptr || !key->value.is_scalar()) continue;
    const YamlNode& name = key->value;
    GraphEditor edit(graph);
    if (!edit.Has(made.id, "falloffWeights")) {
      in.errors->Add(name, "falloff: expected a falloff at rest, {{at: PLACE, radius: 5}}, found \"{}\"",
                     name.scalar);
      continue;
    }
    if (nodes->Find(name.scalar) == nullptr && !name.quoted && !name.scalar.empty() &&
        name.scalar.find_first_not_of("0123456789.+-") == std::string::npos) {
      in.errors->Add(
          name, "falloff: expected {{at: PLACE, radius: 5}}, another shape, or the name of a falloff node");
      continue;
    }
    for (std::size_t g = 0; g < made.geometries.size(); ++g) {
      const std::optional<PlugRef> weights = falloffs.Of(name, made, g, 0);
      if (!weights.has_value()) break;
      edit.Connect(*weights, edit.Plug(made.id, "falloffWeights", static_cast<int>(g)));
    }
    in.Fail(name.where(), edit.Take());
  }
}

}  // namespace kpsa::engine
