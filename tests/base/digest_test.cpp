#include "base/digest.h"

#include <gtest/gtest.h>

#include <vector>

namespace kpsa::engine {
namespace {

std::string LongDigest(std::span<const std::uint8_t> bytes) {
  Hasher hasher;
  hasher.AddLong(bytes);
  return hasher.Finish().ToHex();
}

TEST(Digest, OfFilesStaysWhatItIs) {
  EXPECT_EQ(Hasher().Finish().ToHex(), "a482243c16dfb016066fe2d86036707d");
  Hasher text;
  text.Add(std::string_view("kpsa"));
  EXPECT_EQ(text.Finish().ToHex(), "a4c3aaec74e0e3a13e593f4a75547712");
  std::vector<std::uint8_t> bytes(100);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  EXPECT_EQ(LongDigest(std::span(bytes).first(0)), "78ee130cf10ab116ea4cf8a3bb43cc50");
  EXPECT_EQ(LongDigest(bytes), "082ef2331954796fa3a76cba6a73e73f");
}

TEST(Digest, OfManyBytesSeesEachBitAndTheLength) {
  for (const std::size_t size : {1u, 8u, 31u, 32u, 33u, 64u, 100u, 257u}) {
    std::vector<std::uint8_t> bytes(size);
    const std::string of_zeros = LongDigest(bytes);
    for (std::size_t bit = 0; bit < 8 * size; ++bit) {
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      EXPECT_NE(LongDigest(bytes), of_zeros) << size << " " << bit;
      bytes[bit / 8] = 0;
    }
    bytes.push_back(0);
    EXPECT_NE(LongDigest(bytes), of_zeros) << size;
  }
}

// A lane takes its words in their order, and words belong to a lane.
TEST(Digest, OfManyBytesSeesTheirOrder) {
  std::vector<std::uint64_t> words(16);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = i;
  const auto digest = [&] {
    Hasher hasher;
    hasher.AddLong(std::span<const std::uint64_t>(words));
    return hasher.Finish().ToHex();
  };
  const std::string as_it_is = digest();
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      std::swap(words[i], words[k]);
      EXPECT_NE(digest(), as_it_is) << i << " " << k;
      std::swap(words[i], words[k]);
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
