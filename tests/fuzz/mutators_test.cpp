// Mutators that know a format keep it readable while they change what is in it.
#include <gtest/gtest.h>

#include <random>

#include "files/safetensors.h"
#include "gltf/import.h"
#include "tests/fuzz/mutators/bytes.h"
#include "tests/support/gltf_builder.h"

namespace kpsa::engine {
namespace {

FuzzBytes BytesOf(const std::string& text) { return FuzzBytes(text.begin(), text.end()); }

TEST(FuzzMutators, AGlbStaysOneWhenItsChunksChange) {
  const FuzzBytes glb = BytesOf(GltfBuilder::Character().Glb());
  int changed_json = 0, changed_binary = 0;
  const auto change = [&](FuzzBytes* bytes, std::size_t most) {
    if (bytes->front() == '{') {
      ++changed_json;
      bytes->insert(bytes->end() - 1, ' ');  // within the object
    } else {
      ++changed_binary;
      bytes->push_back(7);
    }
    EXPECT_LE(bytes->size(), most);
  };
  for (std::uint32_t random = 1; random < 16 * 8; ++random) {
    if (random % 16 == 0) continue;
    const FuzzBytes mutated = MutateGlb(glb, 1 << 16, random, change);
    EXPECT_NE(mutated, glb);
    const auto read = gltf::LoadGltfFromMemory(mutated, "", "mutated.glb");
    EXPECT_TRUE(read.ok()) << read.status().ToString();
  }
  EXPECT_GT(changed_json, 20);
  EXPECT_GT(changed_binary, 20);
}

TEST(FuzzMutators, TensorsStayWhereTheyAre) {
  SafetensorsWriter writer;
  writer.SetMetadata("kind", "test");
  writer.Add<float>("a", {3}, std::vector<float>{1, 2, 3});
  writer.Add<std::uint8_t>("b", {2, 1}, std::vector<std::uint8_t>{4, 5});
  const std::vector<std::byte> serialized = writer.Serialize();
  const auto* begin = reinterpret_cast<const std::uint8_t*>(serialized.data());
  const FuzzBytes file(begin, begin + serialized.size());
  int other = 0;
  for (std::uint32_t random = 6; random < 16 * 8; ++random) {
    if (random % 16 < 6) continue;
    const FuzzBytes mutated = MutateTensors(file, 1 << 16, random, [](FuzzBytes* bytes, std::size_t) {
      for (std::uint8_t& byte : *bytes) byte ^= 1;
    });
    const auto* bytes = reinterpret_cast<const std::byte*>(mutated.data());
    const auto read = SafetensorsFile::Parse({bytes, bytes + mutated.size()}, "mutated");
    ASSERT_TRUE(read.ok()) << read.status().ToString();
    EXPECT_EQ(read->tensors().size(), 2u);
    other += mutated != file;
  }
  EXPECT_GT(other, 40);
  // A header of another length is told as that
  const FuzzBytes longer =
      MutateTensors(file, 1 << 16, 1, [](FuzzBytes* bytes, std::size_t) { bytes->push_back(' '); });
  EXPECT_EQ(longer.size(), file.size() + 1);
  const auto* bytes = reinterpret_cast<const std::byte*>(longer.data());
  EXPECT_TRUE(SafetensorsFile::Parse({bytes, bytes + longer.size()}, "longer").ok());
}

TEST(FuzzMutators, BytesThatAreNoneOfTheseAreChangedAsBytes) {
  std::mt19937 random(1);
  for (std::size_t size = 0; size < 100; ++size) {
    FuzzBytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    for (const auto mutate : {&MutateGlb, &MutateTensors}) {
      const FuzzBytes mutated = mutate(bytes, 200, static_cast<std::uint32_t>(random()),
                                       [](FuzzBytes* all, std::size_t) { all->push_back(1); });
      EXPECT_EQ(mutated.size(), size + 1);
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
