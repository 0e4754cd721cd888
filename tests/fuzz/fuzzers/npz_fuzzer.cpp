// NumPy archives: as they are, and, as what is in them has a checksum, bytes that are put into an archive as an array.
#include <zip.h>

#include <cmath>

#include "files/npz.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMost = std::uint64_t{64} << 20;

void CheckArchive(const std::string& path) {
  const Result<Npz> npz = ReadNpz(path, kMost);
  if (!npz.ok()) return RequireRefusal(npz.status());
  std::uint64_t all = 0;
  for (const NpzArray& array : npz->arrays) {
    Reached("array");
    all += array.bytes.size();
    Require(array.size() * NpzTypeSize(array.type) == array.bytes.size(), "an array of another size");
    Require(array.Doubles().size() == array.size() && array.Floats().size() == array.size(),
            "an array of another number of elements");
    Require(npz->Find(array.name) != nullptr, "an array that is not found by its name");
  }
  Require(all <= kMost, "more than was to be read");
}

// With a right checksum.
std::string Packed(FuzzedBytes bytes) {
  const std::string path = FuzzedFile("packed.npz", {});
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
  const zip_int64_t index = zip_file_add(archive, "a.npy", source, 0);
  zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0);
  if (zip_close(archive) != 0) throw std::runtime_error("cannot write " + path);
  return path;
}

}  // namespace

KPSA_FUZZER(npz) {
  if (bytes.size() > 1 && bytes[0] == 'P' && bytes[1] == 'K') {
    Reached("archive");
    CheckArchive(FuzzedFile("a.npz", bytes));
  } else {
    CheckArchive(Packed(bytes));
  }
}

}  // namespace kpsa::engine
