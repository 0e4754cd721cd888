// Damaged, outdated and foreign subspace files: refused with what is wrong (exit 3), whatever the bytes.
#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/cli/refusals.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;
const std::string kHelloFolder = KPSA_SCENES_DIR "/hello/";

class BadSubspaces : public RefusalTest {
 protected:
  static void SetUpTestSuite() {
    const TemporaryFolder trained;
    const ProcessResult run = RunKpsa({"train", kHelloFolder + "hello.yaml", "--force", "--samples", "80",
                                       "--rows", "12", "-q", "-o", trained / "h.kpsa"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    good_ = new std::string(TemporaryFolder::Read(trained / "h.kpsa"));
    ASSERT_GT(good_->size(), 1000u);
  }
  static void TearDownTestSuite() { delete good_; }
  BadSubspaces() {
    std::filesystem::copy_file(kHelloFolder + "hello.yaml", folder / "hello.yaml");
    std::filesystem::copy_file(kHelloFolder + "hello.glb", folder / "hello.glb");
  }

  static std::size_t HeaderSize() {
    std::uint64_t size = 0;
    std::memcpy(&size, good_->data(), 8);
    return size;
  }
  static json Header() { return json::parse(good_->substr(8, HeaderSize())); }
  static std::string WithHeader(const std::string& header) {
    const std::uint64_t size = header.size();
    std::string bytes(8, '\0');
    std::memcpy(bytes.data(), &size, 8);
    return bytes + header + good_->substr(8 + HeaderSize());
  }
  // Refused where a flag names it, and where the rig does: by one way after the other, since one reader reads for all.
  void ExpectBad(const std::string& bytes, const std::vector<std::string>& parts) {
    folder.Write("hello.kpsa", bytes);
    std::vector<std::string> all = parts;
    all.push_back("hello.kpsa");
    const std::vector<std::vector<std::string>> ways = {
        {"eval", "hello.yaml", "--kpsa", "hello.kpsa", "-o", "out.npz"},
        {"eval", "hello.yaml", "--accelerate", "-o", "out.npz"},
        {"bench", "hello.yaml"}};
    ExpectRefused(ways[next_way_++ % ways.size()], 3, all);
  }

  static const std::string* good_;

 private:
  std::size_t next_way_ = 0;
};
const std::string* BadSubspaces::good_ = nullptr;

TEST_F(BadSubspaces, TheGoodOneIsGood) {
  folder.Write("hello.kpsa", *good_);
  ExpectGood({"eval", "hello.yaml", "--accelerate", "-o", "out.npz"});
  ExpectGood({"inspect", "hello.kpsa"});
}

TEST_F(BadSubspaces, Containers) {
  ExpectBad("", {});
  ExpectBad("short", {});
  for (std::size_t size : {std::size_t{7}, std::size_t{8}, std::size_t{100}, HeaderSize(), good_->size() / 2,
                           good_->size() - 1}) {
    ExpectBad(good_->substr(0, size), {});
  }
  ExpectBad(*good_ + "x", {});
  ExpectBad(std::string(8, '\xff') + good_->substr(8), {});
  ExpectBad(std::string("\x00\x00\x00\x00\x00\x00\x00\x01", 8) + good_->substr(8), {});
  ExpectBad(WithHeader("{"), {});
  ExpectBad(WithHeader("[]"), {});
  ExpectBad(WithHeader(std::string(1000000, '[')), {});
}

TEST_F(BadSubspaces, Headers) {
  json header = Header();
  std::vector<std::string> names;
  for (const auto& [name, tensor] : header.items()) {
    if (name != "__metadata__") names.push_back(name);
  }
  ASSERT_GT(names.size(), 3u);
  const auto change = [&](const std::string& name, const char* key, const json& value) {
    json changed = header;
    changed[name][key] = value;
    return WithHeader(changed.dump());
  };
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    json without = header;
    without.erase(name);
    ExpectBad(WithHeader(without.dump()), {});
  }
  const std::string& name = names.front();
  const json offsets = header[name]["data_offsets"];
  ExpectBad(change(name, "data_offsets", header[names.back()]["data_offsets"]), {name});  // overlaps
  ExpectBad(change(name, "data_offsets", {offsets[0], 9007199254740993ull}), {name});
  ExpectBad(change(name, "data_offsets", {18446744073709551615ull, 8}), {name});
  ExpectBad(change(name, "data_offsets", {offsets[1], offsets[0]}), {name});
  ExpectBad(change(name, "data_offsets", "all"), {name});
  ExpectBad(change(name, "shape", {4294967296ull, 4294967296ull, 4294967296ull}), {name});
  ExpectBad(change(name, "shape", {-1}), {name});
  ExpectBad(change(name, "dtype", "F8"), {name});

  json newer = header;
  bool found = false;
  for (auto& [key, value] : newer["__metadata__"].items()) {
    if (key.find("version") == std::string::npos) continue;
    found = true;
    value = "99";
  }
  ASSERT_TRUE(found) << newer["__metadata__"].dump();
  ExpectBad(WithHeader(newer.dump()), {"version 99, this program reads versions 3 to 17"});
  for (const auto& [key, value] : header["__metadata__"].items()) {
    json other = header;
    other["__metadata__"].erase(key);
    folder.Write("hello.kpsa", WithHeader(other.dump()));
    const ProcessResult run = RunKpsa({"eval", "hello.yaml", "--accelerate", "--force", "-o", "out.npz"},
                                      kMostSeconds, folder.path());
    ExpectBounded(run);
    EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 3) << key << "\n" << run.err;
    std::filesystem::remove(folder / "out.npz");
  }
}

