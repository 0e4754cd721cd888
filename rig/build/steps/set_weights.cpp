#include "rig/build/steps/set_weights.h"

#include <algorithm>

#include "rig/graph_editor.h"

namespace kpsa::engine {

void WeightSetter::Set(MadeNode* made) {
  if (made->weighted == made->geometries.size()) return;
  const std::size_t first = made->weighted;
  made->weighted = made->geometries.size();
  const RigAttribute* members = made->Find("members");
  const RigAttribute* maps = made->Find("weights");
  const RigAttribute* falloff = made->Find("falloff");
  if (falloff != nullptr && falloff->value.is_scalar()) falloff = nullptr;  // a node: ConnectFalloffs
  if (members == nullptr && maps == nullptr && falloff == nullptr) return;
  for (const RigAttribute* key : {members, falloff}) {
    if (key != nullptr) maps_->Note(*made, *key, "");
  }

  std::vector<std::vector<float>> weights;
  for (const DeformedGeometry& of : made->geometries)
    weights.emplace_back(of.count, members == nullptr ? 1.0f : 0.0f);
  bool good = true;
  for (std::size_t g = first; g < weights.size() && members != nullptr; ++g) {
    const DeformedGeometry& of = made->geometries[g];
    good = members_.Add(members->value, members->source, *made, of, &weights[g]) && good;
    if (good && std::all_of(weights[g].begin(), weights[g].end(), [](float w) { return w == 0; })) {
      notes_->push_back(fmt::format("{}: the members of \"{}\" are no point of {}",
                                    members->value.where().ToString(), made->from->name, of.name));
    }
  }
  if (maps != nullptr) good = maps_->MultiplyByMaps(*maps, *made, &weights) && good;
  for (std::size_t g = first; g < weights.size() && falloff != nullptr; ++g) {
    good = falloffs_.Multiply(*falloff, *made, made->geometries[g], &weights[g]) && good;
  }
  if (!good) return;
  GraphEditor edit(graph_);
  for (std::size_t g = first; g < weights.size(); ++g) {
    edit.Set(made->id, "weights", static_cast<int>(g),
             std::make_shared<const WeightMap>(std::move(weights[g])));
  }
  in_.Fail(made->from->where, edit.Take());
}

void SetWeights(WeightSetter* setter, MadeNodes* nodes) {
  for (MadeNode& made : *nodes) setter->Set(&made);
}

}  // namespace kpsa::engine
