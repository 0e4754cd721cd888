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
template <typename T>
Status Assign(const Result<std::vector<T>>& values, AlignedArray<T>* target) {
  if (!values.ok()) return values.status();
  *target = AlignedArray<T>(values->size());
  if (!values->empty()) std::memcpy(target->data(), values->data(), values->size() * sizeof(T));
  return {};
}

template <typename T>
void Add(SafetensorsWriter* writer, const std::string& key, std::span<const T> values, bool half = false) {
  writer->Add<T>(key, {values.size()}, values, half);
}

}  // namespace kpsa::engine
