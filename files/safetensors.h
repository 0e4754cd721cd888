// Files of named tensors in the safetensors layout: 8 bytes of header length (little-endian), a JSON header,
// raw little-endian data (https://github.com/huggingface/safetensors, "Format"). Reading trusts nothing:
// every length, shape, offset and number is checked before memory is taken for it. Writing is atomic: a
// temporary file, renamed. All functions may be called from any thread.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/points.h"
#include "base/status.h"

namespace kpsa::engine {

enum class TensorType : std::uint8_t { kU8, kU16, kU32, kU64, kI32, kI64, kF16, kF32, kF64 };
std::size_t TensorItemSize(TensorType type);       // bytes
std::string_view TensorTypeName(TensorType type);  // "F32"

template <typename T>
struct TensorTypeOf;
template <>
struct TensorTypeOf<std::uint8_t> {
  static constexpr TensorType value = TensorType::kU8;
};
template <>
struct TensorTypeOf<std::uint16_t> {
  static constexpr TensorType value = TensorType::kU16;
};
template <>
struct TensorTypeOf<std::uint32_t> {
  static constexpr TensorType value = TensorType::kU32;
};
template <>
struct TensorTypeOf<std::uint64_t> {
  static constexpr TensorType value = TensorType::kU64;
};
template <>
struct TensorTypeOf<std::int32_t> {
  static constexpr TensorType value = TensorType::kI32;
};
template <>
struct TensorTypeOf<std::int64_t> {
  static constexpr TensorType value = TensorType::kI64;
};
template <>
struct TensorTypeOf<float> {
  static constexpr TensorType value = TensorType::kF32;
};
template <>
struct TensorTypeOf<double> {
  static constexpr TensorType value = TensorType::kF64;
};

// A tensor in a file: row-major, bytes points into the file's memory (no alignment promised).
struct Tensor {
  TensorType type = TensorType::kU8;
  std::vector<std::uint64_t> shape;
  std::span<const std::byte> bytes;
  std::uint64_t count() const;  // product of the shape; 1 for a scalar
};

// A file in memory. Move-only: tensors point into it.
class SafetensorsFile {
 public:
  SafetensorsFile() = default;
  SafetensorsFile(SafetensorsFile&&) = default;
  SafetensorsFile& operator=(SafetensorsFile&&) = default;
  // Errors (kInvalidInput, each names `name`): not readable, too short, header length beyond the file, header
  // not JSON or not an object of tensors, unknown type, shape overflow, length that differs from shape, data
  // that overlap or leave holes or end before or after the file.
  static Result<SafetensorsFile> Parse(std::span<const std::byte> bytes, const std::string& name);
  static Result<SafetensorsFile> Read(const std::string& path);

  const std::string& name() const { return name_; }
  const std::map<std::string, std::string>& metadata() const { return metadata_; }
  const std::map<std::string, Tensor>& tensors() const { return tensors_; }

  // The string of a metadata key; an error names the key and the nearest one that exists.
  Result<std::string> Metadata(const std::string& key) const;
  // The bytes of a tensor of the wanted type and shape. A shape entry of kAnySize matches every size. float and
  // double tensors must be finite; kF16 tensors are read as T = std::uint16_t with half = true, and must be
  // finite, too.
  static constexpr std::uint64_t kAnySize = ~std::uint64_t{0};
  template <typename T>
  Result<std::span<const std::byte>> Bytes(const std::string& key, std::span<const std::uint64_t> shape,
                                           bool half = false) const {
    const Result<const Tensor*> tensor =
        Checked(key, half ? TensorType::kF16 : TensorTypeOf<T>::value, shape);
    if (!tensor.ok()) return tensor.status();
    return (*tensor)->bytes;
  }
  // A copy of them.
  template <typename T>
  Result<std::vector<T>> Values(const std::string& key, std::span<const std::uint64_t> shape,
                                bool half = false) const {
    const Result<std::span<const std::byte>> bytes = Bytes<T>(key, shape, half);
    if (!bytes.ok()) return bytes.status();
    std::vector<T> values(bytes->size() / sizeof(T));
    CopyBytes(*bytes, values.data());
    return values;
  }
  template <typename T>
  Result<std::vector<T>> Values(const std::string& key, std::initializer_list<std::uint64_t> shape,
                                bool half = false) const {
    return Values<T>(key, std::span<const std::uint64_t>(shape.begin(), shape.size()), half);
  }

 private:
  Result<const Tensor*> Checked(const std::string& key, TensorType type,
                                std::span<const std::uint64_t> shape) const;
  static void CopyBytes(std::span<const std::byte> from, void* to);

  static Result<SafetensorsFile> ParseOwn(AlignedFloats memory, std::size_t size, const std::string& name);

  std::string name_;
  AlignedFloats memory_;  // of the file
  std::map<std::string, std::string> metadata_;
  std::map<std::string, Tensor> tensors_;
};

// Collects tensors and writes them. Values are copied.
class SafetensorsWriter {
 public:
  void SetMetadata(const std::string& key, std::string value) { metadata_[key] = std::move(value); }
  template <typename T>
  void Add(const std::string& key, std::vector<std::uint64_t> shape, std::span<const T> values,
           bool half = false) {
    AddBytes(key, half ? TensorType::kF16 : TensorTypeOf<T>::value, std::move(shape), std::as_bytes(values));
  }
  // Product of shape times item size must be bytes.size() and the key new (both checked: programmer errors).
  void AddBytes(const std::string& key, TensorType type, std::vector<std::uint64_t> shape,
                std::span<const std::byte> bytes);
  std::vector<std::byte> Serialize() const;
  Status Write(const std::string& path) const;

 private:
  struct Item {
    TensorType type;
    std::vector<std::uint64_t> shape;
    std::vector<std::byte> bytes;
  };
  std::map<std::string, std::string> metadata_;
  std::map<std::string, Item> items_;
};

}  // namespace kpsa::engine
