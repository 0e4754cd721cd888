#include "files/npz.h"

#include <gtest/gtest.h>
#include <zip.h>

#include <random>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// An archive with one member of these bytes.
std::string WriteZip(const std::string& path, const std::string& member, const std::string& bytes,
                     int method) {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
  const zip_int64_t index = zip_file_add(archive, member.c_str(), source, 0);
  zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), method, 0);
  EXPECT_EQ(zip_close(archive), 0);
  return path;
}

std::string Npy(const std::string& dictionary, const std::string& content) {
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(dictionary.size()) + '\0' + dictionary +
         content;
}

TEST(Npz, RoundTrip) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.npz";
  {
    Result<NpzWriter> writer = NpzWriter::Create(path, false);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->Add("times", {2}, std::vector<double>{0.25, 1e300}).ok());
    // Two arrays, filled in turns
    const auto a = writer->Declare("body/0", NpzType::kFloat32, {2, 1, 3});
    const auto b = writer->Declare("M\xc3\xbcnd#3/1", NpzType::kFloat32, {2, 2, 3});
    ASSERT_TRUE(a.ok() && b.ok());
    for (int t = 0; t < 2; ++t) {
      const float f = static_cast<float>(t);
      ASSERT_TRUE(writer->Append(*a, std::vector<float>{f, f + 0.5f, -f}).ok());
      ASSERT_TRUE(writer->Append(*b, std::vector<float>(6, f)).ok());
    }
    ASSERT_TRUE(writer->Add("empty", {0, 3}, std::vector<float>{}).ok());
    EXPECT_FALSE(writer->Declare("times", NpzType::kFloat32, {1}).ok());
    EXPECT_FALSE(writer->Declare("", NpzType::kFloat32, {1}).ok());
    EXPECT_FALSE(writer->Declare(std::string("a\0b", 3), NpzType::kFloat32, {1}).ok());
    EXPECT_FALSE(
        writer->Declare("huge", NpzType::kFloat32, {std::uint64_t{1} << 40, std::uint64_t{1} << 40}).ok());
    ASSERT_TRUE(writer->Finish().ok());
  }
  EXPECT_EQ(folder.FileCount(), 1u);
  const Result<Npz> read = ReadNpz(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  ASSERT_EQ(read->arrays.size(), 4u);
  EXPECT_EQ(read->arrays[0].name, "times");
  EXPECT_EQ(read->arrays[0].Doubles(), (std::vector<double>{0.25, 1e300}));
  const NpzArray* a = read->Find("body/0");
  ASSERT_NE(a, nullptr);
  EXPECT_EQ(a->shape, (std::vector<std::uint64_t>{2, 1, 3}));
  EXPECT_EQ(a->Floats(), (std::vector<float>{0, 0.5, 0, 1, 1.5, -1}));
  ASSERT_NE(read->Find("M\xc3\xbcnd#3/1"), nullptr);
  EXPECT_EQ(read->Find("empty")->shape, (std::vector<std::uint64_t>{0, 3}));
  EXPECT_EQ(read->Find("nothing"), nullptr);
}

TEST(Npz, SameArraysSameBytesAndStored) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name) {
    Result<NpzWriter> writer = NpzWriter::Create(folder / name, false);
    EXPECT_TRUE(writer->Add("x", {3}, std::vector<float>{1, 2, 3}).ok());
    EXPECT_TRUE(writer->Finish().ok());
    return TemporaryFolder::Read(folder / name);
  };
  const std::string first = write("a.npz"), second = write("b.npz");
  EXPECT_EQ(first, second);
  const std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }";
  const std::size_t at = first.find(header);
  ASSERT_NE(at, std::string::npos);  // stored, not deflated
  EXPECT_EQ(first.substr(at - 10, 6), "\x93NUMPY");
  EXPECT_EQ(static_cast<int>(first[at - 2]) + 10, 128);  // header and prefix: a multiple of 64
  EXPECT_EQ(first.substr(at - 10 + 128, 4), std::string("\0\0\x80\x3f", 4));
}

TEST(Npz, LargeArraysGoThroughTheDisk) {
  const TemporaryFolder folder;
  constexpr std::size_t kRows = 1000, kColumns = 20000;  // 80 MB
  Result<NpzWriter> writer = NpzWriter::Create(folder / "a.npz", false);
  ASSERT_TRUE(writer.ok());
  const auto id = writer->Declare("big", NpzType::kFloat32, {kRows, kColumns});
  ASSERT_TRUE(id.ok());
  std::vector<float> row(kColumns);
  for (std::size_t r = 0; r < kRows; ++r) {
    row[7] = static_cast<float>(r);
    ASSERT_TRUE(writer->Append(*id, row).ok());
  }
  ASSERT_TRUE(writer->Finish().ok());
  EXPECT_EQ(folder.FileCount(), 1u);
  const Result<Npz> read = ReadNpz(folder / "a.npz");
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  const std::vector<float> values = read->arrays[0].Floats();
  ASSERT_EQ(values.size(), kRows * kColumns);
  for (std::size_t r = 0; r < kRows; ++r) ASSERT_EQ(values[r * kColumns + 7], static_cast<float>(r));
  EXPECT_NE(ReadNpz(folder / "a.npz", 1000).status().ToString().find("claims"), std::string::npos);
}

