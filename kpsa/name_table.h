// Names in the file of a subspace: each once, and wherever it is meant, its number. Internal to the files that read and
// write it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "files/safetensors.h"

namespace kpsa::engine {

// Numbers names in the order in which they are asked for.
class NameNumbers {
 public:
  std::uint32_t Of(const std::string& name);
  // The tensors "names" and "nameEnds".
  void AddTo(SafetensorsWriter* writer) const;

 private:
  std::unordered_map<std::string, std::uint32_t> numbers_;
  std::string text_;
  std::vector<std::uint32_t> ends_;
};

// Hands out names. Numbers may say a long name again and again, so there is an end to what is handed out.
class NameTable {
 public:
  // Errors: tensors that are missing or of another kind; ends that do not ascend to the end of the text; a name that
  // is not UTF-8.
  static Result<NameTable> Read(const SafetensorsFile& file);
  // Errors: no such name; all that were taken are longer than kMostText.
  Status Take(std::uint32_t number, std::string* name);

  static constexpr std::size_t kMostText = 64u << 20;  // bytes

 private:
  std::vector<std::uint8_t> text_;
  std::vector<std::uint32_t> ends_;
  std::size_t taken_ = 0;
};

}  // namespace kpsa::engine
