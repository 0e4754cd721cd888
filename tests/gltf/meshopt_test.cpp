// EXT_meshopt_compression: documents that are compressed here, by meshoptimizer's encoders.
#include <meshoptimizer.h>

#include <functional>

#include "tests/gltf/meshopt_character.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

TEST(GltfMeshopt, EveryViewWithoutLoss) {
  const GridCharacter grid(20);
  const gltf::Character plain = MustLoadText(grid.builder.Text());
  Compressed sequence = CompressAll(grid, false);
  ExpectSame(MustLoadText(sequence.Text()), plain);
  ExpectSame(MustLoadText(sequence.Glb()), plain);
  // Triangles come out with their corners turned
  const gltf::Character got = MustLoadText(CompressAll(grid, true).Text());
  const std::vector<Index>&a = got.meshes.at(0).primitives.at(0).triangles,
        &b = plain.meshes.at(0).primitives.at(0).triangles;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t t = 0; t < a.size(); t += 3) {
    std::size_t turn = 0;
    while (turn < 3 && a[t + turn] != b[t]) ++turn;
    ASSERT_LT(turn, 3u);
    EXPECT_EQ(a[t + (turn + 1) % 3], b[t + 1]);
    EXPECT_EQ(a[t + (turn + 2) % 3], b[t + 2]);
  }
}

TEST(GltfMeshopt, IndicesOfFourBytesAndAFileThatFallsBack) {
  GridCharacter grid(6);
  const gltf::Character plain = MustLoadText(grid.builder.Text());
  const std::vector<unsigned> indices(grid.indices.begin(), grid.indices.end());
  grid.Primitive()["indices"] = grid.builder.Accessor(indices, "SCALAR");
  Compressed compressed(grid.builder);
  compressed.Put(grid.Primitive()["indices"], "INDICES", nullptr, indices.size(), 4,
                 EncodeIndices(indices, grid.vertex_count, false));
  compressed.out.root.erase("extensionsRequired");
  // Views that are not compressed stay in a buffer of their own
  const std::string plain_text = grid.builder.Base64();
  const auto text = [&](const std::string& uri) {
    json root = json::parse(compressed.Text());
    root["buffers"].push_back(
        {{"byteLength", grid.builder.buffer.size()}, {"uri", "data:;base64," + plain_text}});
    root["buffers"][1]["uri"] = uri;
    for (json& view : root["bufferViews"]) {
      if (!view.contains("extensions")) view["buffer"] = 2;
    }
    return root.dump();
  };
  ExpectSame(MustLoadText(text("not-there.bin")), plain);  // nobody reads a fallback
}

TEST(GltfMeshopt, QuantizedVertices) {
  GridCharacter grid(20);
  const gltf::Character plain = MustLoadText(grid.builder.Text());
  GltfBuilder& b = grid.builder;
  // As gltfpack writes them: 16 bits in 8 bytes, weights in bytes; the node's scale undoes the grid
  std::vector<std::int16_t> positions;
  std::vector<std::int8_t> deltas;
  std::vector<std::uint8_t> weights;
  for (std::size_t i = 0; i < grid.positions.size(); ++i) {
    positions.push_back(static_cast<std::int16_t>(std::lround(grid.positions[i] / 32 * 32767)));
    deltas.push_back(static_cast<std::int8_t>(std::lround(grid.deltas[i] * 127)));
    if (i % 3 == 2) positions.push_back(0), deltas.push_back(0);
  }
  for (const float w : grid.weights) weights.push_back(static_cast<std::uint8_t>(std::lround(w * 255)));
  const auto accessor = [&](int view, int type, std::size_t width) {
    return b.Push("accessors", {{"bufferView", view},
                                {"componentType", type},
                                {"normalized", true},
                                {"type", width == 3 ? "VEC3" : "VEC4"},
                                {"count", grid.vertex_count}});
  };
  const int p = accessor(b.View(positions, 8), 5122, 3), d = accessor(b.View(deltas, 4), 5120, 3),
            w = accessor(b.View(weights, 4), 5121, 4);
  grid.Primitive()["attributes"]["POSITION"] = p;
  grid.Primitive()["attributes"]["WEIGHTS_0"] = w;
  grid.Primitive()["targets"][0]["POSITION"] = d;
  Compressed compressed = CompressAll(grid, false);
  compressed.PutAttributes(p, 8);
  compressed.PutAttributes(d, 4);
  compressed.PutAttributes(w, 4);
  gltf::Mesh got = MustLoadText(compressed.Text()).meshes.at(0);
  for (float& x : got.positions) x *= 32;
  ExpectNear(got.positions, plain.meshes[0].positions, 32 / 65534.0 + 1e-6);
  ExpectNear(got.targets.at(0).deltas, plain.meshes[0].targets[0].deltas, 1 / 254.0 + 1e-6);
  ASSERT_EQ(got.influences.size(), plain.meshes[0].influences.size());
  for (std::size_t i = 0; i < got.influences.size(); ++i)
    EXPECT_NEAR(got.influences[i].weight, plain.meshes[0].influences[i].weight, 0.005) << i;
}

