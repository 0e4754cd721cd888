// NumPy archives: named arrays in a zip file (numpy.lib.format 1.0 to 3.0), C order, little endian.
// Written with stored entries, Zip64 where an archive or a member passes 4 GB, and always the same bytes for
// the same arrays (no time stamps).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

enum class NpzType : std::uint8_t {
  kFloat32,
  kFloat64,
  kInt8,
  kInt16,
  kInt32,
  kInt64,
  kUint8,
  kUint16,
  kUint32,
  kUint64,
  kBool
};
std::size_t NpzTypeSize(NpzType type);

// Writes one archive. Arrays are declared with their shape, then filled by any number of appends, in any
// interleaving (frame by frame into several meshes, say); large ones wait in an unlinked file beside the
// output, not in memory. Not thread-safe.
class NpzWriter {
 public:
  using ArrayId = std::size_t;

  // Fails as OutputFile::Create does. Nothing is at `path` before Finish.
  static Result<NpzWriter> Create(const std::string& path, bool force);
  NpzWriter(NpzWriter&&) noexcept;
  NpzWriter& operator=(NpzWriter&&) noexcept;
  ~NpzWriter();  // without Finish: removes what was written

  // `name` is the key in Python; it may contain '/'. An error for an empty name, a zero byte in it, and a
  // name that was declared before.
  Result<ArrayId> Declare(const std::string& name, NpzType type, std::vector<std::uint64_t> shape);
  // The next elements in C order; the type must be the declared one.
  Status Append(ArrayId array, std::span<const float> values);
  Status Append(ArrayId array, std::span<const double> values);
  // Declare and Append in one.
  Status Add(const std::string& name, std::vector<std::uint64_t> shape, std::span<const float> values);
  Status Add(const std::string& name, std::vector<std::uint64_t> shape, std::span<const double> values);
  // Every array must be full. Writes the archive and renames it to its place.
  Status Finish();

 private:
  struct Impl;
  explicit NpzWriter(std::unique_ptr<Impl> impl);
  Status AppendBytes(ArrayId array, NpzType type, std::span<const std::uint8_t> bytes);
  std::unique_ptr<Impl> impl_;
};

struct NpzArray {
  std::string name;  // without ".npy"
  NpzType type = NpzType::kFloat32;
  std::vector<std::uint64_t> shape;  // empty: one value
  std::vector<std::uint8_t> bytes;   // little endian, C order
  std::size_t size() const;          // elements
  // All elements, converted.
  std::vector<double> Doubles() const;
  std::vector<float> Floats() const;
};

struct Npz {
  std::vector<NpzArray> arrays;  // in the archive's order
  const NpzArray* Find(std::string_view name) const;
};

// Reads an archive, stored or deflated. Hostile input: sizes are checked against the file's before
// allocation, and all arrays together may have at most max_bytes. Fortran order and types beyond NpzType are
// errors.
Result<Npz> ReadNpz(const std::string& path, std::uint64_t max_bytes = std::uint64_t{16} << 30);

}  // namespace kpsa::engine
