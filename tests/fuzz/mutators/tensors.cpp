#include <algorithm>
#include <cstring>
#include <iterator>

#include "files/safetensors.h"
#include "tests/fuzz/mutators/bytes.h"

namespace kpsa::engine {
namespace {

FuzzBytes All(const FuzzBytes& file, std::size_t most, const ChangeBytes& change) {
  FuzzBytes all = file;
  change(&all, most);
  return all;
}

// Another header, with its length before it; the tensors stay.
FuzzBytes WithHeader(const FuzzBytes& file, std::size_t most, const ChangeBytes& change) {
  std::uint64_t size = 0;
  std::memcpy(&size, file.data(), 8);
  const auto end = file.begin() + 8 + static_cast<std::ptrdiff_t>(size);
  FuzzBytes header(file.begin() + 8, end), out;
  const std::size_t rest = static_cast<std::size_t>(file.end() - end) + 8;
  change(&header, most > rest ? most - rest : 1);
  PutU32(static_cast<std::uint32_t>(header.size()), &out);
  PutU32(0, &out);
  out.insert(out.end(), header.begin(), header.end());
  out.insert(out.end(), end, file.end());
  return out;
}

}  // namespace

FuzzBytes MutateTensors(const FuzzBytes& file, std::size_t most, std::uint32_t random,
                        const ChangeBytes& change) {
  const auto* begin = reinterpret_cast<const std::byte*>(file.data());
  const Result<SafetensorsFile> parsed = SafetensorsFile::Parse({begin, begin + file.size()}, "mutated");
  if (!parsed.ok() || random % 16 == 0) return All(file, most, change);
  if (random % 16 < 6 || parsed->tensors().empty()) return WithHeader(file, most, change);
  // The numbers of a tensor, as many as there are
  SafetensorsWriter writer;
  for (const auto& [key, text] : parsed->metadata()) writer.SetMetadata(key, text);
  const auto which = random / 16 % parsed->tensors().size();
  std::size_t i = 0;
  for (const auto& [key, tensor] : parsed->tensors()) {
    FuzzBytes values(tensor.bytes.size());
    if (!values.empty()) std::memcpy(values.data(), tensor.bytes.data(), values.size());
    if (i++ == which && !values.empty()) {
      FuzzBytes changed = values;
      change(&changed, values.size());
      std::copy_n(changed.begin(), std::min(changed.size(), values.size()), values.begin());
    }
    writer.AddBytes(key, tensor.type, tensor.shape, std::as_bytes(std::span(values)));
  }
  const std::vector<std::byte> bytes = writer.Serialize();
  FuzzBytes out(bytes.size());
  std::memcpy(out.data(), bytes.data(), out.size());
  return out;
}

}  // namespace kpsa::engine