TEST(Npz, NothingIsLeftWithoutFinish) {
  const TemporaryFolder folder;
  {
    Result<NpzWriter> writer = NpzWriter::Create(folder / "a.npz", false);
    ASSERT_TRUE(writer->Add("x", {1}, std::vector<float>{1}).ok());
  }
  EXPECT_EQ(folder.FileCount(), 0u);
  folder.Write("a.npz", "here first");
  EXPECT_FALSE(NpzWriter::Create(folder / "a.npz", false).ok());
  EXPECT_FALSE(NpzWriter::Create(folder / "none/a.npz", false).ok());
}

TEST(Npz, ReadsOtherTypesAndDeflatedMembers) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& dictionary, const std::string& content) {
    const Result<Npz> npz =
        ReadNpz(WriteZip(folder / "t.npz", "x.npy", Npy(dictionary, content), ZIP_CM_DEFLATE));
    EXPECT_TRUE(npz.ok()) << npz.status().ToString();
    return npz.ok() && !npz->arrays.empty() ? npz->arrays[0].Doubles() : std::vector<double>();
  };
  const std::string tail = ", 'fortran_order': False, 'shape': (2,), }\n";
  EXPECT_EQ(read("{'descr': '<i2'" + tail, std::string("\x01\x00\xff\xff", 4)), (std::vector<double>{1, -1}));
  EXPECT_EQ(read("{'descr': '>i2'" + tail, std::string("\x00\x01\xff\xfe", 4)), (std::vector<double>{1, -2}));
  EXPECT_EQ(read("{'descr': '|b1'" + tail, std::string("\x01\x00", 2)), (std::vector<double>{1, 0}));
  EXPECT_EQ(read("{'descr': '|u1'" + tail, std::string("\xff\x00", 2)), (std::vector<double>{255, 0}));
  EXPECT_EQ(
      read("{'descr': '<u8', 'fortran_order': False, 'shape': (), }", std::string("\x05\0\0\0\0\0\0\0", 8)),
      (std::vector<double>{5}));
}

TEST(Npz, RefusesDamage) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& npy, int method = ZIP_CM_STORE) {
    return ReadNpz(WriteZip(folder / "t.npz", "x.npy", npy, method)).status().ToString();
  };
  const std::string shape3 = ", 'fortran_order': False, 'shape': (3,), }";
  EXPECT_NE(error("not an array").find("is no .npy array"), std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4'" + shape3, "12345678901")).find("holds 11 bytes"), std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '|O'" + shape3, "123456789012")).find("has the type"), std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<c8'" + shape3, "123456789012")).find("has the type"), std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4', 'fortran_order': True, 'shape': (1,1)}", "1234")).find("Fortran"),
            std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999,)}", ""))
                .find("too large"),
            std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296,4294967296)}", ""))
                .find("holds 0"),
            std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4', 'shape': (-1,)}", "")).find("shape cannot be read"),
            std::string::npos);
  EXPECT_NE(error(Npy("{'descr': '<f4'}", "")).find("no shape"), std::string::npos);
  EXPECT_NE(error(std::string("\x93NUMPY\x01\x00\xff\xff{", 11)).find("truncated"), std::string::npos);
  EXPECT_NE(ReadNpz(folder / "none.npz").status().ToString().find("No such file"), std::string::npos);
  EXPECT_FALSE(ReadNpz(folder.Write("text.npz", "just text")).ok());
}

TEST(Npz, RandomDamageNeverCrashes) {
  const TemporaryFolder folder;
  const std::string npy =
      Npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n", std::string(24, 'x'));
  std::mt19937 random(7);
  int refused = 0;
  for (const int method : {ZIP_CM_STORE, ZIP_CM_DEFLATE}) {
    const std::string good = TemporaryFolder::Read(WriteZip(folder / "g.npz", "x.npy", npy, method));
    for (int round = 0; round < 500; ++round) {
      std::string bytes = good;
      for (std::uint32_t edits = 1 + random() % 3; edits > 0; --edits)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      if (random() % 5 == 0) bytes.resize(random() % bytes.size());
      refused += !ReadNpz(folder.Write("d.npz", bytes)).ok();
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace kpsa::engine
