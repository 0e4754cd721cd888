// What the viewer's page can colour meshes with: weights of joints, and where deformers act.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "report/page_data.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct PageField {
  std::string name;   // "joint:jaw", "deformer:mush"; each once
  std::string group;  // "joints" or "deformers"
  std::string label;  // "jaw", "mush"
};

// Of all shown meshes: the joints of their skins in the order of the skins, then the deformers in the order of stacks.
std::vector<PageField> FieldsOf(const Rig& rig);
// By stacked vertex [V], 0 to 1; 0 for vertices of meshes without that joint or deformer. Of deformers, members, maps
// and falloffs multiplied. None where the rig has no such field.
std::optional<std::vector<float>> FieldWeights(const Rig& rig, std::string_view name);
// Its own key, without blobs: whoever shows a field asks for it.
void PutFields(const Rig& rig, PageData* page);

}  // namespace kpsa::engine
