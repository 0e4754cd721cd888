#include <cstring>

#include "tests/fuzz/mutators/bytes.h"

namespace kpsa::engine {
namespace {

constexpr std::uint32_t kMagic = 0x46546c67, kJson = 0x4e4f534a, kBinary = 0x004e4942;
constexpr std::size_t kHeaders = 12 + 8 + 8;

}  // namespace

FuzzBytes MutateGlb(const FuzzBytes& glb, std::size_t most, std::uint32_t random, const ChangeBytes& change) {
  const std::uint64_t json_size = glb.size() >= 20 ? U32At(glb, 12) : 0;
  const bool is_glb = glb.size() >= 20 && U32At(glb, 0) == kMagic && 20 + json_size <= glb.size();
  if (!is_glb || random % 16 == 0 || most < kHeaders + 8) {
    FuzzBytes all = glb;
    change(&all, most);
    return all;
  }
  const auto json_end = glb.begin() + 20 + static_cast<std::ptrdiff_t>(json_size);
  FuzzBytes json(glb.begin() + 20, json_end), binary;
  if (20 + json_size + 8 <= glb.size()) binary.assign(json_end + 8, glb.end());
  const std::size_t room = most - kHeaders - 8;
  if (random / 16 % 2 == 0 || binary.empty()) {
    change(&json, room > binary.size() ? room - binary.size() : 1);
  } else {
    change(&binary, room > json.size() ? room - json.size() : 1);
  }
  while (json.size() % 4 != 0) json.push_back(' ');
  while (binary.size() % 4 != 0) binary.push_back(0);
  FuzzBytes out;
  PutU32(kMagic, &out);
  PutU32(2, &out);
  PutU32(static_cast<std::uint32_t>(20 + json.size() + (binary.empty() ? 0 : 8 + binary.size())), &out);
  PutU32(static_cast<std::uint32_t>(json.size()), &out);
  PutU32(kJson, &out);
  out.insert(out.end(), json.begin(), json.end());
  if (binary.empty()) return out;
  PutU32(static_cast<std::uint32_t>(binary.size()), &out);
  PutU32(kBinary, &out);
  out.insert(out.end(), binary.begin(), binary.end());
  return out;
}

}  // namespace kpsa::engine
