// Lists of a subspace as tensors of its file. Internal to the files that read and write it.
#pragma once

#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "files/safetensors.h"
#include "kpsa/aligned_array.h"

namespace kpsa::engine {

template <typename T>
Status Assign(Result<std::vector<T>> values, std::vector<T>* target) {
  if (!values.ok()) return values.status();
  *target = std::move(*values);
  return {};
}
// A list of any size, or of one.
template <typename T>
Status ReadAligned(const SafetensorsFile& file, const std::string& key, AlignedArray<T>* target,
                   bool half = false, std::uint64_t size = SafetensorsFile::kAnySize) {
  const Result<std::span<const std::byte>> bytes = file.Bytes<T>(key, std::span(&size, 1), half);
  if (!bytes.ok()) return bytes.status();
  *target = AlignedArray<T>(*bytes);
  return {};
}

template <typename T>
void Add(SafetensorsWriter* writer, const std::string& key, std::span<const T> values, bool half = false) {
  writer->Add<T>(key, {values.size()}, values, half);
}

}  // namespace kpsa::engine
