// A fuzzer is a function of bytes. With KPSA_FUZZ each is a program of libFuzzer's (clang); in the ordinary build all of
// them are in test_fuzz, which runs them over the corpora.
//
//   KPSA_FUZZER(frames) { ... bytes ...; Require(fine, "what should be"); }    // fuzzers/frames_fuzzer.cpp
//
// Any bytes are fine for it: what it must not do is to crash, to read beyond memory, to throw, to take longer or more
// memory than run.sh allows, or to break a Require.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

using FuzzedBytes = std::span<const std::uint8_t>;

struct Fuzzer {
  const char* name;  // of its corpus, too
  void (*run)(FuzzedBytes bytes);
};
// Those of this program.
const std::vector<Fuzzer>& Fuzzers();

struct AddFuzzer {
  AddFuzzer(const char* name, void (*run)(FuzzedBytes bytes));
};
#define KPSA_FUZZER(name)                                                        \
  static void Fuzz_##name(::kpsa::engine::FuzzedBytes bytes);                    \
  static const ::kpsa::engine::AddFuzzer add_fuzzer_##name(#name, &Fuzz_##name); \
  static void Fuzz_##name([[maybe_unused]] ::kpsa::engine::FuzzedBytes bytes)

// Thrown where a check fails; nobody in a fuzzer catches it.
struct FuzzFinding : std::runtime_error {
  using std::runtime_error::runtime_error;
};
inline void Require(bool fine, std::string_view what) {
  if (!fine) throw FuzzFinding(std::string(what));
}
// A refusal says what is wrong.
void RequireRefusal(const Status& status);

// Told by fuzzers, so that a test sees what a corpus reaches. Each name once.
void Reached(const char* milestone);
std::set<std::string> TakeReached();

// A file with these bytes in a folder of the program's own; its path. The same name is written over.
std::string FuzzedFile(const std::string& name, FuzzedBytes bytes);
inline FuzzedBytes AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
inline std::string AsText(FuzzedBytes bytes) { return std::string(bytes.begin(), bytes.end()); }

}  // namespace kpsa::engine
