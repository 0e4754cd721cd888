// KHR_draco_mesh_compression: documents that are compressed here, by Draco's encoder.
#include <draco/compression/decode.h>

#include <functional>
#include <map>

#include "tests/gltf/draco_character.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

TEST(GltfDraco, SequentialKeepsEverything) {
  DracoCharacter character(12, draco::MESH_SEQUENTIAL_ENCODING);
  const gltf::Character plain = MustLoadText(character.grid.builder.Text());
  const GltfBuilder document = character.Document();
  ExpectSame(MustLoadText(document.Text()), plain);
  ExpectSame(MustLoadText(document.Glb()), plain);
}

// The order of vertices is Draco's; morph targets are written in that order.
TEST(GltfDraco, EdgebreakerInDracosOrder) {
  DracoCharacter character(12, draco::MESH_EDGEBREAKER_ENCODING);
  const GridCharacter& grid = character.grid;
  const std::size_t n = grid.vertex_count;
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(character.data.data()), character.data.size());
  const auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  ASSERT_TRUE(decoded.ok());
  ASSERT_EQ(decoded.value()->num_points(), n);
  std::map<std::array<float, 3>, std::size_t> known;
  for (std::size_t i = 0; i < n; ++i)
    known[{grid.positions[3 * i], grid.positions[3 * i + 1], grid.positions[3 * i + 2]}] = i;
  ASSERT_EQ(known.size(), n);
  std::vector<std::size_t> before(n);  // by decoded vertex
  bool moved = false;
  std::vector<float> deltas;
  for (std::uint32_t i = 0; i < n; ++i) {
    std::array<float, 3> at;
    decoded.value()
        ->GetNamedAttribute(draco::GeometryAttribute::POSITION)
        ->GetMappedValue(draco::PointIndex(i), at.data());
    ASSERT_EQ(known.count(at), 1u);
    before[i] = known[at];
    moved = moved || before[i] != i;
    deltas.insert(deltas.end(), &grid.deltas[3 * before[i]], &grid.deltas[3 * before[i]] + 3);
  }
  EXPECT_TRUE(moved);  // or the test shows nothing

  GltfBuilder document = character.Document();
  document.root["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = document.Accessor(deltas, "VEC3");
  const gltf::Mesh got = MustLoadText(document.Text()).meshes.at(0),
                   plain = MustLoadText(grid.builder.Text()).meshes.at(0);
  ASSERT_EQ(got.vertex_count(), n);
  ASSERT_EQ(got.targets.at(0).vertices.size(), n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(got.positions[3 * i + c], plain.positions[3 * before[i] + c]);
      if (c < 2) {
        EXPECT_EQ(got.uvs.at(2 * i + c), plain.uvs.at(2 * before[i] + c));
      }
      EXPECT_EQ(got.normals.at(3 * i + c), plain.normals.at(3 * before[i] + c));
      EXPECT_EQ(got.colors[3 * i + c], plain.colors[3 * before[i] + c]);
      EXPECT_EQ(got.targets[0].deltas[3 * i + c], plain.targets.at(0).deltas[3 * before[i] + c]);
    }
    const auto a = got.influence_rows().row(i), b = plain.influence_rows().row(before[i]);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].joint, b[k].joint);
      EXPECT_EQ(a[k].weight, b[k].weight);
    }
  }
  // The same triangles, from any corner on, in any order
  const auto triangles = [](const gltf::Mesh& mesh, const std::function<Index(Index)>& vertex) {
    std::multiset<std::array<Index, 3>> all;
    const std::vector<Index>& list = mesh.primitives.at(0).triangles;
    for (std::size_t t = 0; t < list.size(); t += 3) {
      std::array<Index, 3> corners = {vertex(list[t]), vertex(list[t + 1]), vertex(list[t + 2])};
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      all.insert(corners);
    }
    return all;
  };
  EXPECT_EQ(triangles(got, [&](Index i) { return static_cast<Index>(before[i]); }),
            triangles(plain, [](Index i) { return i; }));
}

TEST(GltfDraco, QuantizedPositionsAndShortJoints) {
  DracoCharacter character(10, draco::MESH_SEQUENTIAL_ENCODING, 14);
  GltfBuilder document = character.Document();
  const auto accessor = [&](int i) -> json& {
    return document.root["accessors"][static_cast<std::size_t>(i)];
  };
  accessor(character.grid.joint)["componentType"] = 5123;   // wider than what Draco holds
  document.root["meshes"][0]["primitives"][0]["mode"] = 5;  // of what was compressed; Draco gives triangles
  const gltf::Mesh got = MustLoadText(document.Text()).meshes.at(0),
                   plain = MustLoadText(character.grid.builder.Text()).meshes.at(0);
  ExpectNear(got.positions, plain.positions, 10 / 16384.0);
  EXPECT_EQ(got.primitives.at(0).triangles, plain.primitives.at(0).triangles);
  ASSERT_EQ(got.influences.size(), plain.influences.size());
  for (std::size_t i = 0; i < got.influences.size(); ++i)
    EXPECT_EQ(got.influences[i].joint, plain.influences[i].joint);
}