TEST_F(BadSubspaces, OfAnotherStateOfTheRig) {
  folder.Write("hello.kpsa", *good_);
  std::string rig = TemporaryFolder::Read(folder / "hello.yaml");
  rig.replace(rig.find("iterations: 10"), 14, "iterations: 11");
  folder.Write("hello.yaml", rig);
  ExpectRefused({"eval", "hello.yaml", "--accelerate", "-o", "out.npz"}, 3,
                {"hello.kpsa", "mush.iterations"});
  ExpectRefused({"bench", "hello.yaml"}, 3, {"hello.kpsa", "mush.iterations"});
  ExpectGood({"eval", "hello.yaml", "--accelerate", "--stale", "miss", "-o", "out.npz"});
}

TEST_F(BadSubspaces, OfAnotherRig) {
  folder.Write("hello.kpsa", *good_);
  const std::string face = KPSA_SCENES_DIR "/face/face.yaml";
  ExpectRefused({"eval", face, "--kpsa", "hello.kpsa", "-o", "out.npz"}, 3, {"hello.kpsa"});
  ExpectRefused({"bench", face, "--kpsa", "hello.kpsa"}, 3, {"hello.kpsa"});
  folder.Write("hello.kpsa", TemporaryFolder::Read(folder / "hello.glb"));
  ExpectRefused({"eval", "hello.yaml", "--accelerate", "-o", "out.npz"}, 3, {"hello.kpsa"});
}

// Any byte may flip: what still fits is played, all else is refused in one message.
TEST_F(BadSubspaces, RandomDamage) {
  constexpr int kRounds = 80;
  std::mt19937 random(11);
  std::size_t refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::string bytes = *good_;
    for (unsigned flips = 1 + random() % 3; flips > 0; --flips) {
      const std::size_t range = round % 2 == 0 ? 8 + HeaderSize() : bytes.size();
      char& byte = bytes[random() % range];
      byte = static_cast<char>(byte ^ (1 << random() % 8));
    }
    folder.Write("hello.kpsa", bytes);
    const ProcessResult run =
        RunKpsa({"eval", "hello.yaml", "--accelerate", "--frames", "0:6:3", "--force", "-o", "out.npz"},
                kMostSeconds, folder.path());
    ExpectBounded(run);
    ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 3) << round << "\n" << run.err;
    EXPECT_LE(run.error_lines(), 5u);
    if (run.exit_code == 3) {
      ++refused;
      EXPECT_NE(run.err.find("hello.kpsa"), std::string::npos) << run.err;
      EXPECT_FALSE(std::filesystem::exists(folder / "out.npz"));
    }
    std::filesystem::remove(folder / "out.npz");
  }
  EXPECT_GT(refused, static_cast<std::size_t>(kRounds) * 3 / 4);
}

}  // namespace
}  // namespace kpsa::engine