TEST(GltfMeshopt, Filters) {
  GridCharacter grid(9);
  GltfBuilder& b = grid.builder;
  const std::size_t n = grid.vertex_count;
  Compressed compressed = CompressAll(grid, false);
  // Floats with 15 bits and a common exponent, and with all bits
  std::vector<float> encoded(grid.positions.size());
  meshopt_encodeFilterExp(encoded.data(), n, 12, 15, grid.positions.data());
  compressed.Put(grid.position, "ATTRIBUTES", "EXPONENTIAL", n, 12, EncodeAttributes(encoded.data(), n, 12));
  std::vector<float> times(grid.times.size());
  meshopt_encodeFilterExp(times.data(), times.size(), 4, 24, grid.times.data());
  compressed.Put(grid.time, "ATTRIBUTES", "EXPONENTIAL", times.size(), 4,
                 EncodeAttributes(times.data(), times.size(), 4));
  // Rotations as 16-bit numbers
  std::vector<std::int16_t> turns(grid.turns.size());
  const std::size_t keys = grid.times.size();
  meshopt_encodeFilterQuat(turns.data(), keys, 8, 16, grid.turns.data());
  json& turn = compressed.out.root["accessors"][static_cast<std::size_t>(grid.turn)];
  turn["componentType"] = 5122;
  turn["normalized"] = true;
  compressed.Put(grid.turn, "ATTRIBUTES", "QUATERNION", keys, 8, EncodeAttributes(turns.data(), keys, 8));
  const gltf::Character got = MustLoadText(compressed.Text());
  ExpectNear(got.meshes.at(0).positions, grid.positions, 8 / 16384.0);
  const gltf::Channel& channel = got.clips.at(0).channels.at(0);
  EXPECT_EQ(channel.times, std::vector<double>(grid.times.begin(), grid.times.end()));
  for (std::size_t k = 0; k < keys; ++k) {  // q and -q are one turn
    double dot = 0;
    for (std::size_t c = 0; c < 4; ++c) dot += channel.values[4 * k + c] * grid.turns[4 * k + c];
    EXPECT_NEAR(std::fabs(dot), 1, 1e-4) << k;
  }

  // Unit vectors, where positions can be seen
  std::vector<float> normals;
  for (std::size_t i = 0; i < n; ++i) {
    const float *v = &grid.deltas[3 * i], length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    normals.insert(normals.end(), {v[0] / length, v[1] / length, v[2] / length, 0});
  }
  for (const int bits : {8, 16}) {
    const std::size_t stride = bits == 8 ? 4 : 8;
    std::vector<std::uint8_t> packed(n * stride);
    meshopt_encodeFilterOct(packed.data(), n, stride, bits, normals.data());
    json& position = compressed.out.root["accessors"][static_cast<std::size_t>(grid.position)];
    position["componentType"] = bits == 8 ? 5120 : 5122;
    position["normalized"] = true;
    compressed.View(grid.position)["byteStride"] = stride;
    compressed.Put(grid.position, "ATTRIBUTES", "OCTAHEDRAL", n, stride,
                   EncodeAttributes(packed.data(), n, stride));
    const gltf::Character units = MustLoadText(compressed.Text());
    ASSERT_EQ(units.meshes.at(0).positions.size(), 3 * n);
    for (std::size_t i = 0; i < 3 * n; ++i)
      EXPECT_NEAR(units.meshes[0].positions[i], normals[i / 3 * 4 + i % 3], bits == 8 ? 0.02 : 1e-4) << i;
  }
  EXPECT_FALSE(b.root.contains("buffers"));
}

