#include "tests/fuzz/fuzzer.h"

#include <cstdio>
#include <utility>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

std::vector<Fuzzer>& All() {
  static std::vector<Fuzzer> all;
  return all;
}

std::set<std::string>& Milestones() {
  static std::set<std::string> reached;
  return reached;
}

}  // namespace

void Reached(const char* milestone) { Milestones().insert(milestone); }
std::set<std::string> TakeReached() { return std::exchange(Milestones(), {}); }

const std::vector<Fuzzer>& Fuzzers() { return All(); }

AddFuzzer::AddFuzzer(const char* name, void (*run)(FuzzedBytes bytes)) { All().push_back({name, run}); }

void RequireRefusal(const Status& status) {
  Require(!status.ok(), "a refusal without an error");
  Reached("refused");
  for (const Error& error : status.errors()) Require(!error.message.empty(), "an error without words");
}

std::string FuzzedFile(const std::string& name, FuzzedBytes bytes) {
  static const TemporaryFolder folder;
  const std::string path = folder / name;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) throw std::runtime_error("cannot write " + path);
  const std::size_t written = bytes.empty() ? 0 : std::fwrite(bytes.data(), 1, bytes.size(), file);
  if (std::fclose(file) != 0 || written != bytes.size()) throw std::runtime_error("cannot write " + path);
  return path;
}

}  // namespace kpsa::engine