TEST(GltfDraco, WhatDoesNotFit) {
  DracoCharacter character(6, draco::MESH_SEQUENTIAL_ENCODING), edges(6, draco::MESH_EDGEBREAKER_ENCODING);
  const GridCharacter& grid = character.grid;
  const auto extension = [](GltfBuilder& b) -> json& {
    return b.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
  };
  const auto accessor = [](GltfBuilder& b, int i) -> json& {
    return b.root["accessors"][static_cast<std::size_t>(i)];
  };
  // Where the compressed bytes begin
  const auto data = [&](GltfBuilder& b) {
    return &b.buffer[b.root["bufferViews"][extension(b)["bufferView"].get<std::size_t>()]["byteOffset"]
                         .get<std::size_t>()];
  };
  const auto count_all = [&](GltfBuilder& b, std::uint64_t vertices, std::uint64_t indices) {
    for (const int i : {grid.position, grid.color, grid.uv, grid.normal, grid.joint, grid.weight})
      accessor(b, i)["count"] = vertices;
    accessor(b, grid.index)["count"] = indices;
  };
  struct Damage {
    const char* message;
    std::function<void(GltfBuilder&)> apply;
  };
  const std::vector<Damage> damages = {
      {"bufferView is 99", [&](GltfBuilder& b) { extension(b)["bufferView"] = 99; }},
      {"attributes is missing", [&](GltfBuilder& b) { extension(b).erase("attributes"); }},
      {"attributes is an array", [&](GltfBuilder& b) { extension(b)["attributes"] = json::array(); }},
      {"attributes.POSITION must be a whole",
       [&](GltfBuilder& b) { extension(b)["attributes"]["POSITION"] = -1; }},
      {"has no attribute 77 for POSITION",
       [&](GltfBuilder& b) { extension(b)["attributes"]["POSITION"] = 77; }},
      {"has 4 components of POSITION, its accessor has 3",
       [&](GltfBuilder& b) { extension(b)["attributes"]["POSITION"] = character.Ids()["JOINTS_0"]; }},
      {"values of POSITION that do not fit",
       [&](GltfBuilder& b) { accessor(b, grid.position)["componentType"] = 5121; }},
      {"mode is 1, expected 4 or 5",
       [](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0]["mode"] = 1; }},
      {"that of POSITION 35", [&](GltfBuilder& b) { accessor(b, grid.position)["count"] = 35; }},
      {"has 36 vertices and 50 triangles, the accessors have room for 35",
       [&](GltfBuilder& b) { count_all(b, 35, 150); }},
      {"has 36 vertices and 50 triangles, the accessors have room for 36 and 49",
       [&](GltfBuilder& b) { count_all(b, 36, 147); }},
      {"decodes to 36 vertices, the accessors say 37", [&](GltfBuilder& b) { count_all(b, 37, 150); }},
      {"targets[0].POSITION", [&](GltfBuilder& b) { accessor(b, grid.delta)["count"] = 35; }},
      {"does not begin as Draco", [&](GltfBuilder& b) { data(b)[0] = 'd'; }},
      {"no Draco bitstream of version 2.2", [&](GltfBuilder& b) { data(b)[6] = 1; }},
      {"no Draco mesh of triangles", [&](GltfBuilder& b) { data(b)[7] = 0; }},
      {"unknown method 9", [&](GltfBuilder& b) { data(b)[8] = 9; }},
      {"the compressed bytes end at",
       [&](GltfBuilder& b) {
         b.root["bufferViews"][extension(b)["bufferView"].get<std::size_t>()]["byteLength"] = 1 << 20;
       }},
      {"is damaged",
       [&](GltfBuilder& b) {
         b.root["bufferViews"][extension(b)["bufferView"].get<std::size_t>()]["byteLength"] = 100;
       }},
  };
  for (const Damage& damage : damages) {
    GltfBuilder b = character.Document();
    damage.apply(b);
    const std::string error = LoadError(b.Text());
    EXPECT_NE(error.find(damage.message), std::string::npos) << "expected " << damage.message << "\n"
                                                             << error;
  }

  // A few bytes that say they are a billion triangles: 5-byte numbers at the head of the connectivity
  for (DracoCharacter* from : {&character, &edges}) {
    GltfBuilder b = from->Document();
    count_all(b, 4000000000, 12000000000);
    const std::size_t head = from == &edges ? 12 : 11;
    for (std::size_t i = 0; i < 8; ++i) data(b)[head + i] = i % 4 == 3 ? 0x7f : 0xff;
    const std::string error = LoadError(b.Text());
    EXPECT_NE(error.find("far more than its data can fill"), std::string::npos) << error;
  }
  // Fewer triangles than there is room for are a note
  GltfBuilder b = character.Document();
  count_all(b, 36, 153);
  const gltf::Character c = MustLoadText(b.Text());
  EXPECT_EQ(c.meshes.at(0).primitives.at(0).triangles.size(), 150u);
  ASSERT_EQ(c.warnings.size(), 1u);
  EXPECT_NE(c.warnings[0].find("fewer triangles"), std::string::npos);
}