TEST(GltfMeshopt, WhatTheExtensionForbids) {
  const GridCharacter grid(6);
  const Compressed good = CompressAll(grid, true);
  struct Damage {
    const char* message;
    std::function<void(Compressed&)> apply;
  };
  const std::vector<Damage> damages = {
      {"mode is \"SHAPES\"", [&](Compressed& c) { c.Extension(grid.position)["mode"] = "SHAPES"; }},
      {"mode is missing", [&](Compressed& c) { c.Extension(grid.position).erase("mode"); }},
      {"filter is \"MAGIC\"", [&](Compressed& c) { c.Extension(grid.position)["filter"] = "MAGIC"; }},
      {"goes with mode ATTRIBUTES only",
       [&](Compressed& c) { c.Extension(grid.index)["filter"] = "EXPONENTIAL"; }},
      {"byteStride is 12, expected 4 or 8",
       [&](Compressed& c) { c.Extension(grid.position)["filter"] = "OCTAHEDRAL"; }},
      {"byteStride is 12, expected 8",
       [&](Compressed& c) { c.Extension(grid.position)["filter"] = "QUATERNION"; }},
      {"byteStride is 9007199254740992",
       [&](Compressed& c) { c.Extension(grid.position)["byteStride"] = 9007199254740992; }},
      {"buffer is 7", [&](Compressed& c) { c.Extension(grid.position)["buffer"] = 7; }},
      {"the view has 432 bytes", [&](Compressed& c) { c.Extension(grid.position)["count"] = 35; }},
      {"cannot come from",
       [&](Compressed& c) {
         c.Extension(grid.position)["count"] = 4000000;
         c.View(grid.position)["byteLength"] = 48000000;
       }},
      {"far more than the file's own",
       [&](Compressed& c) {
         c.Extension(grid.position)["count"] = 700000000000;
         c.View(grid.position)["byteLength"] = 8400000000000;
       }},
      {"expected three for each triangle",
       [&](Compressed& c) {
         c.Extension(grid.index)["count"] = 149;
         c.View(grid.index)["byteLength"] = 298;
       }},
      {"expected 2 or 4",
       [&](Compressed& c) {
         c.Extension(grid.index)["byteStride"] = 1;
         c.View(grid.index)["byteLength"] = 150;
       }},
      {"the view's is 16", [&](Compressed& c) { c.View(grid.position)["byteStride"] = 16; }},
      {"the compressed bytes end at",
       [&](Compressed& c) { c.Extension(grid.position)["byteLength"] = 1000000; }},
      {"the compressed bytes end at",
       [&](Compressed& c) { c.Extension(grid.position)["byteOffset"] = 9007199254740992; }},
      {"the compressed bytes are damaged",
       [&](Compressed& c) { c.Extension(grid.position)["byteLength"] = 40; }},
      {"the compressed bytes are damaged",
       [&](Compressed& c) { c.Extension(grid.index)["mode"] = "INDICES"; }},
      {"cannot come from 0", [&](Compressed& c) { c.Extension(grid.position)["byteLength"] = 0; }},
      {"has no data", [&](Compressed& c) { c.View(grid.position).erase("extensions"); }},
  };
  for (const Damage& damage : damages) {
    Compressed bad = good;
    damage.apply(bad);
    const std::string error = LoadError(bad.Text());
    EXPECT_NE(error.find(damage.message), std::string::npos) << "expected " << damage.message << "\n"
                                                             << error;
  }
}

// Any outcome but a crash (run under sanitizers, too).
TEST(GltfMeshopt, DamagedBytes) {
  const GridCharacter grid(8);
  Compressed compressed = CompressAll(grid, true);
  const std::vector<std::uint8_t> good = compressed.out.buffer;
  std::mt19937 random(5);
  std::size_t refused = 0;
  for (int round = 0; round < 200; ++round) {
    compressed.out.buffer = good;
    for (std::uint32_t flips = 1 + random() % 3; flips > 0; --flips)
      compressed.out.buffer[random() % good.size()] = static_cast<std::uint8_t>(random());
    const Result<gltf::Character> c = LoadText(compressed.Glb());
    refused += c.ok() ? 0 : 1;
    if (!c.ok()) continue;
    for (const Index index : c->meshes.at(0).primitives.at(0).triangles) ASSERT_LT(index, grid.vertex_count);
  }
  EXPECT_GT(refused, 20u);
}

}  // namespace
}  // namespace kpsa::engine
