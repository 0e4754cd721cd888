#include "files/safetensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

namespace kpsa::engine {
namespace {

std::vector<std::byte> FileOf(const std::string& header, std::size_t data_size,
                              std::uint64_t claimed = ~std::uint64_t{0}) {
  const std::uint64_t size = claimed == ~std::uint64_t{0} ? header.size() : claimed;
  std::vector<std::byte> bytes(8 + header.size() + data_size);
  std::memcpy(bytes.data(), &size, 8);
  std::memcpy(bytes.data() + 8, header.data(), header.size());
  return bytes;
}

SafetensorsWriter Sample() {
  SafetensorsWriter writer;
  writer.SetMetadata("greeting", "h\xc3\xa4llo \"quoted\"");
  const float floats[] = {1.5f, -2.0f, 0.25f, 3.0f, 4.0f, 5.0f};
  const double doubles[] = {1e300};
  const std::uint8_t bytes[] = {1, 2, 3};
  const std::uint16_t halfs[] = {0x3c00};
  writer.Add<float>("floats", {2, 3}, floats);
  writer.Add<double>("doubles", {}, doubles);
  writer.Add<std::uint8_t>("bytes", {3}, bytes);
  writer.Add<std::uint16_t>("halfs", {1}, halfs, true);
  writer.Add<float>("empty", {0, 3}, {});
  return writer;
}

TEST(Safetensors, RoundTrip) {
  const auto file = SafetensorsFile::Parse(Sample().Serialize(), "sample");
  ASSERT_TRUE(file.ok()) << file.status().ToString();
  EXPECT_EQ(*file->Metadata("greeting"), "h\xc3\xa4llo \"quoted\"");
  EXPECT_EQ(*file->Values<float>("floats", {2, 3}),
            (std::vector<float>{1.5f, -2.0f, 0.25f, 3.0f, 4.0f, 5.0f}));
  EXPECT_EQ(*file->Values<double>("doubles", {}), std::vector<double>{1e300});
  EXPECT_EQ(*file->Values<std::uint8_t>("bytes", {SafetensorsFile::kAnySize}),
            (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_EQ(*file->Values<std::uint16_t>("halfs", {1}, true), std::vector<std::uint16_t>{0x3c00});
  EXPECT_TRUE(file->Values<float>("empty", {0, 3})->empty());
}

TEST(Safetensors, DataAreAlignedInTheFile) {
  const std::vector<std::byte> bytes = Sample().Serialize();
  std::uint64_t header;
  std::memcpy(&header, bytes.data(), 8);
  EXPECT_EQ((header + 8) % 64, 0u);
}

TEST(Safetensors, WrongTypeShapeOrNameNamesBoth) {
  const auto file = SafetensorsFile::Parse(Sample().Serialize(), "sample");
  ASSERT_TRUE(file.ok());
  EXPECT_NE(file->Values<double>("floats", {2, 3}).status().ToString().find("is F32 [2, 3], expected F64"),
            std::string::npos);
  EXPECT_NE(file->Values<float>("floats", {3, 2}).status().ToString().find("expected F32 [3, 2]"),
            std::string::npos);
  EXPECT_NE(file->Values<float>("float", {2, 3}).status().ToString().find("did you mean \"floats\""),
            std::string::npos);
  EXPECT_NE(file->Metadata("greetin").status().ToString().find("did you mean \"greeting\""),
            std::string::npos);
}

TEST(Safetensors, NotFiniteNumbersAreRefused) {
  SafetensorsWriter writer;
  const float bad[] = {1, std::nanf("")};
  const double worse[] = {INFINITY};
  const std::uint16_t half[] = {0x7c00};
  writer.Add<float>("f", {2}, bad);
  writer.Add<double>("d", {1}, worse);
  writer.Add<std::uint16_t>("h", {1}, half, true);
  const auto file = SafetensorsFile::Parse(writer.Serialize(), "bad");
  ASSERT_TRUE(file.ok());
  EXPECT_FALSE(file->Values<float>("f", {2}).ok());
  EXPECT_FALSE(file->Values<double>("d", {1}).ok());
  EXPECT_FALSE(file->Values<std::uint16_t>("h", {1}, true).ok());
}

TEST(Safetensors, EveryKindOfDamageHasOneMessage) {
  struct Case {
    const char* what;
    std::vector<std::byte> bytes;
    const char* expected;
  };
  const auto one = [](const std::string& entry, std::size_t data) {
    return FileOf("{\"a\":" + entry + "}", data);
  };
  const std::vector<Case> cases = {
      {"empty", {}, "too few"},
      {"header beyond the file", FileOf("{}", 0, 1000), "the header claims 1000"},
      {"huge header", FileOf("{}", 0, 0xffffffffffffffffull - 1), "the header claims"},
      {"not JSON", FileOf("{\"a\":", 0), "not a JSON object"},
      {"a list", FileOf("[]", 0), "not a JSON object"},
      {"twice",
       FileOf(
           R"({"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]},"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]}})",
           1),
       "twice"},
      {"too deep", FileOf("{\"a\":[[[[[[[[1]]]]]]]]}", 0), "nested deeper"},
      {"metadata not strings", FileOf("{\"__metadata__\":{\"a\":1}}", 0), "is not a string"},
      {"no shape", one(R"({"dtype":"U8","data_offsets":[0,1]})", 1), "expected an object with"},
      {"unknown type", one(R"({"dtype":"Q8","shape":[1],"data_offsets":[0,1]})", 1), "unknown dtype \"Q8\""},
      {"negative size", one(R"({"dtype":"U8","shape":[-1],"data_offsets":[0,1]})", 1), "whole number"},
      {"fraction", one(R"({"dtype":"U8","shape":[1.5],"data_offsets":[0,1]})", 1), "whole number"},
      {"overflow", one(R"({"dtype":"F64","shape":[4294967296,4294967296],"data_offsets":[0,0]})", 0),
       "overflows"},
      {"offsets reversed", one(R"({"dtype":"U8","shape":[1],"data_offsets":[1,0]})", 1),
       "lies at bytes 1 to 0"},
      {"beyond the end", one(R"({"dtype":"U8","shape":[5],"data_offsets":[0,5]})", 1),
       "lies at bytes 0 to 5 of 1: the file is cut short"},
      {"size differs from shape", one(R"({"dtype":"F32","shape":[1],"data_offsets":[0,3]})", 3),
       "needs 4 bytes, it has 3"},
      {"bytes left over", one(R"({"dtype":"U8","shape":[1],"data_offsets":[0,1]})", 2), "account for 1"},
      {"hole", one(R"({"dtype":"U8","shape":[1],"data_offsets":[1,2]})", 2), "overlap or leave a hole"},
      {"overlap",
       FileOf(
           R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},"b":{"dtype":"U8","shape":[2],"data_offsets":[1,3]}})",
           3),
       "overlap or leave a hole"},
  };
  for (const Case& c : cases) {
    const auto file = SafetensorsFile::Parse(c.bytes, "x.kpsa");
    ASSERT_FALSE(file.ok()) << c.what;
    ASSERT_EQ(file.status().errors().size(), 1u) << c.what;
    EXPECT_NE(file.status().ToString().find(c.expected), std::string::npos)
        << c.what << ": " << file.status().ToString();
    EXPECT_EQ(file.status().ToString().find("x.kpsa"), 0u) << c.what;
  }
}

TEST(Safetensors, FlippedBytesNeverCrash) {
  const std::vector<std::byte> good = Sample().Serialize();
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::byte> bytes = good;
    bytes[random() % bytes.size()] ^= static_cast<std::byte>(1 + random() % 255);
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    refused += !SafetensorsFile::Parse(std::move(bytes), "x").ok();
  }
  EXPECT_GT(refused, 1000);
}

TEST(Safetensors, WritingReplacesWholeFilesOnly) {
  const std::string path = testing::TempDir() + "kpsa_safetensors_test.kpsa";
  ASSERT_TRUE(Sample().Write(path).ok());
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  const auto file = SafetensorsFile::Read(path);
  ASSERT_TRUE(file.ok()) << file.status().ToString();
  EXPECT_EQ(file->tensors().size(), 5u);
  std::filesystem::remove(path);
  EXPECT_NE(SafetensorsFile::Read(path).status().ToString().find("no such file"), std::string::npos);
  EXPECT_FALSE(Sample().Write("/nowhere/at/all.kpsa").ok());
}

}  // namespace
}  // namespace kpsa::engine