// Many primitives that name the same bytes; where `differ`, each says another number of indices.
GltfBuilder SharedBytes(std::size_t metadata_bytes, int primitives, bool differ) {
  DracoCharacter character(3, draco::MESH_SEQUENTIAL_ENCODING, 0, metadata_bytes);
  EXPECT_GT(character.data.size(), metadata_bytes);
  GltfBuilder b = character.Document();
  for (int i = 1; i < primitives; ++i) {
    json primitive = b.root["meshes"][0]["primitives"][0];
    if (differ) {
      json indices = b.root["accessors"][static_cast<std::size_t>(character.grid.index)];
      indices["count"] = indices["count"].get<int>() + 3 * i;
      primitive["indices"] = b.root["accessors"].size();
      b.root["accessors"].push_back(std::move(indices));
    }
    b.root["meshes"][0]["primitives"].push_back(std::move(primitive));
  }
  return b;
}

// Metadata and whatever else lies in the bytes is read anew for each primitive that asks for something else.
TEST(GltfDraco, PrimitivesThatShareMuchAreRefused) {
  EXPECT_EQ(LoadError(SharedBytes(1 << 16, 100, true).Glb()), "accepted");
  const std::string error = LoadError(SharedBytes(1 << 20, 100, true).Glb());
  EXPECT_NE(error.find("too many primitives share compressed bytes"), std::string::npos) << error;
}

// Variants of a material name one view; what it decodes to is shared.
TEST(GltfDraco, PrimitivesMayBeTheSame) {
  const gltf::Character one =
      MustLoadText(DracoCharacter(3, draco::MESH_SEQUENTIAL_ENCODING).Document().Glb());
  const gltf::Character many = MustLoadText(SharedBytes(1 << 20, 100, false).Glb());
  ASSERT_EQ(many.meshes.at(0).primitives.size(), 100u);
  const gltf::Mesh &a = one.meshes.at(0), &b = many.meshes.at(0);
  ASSERT_EQ(b.positions.size(), 100 * a.positions.size());
  for (std::size_t i = 0; i < b.positions.size(); ++i)
    ASSERT_EQ(b.positions[i], a.positions[i % a.positions.size()]) << i;
  for (std::size_t i = 0; i < 100; ++i) {
    std::vector<Index> triangles = a.primitives.at(0).triangles;
    for (Index& corner : triangles) corner += static_cast<Index>(i * a.vertex_count());
    EXPECT_EQ(b.primitives[i].triangles, triangles) << i;
  }
}

// Any outcome but a crash (run under sanitizers and valgrind, too).
TEST(GltfDraco, DamagedBytes) {
  std::mt19937 random(11);
  std::size_t refused = 0;
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    DracoCharacter character(8, method, method == draco::MESH_EDGEBREAKER_ENCODING ? 11 : 0);
    const std::vector<std::uint8_t> good = character.data;
    for (int round = 0; round < 150; ++round) {
      character.data = good;
      for (std::uint32_t flips = 1 + random() % 3; flips > 0; --flips)
        character.data[random() % (round % 2 == 0 ? good.size() : 60)] = static_cast<std::uint8_t>(random());
      if (round % 10 == 0) character.data.resize(random() % good.size());
      const Result<gltf::Character> c = LoadText(character.Document().Glb());
      refused += c.ok() ? 0 : 1;
      if (!c.ok()) continue;
      for (const Index index : c->meshes.at(0).primitives.at(0).triangles)
        ASSERT_LT(index, character.grid.vertex_count);
    }
  }
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace kpsa::engine
