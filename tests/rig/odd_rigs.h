// A character for rigs that are odd and that the rules of the rig format allow.
#pragma once

#include <string>
#include <vector>

#include "tests/rig/rig_player.h"

namespace kpsa::engine {

// The character of GltfBuilder with two primitives, a twin of its mesh, a mesh without a skin, and any names.
class OddRigs : public RigFixture {
 protected:
  // Nodes: 0 body, 1 root, 2 tip, 3 between them, 4 twin, 5 prop, 6 alone.
  GltfBuilder Builder(const std::vector<std::string>& names) const {
    GltfBuilder b = GltfBuilder::Character();
    b.Push("materials", {{"name", "Eye [l]"}});
    nlohmann::json second = b.root["meshes"][0]["primitives"][0];
    second["material"] = 1;
    b.root["meshes"][0]["primitives"].push_back(second);
    b.Push("meshes", {{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 3}}}}});
    b.Push("nodes", {{"mesh", 0}, {"skin", 0}});
    b.Push("nodes", {{"mesh", 1}, {"translation", {5, 0, 0}}});
    b.Push("nodes", nlohmann::json::object());
    b.root["scenes"][0]["nodes"] = {0, 1, 4, 5, 6};
    for (std::size_t i = 0; i < names.size(); ++i) {
      b.root["nodes"][i].erase("name");
      if (!names[i].empty()) b.root["nodes"][i]["name"] = names[i];
    }
    return b;
  }
  void Names(const std::vector<std::string>& names) const { folder.Write("c.gltf", Builder(names).Text()); }
  void Plain() const { Names({"body", "root", "tip", "mid", "twin", "prop", "alone"}); }
  // The rig is evaluated, too, and nothing is said of it but `notes`.
  Rig Sound(const std::string& text, std::size_t notes = 0) {
    Rig rig = Loaded(text);
    EXPECT_EQ(rig.notes.size(), notes) << fmt::format("{}", fmt::join(rig.notes, "\n"));
    RigPlayer player(folder / "t.yaml");
    EXPECT_TRUE(player.ok());
    for (std::size_t m = 0; player.ok() && m < player.rig.scene.meshes.size(); ++m) {
      for (const Double3& p : player.Points(m)) EXPECT_LT(Length(p), 1e3);
    }
    return rig;
  }
  static std::vector<float> Weights(const Rig& rig, const std::string& plug, std::size_t mesh = 0) {
    const Value value = Held(rig, plug);
    const auto* map = value.asset<WeightMap>();
    std::vector<float> by_vertex;
    const auto& points = rig.scene.meshes[mesh].mesh().data().vertex_to_point;
    for (std::size_t v = 0; map != nullptr && v < points.size(); ++v)
      by_vertex.push_back(map->weights()[points[v]]);
    return by_vertex;
  }
};

}  // namespace kpsa::engine
