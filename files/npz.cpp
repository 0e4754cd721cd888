#include "files/npz.h"

#include <unistd.h>
#include <zip.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <system_error>

#include "base/check.h"
#include "files/file.h"
#include "files/temporaries.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kSpoolAbove = std::size_t{64} << 20;  // bytes of an array that are kept in memory
constexpr std::uint64_t kInflateLimit = 1040;               // deflate packs at most 1032 bytes into one

struct TypeInfo {
  NpzType type;
  const char* code;  // as in '<f4', without the byte order
  std::size_t size;
};
constexpr TypeInfo kTypes[] = {
    {NpzType::kFloat32, "f4", 4}, {NpzType::kFloat64, "f8", 8}, {NpzType::kInt8, "i1", 1},
    {NpzType::kInt16, "i2", 2},   {NpzType::kInt32, "i4", 4},   {NpzType::kInt64, "i8", 8},
    {NpzType::kUint8, "u1", 1},   {NpzType::kUint16, "u2", 2},  {NpzType::kUint32, "u4", 4},
    {NpzType::kUint64, "u8", 8},  {NpzType::kBool, "b1", 1}};
const TypeInfo& Info(NpzType type) { return kTypes[static_cast<std::size_t>(type)]; }

// The bytes of an array of this shape; nullopt where they exceed 2^62.
std::optional<std::uint64_t> ByteCount(const std::vector<std::uint64_t>& shape, std::size_t element_size) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 62;
  std::uint64_t total = element_size;
  if (std::find(shape.begin(), shape.end(), 0u) != shape.end()) return 0;
  for (const std::uint64_t extent : shape) {
    if (extent > kMost / total) return std::nullopt;
    total *= extent;
  }
  return total;
}

// The .npy header of version 1.0: its length is a multiple of 64.
std::string NpyHeader(NpzType type, const std::vector<std::uint64_t>& shape) {
  std::string extents;
  for (const std::uint64_t extent : shape) extents += fmt::format("{}, ", extent);
  if (shape.size() > 1) extents.resize(extents.size() - 2);
  if (shape.size() == 1) extents.resize(extents.size() - 1);
  std::string text = fmt::format("{{'descr': '{}{}', 'fortran_order': False, 'shape': ({}), }}",
                                 Info(type).size == 1 ? '|' : '<', Info(type).code, extents);
  const std::size_t padded = (10 + text.size() + 1 + 63) / 64 * 64;
  text.resize(padded - 11, ' ');
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(text.size() & 0xff);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::size_t NpzTypeSize(NpzType type) { return Info(type).size; }

struct NpzWriter::Impl {
  struct Array {
    std::string name;
    NpzType type = NpzType::kFloat32;
    std::uint64_t expected = 0, written = 0;  // bytes, without the header
    std::vector<std::uint8_t> bytes;          // header and content, or
    std::unique_ptr<std::FILE, FileCloser> spool;
  };
  explicit Impl(OutputFile file) : output(std::move(file)) {}
  OutputFile output;
  std::vector<Array> arrays;
  std::map<std::string, ArrayId> names;

  Status Write(Array* array, std::span<const std::uint8_t> bytes) {
    if (bytes.empty()) return {};
    if (array->spool == nullptr) {
      array->bytes.insert(array->bytes.end(), bytes.begin(), bytes.end());
    } else if (std::fwrite(bytes.data(), 1, bytes.size(), array->spool.get()) != bytes.size()) {
      return Status::Invalid("cannot be written: {}", std::generic_category().message(errno))
          .At({output.path()});
    }
    return {};
  }
};

NpzWriter::NpzWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
NpzWriter::NpzWriter(NpzWriter&&) noexcept = default;
NpzWriter& NpzWriter::operator=(NpzWriter&&) noexcept = default;
NpzWriter::~NpzWriter() = default;

Result<NpzWriter> NpzWriter::Create(const std::string& path, bool force) {
  Result<OutputFile> output = OutputFile::Create(path, force);
  if (!output.ok()) return output.status();
  return NpzWriter(std::make_unique<Impl>(std::move(*output)));
}

Result<NpzWriter::ArrayId> NpzWriter::Declare(const std::string& name, NpzType type,
                                              std::vector<std::uint64_t> shape) {
  const std::string& path = impl_->output.path();
  if (name.empty() || name.find('\0') != std::string::npos) {
    return Status::Invalid("an array needs a name without zero bytes").At({path});
  }
  if (!impl_->names.emplace(name, impl_->arrays.size()).second) {
    return Status::Invalid("two arrays are named \"{}\"", name).At({path});
  }
  const std::optional<std::uint64_t> size = ByteCount(shape, NpzTypeSize(type));
  if (!size) return Status::Invalid("array \"{}\" is too large", name).At({path});
  Impl::Array& array = impl_->arrays.emplace_back();
  array.name = name;
  array.type = type;
  array.expected = *size;
  if (*size > kSpoolAbove) {
    const std::string spool = fmt::format("{}.{}", impl_->output.temporary_path(), impl_->arrays.size());
    AddTemporary(spool);  // a signal may come before its name goes
    array.spool.reset(std::fopen(spool.c_str(), "w+bx"));
    const int reason = errno;
    if (array.spool != nullptr) ::unlink(spool.c_str());
    DropTemporary(spool);
    if (array.spool == nullptr) {
      return Status::Invalid("cannot be written: {}", std::generic_category().message(reason)).At({path});
    }
  }
  const std::string header = NpyHeader(type, shape);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(header.data());
  KPSA_RETURN_IF_ERROR(impl_->Write(&array, {bytes, header.size()}));
  return impl_->arrays.size() - 1;
}

Status NpzWriter::AppendBytes(ArrayId id, NpzType type, std::span<const std::uint8_t> bytes) {
  KPSA_CHECK_LT(id, impl_->arrays.size());
  Impl::Array& array = impl_->arrays[id];
  KPSA_CHECK(array.type == type);
  KPSA_CHECK_LE(bytes.size(), array.expected - array.written);
  array.written += bytes.size();
  return impl_->Write(&array, bytes);
}

Status NpzWriter::Append(ArrayId array, std::span<const float> values) {
  return AppendBytes(array, NpzType::kFloat32,
                     {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()});
}

Status NpzWriter::Append(ArrayId array, std::span<const double> values) {
  return AppendBytes(array, NpzType::kFloat64,
                     {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()});
}

Status NpzWriter::Add(const std::string& name, std::vector<std::uint64_t> shape,
                      std::span<const float> values) {
  const Result<ArrayId> array = Declare(name, NpzType::kFloat32, std::move(shape));
  return array.ok() ? Append(*array, values) : array.status();
}

Status NpzWriter::Add(const std::string& name, std::vector<std::uint64_t> shape,
                      std::span<const double> values) {
  const Result<ArrayId> array = Declare(name, NpzType::kFloat64, std::move(shape));
  return array.ok() ? Append(*array, values) : array.status();
}

Status NpzWriter::Finish() {
  const std::string& path = impl_->output.path();
  const auto failed = [&](const char* reason) {
    return Status::Invalid("cannot be written: {}", reason).At({path});
  };
  KPSA_CHECK(!impl_->arrays.empty());
  int code = 0;
  zip_t* archive = zip_open(impl_->output.temporary_path().c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  if (archive == nullptr) return failed("the archive cannot be opened");
  for (Impl::Array& array : impl_->arrays) {
    KPSA_CHECK_EQ(array.written, array.expected);
    if (array.spool != nullptr && std::fseek(array.spool.get(), 0, SEEK_SET) != 0) {  // flushes, too
      zip_discard(archive);
      return failed("the disk is full");
    }
    zip_source_t* source = array.spool != nullptr
                               ? zip_source_filep(archive, array.spool.release(), 0, -1)
                               : zip_source_buffer(archive, array.bytes.data(), array.bytes.size(), 0);
    const zip_int64_t entry =
        source == nullptr ? -1
                          : zip_file_add(archive, (array.name + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (entry < 0) {
      const Status status = failed(zip_strerror(archive));
      zip_source_free(source);
      zip_discard(archive);
      return status;
    }
    const auto index = static_cast<zip_uint64_t>(entry);
    zip_set_file_compression(archive, index, ZIP_CM_STORE, 0);
    zip_file_set_dostime(archive, index, 0, 0x21, 0);  // 1980-01-01, the first that zip knows
  }
  if (zip_close(archive) != 0) {
    const Status status = failed(zip_strerror(archive));
    zip_discard(archive);
    return status;
  }
  return impl_->output.Commit();
}

std::size_t NpzArray::size() const { return bytes.size() / NpzTypeSize(type); }

namespace {

template <typename T>
double ElementAsDouble(const std::uint8_t* data) {
  T value;
  std::memcpy(&value, data, sizeof(T));
  return static_cast<double>(value);
}

double ElementAsDouble(NpzType type, const std::uint8_t* data) {
  switch (type) {
    case NpzType::kFloat32:
      return ElementAsDouble<float>(data);
    case NpzType::kFloat64:
      return ElementAsDouble<double>(data);
    case NpzType::kInt8:
      return ElementAsDouble<std::int8_t>(data);
    case NpzType::kInt16:
      return ElementAsDouble<std::int16_t>(data);
    case NpzType::kInt32:
      return ElementAsDouble<std::int32_t>(data);
    case NpzType::kInt64:
      return ElementAsDouble<std::int64_t>(data);
    case NpzType::kUint16:
      return ElementAsDouble<std::uint16_t>(data);
    case NpzType::kUint32:
      return ElementAsDouble<std::uint32_t>(data);
    case NpzType::kUint64:
      return ElementAsDouble<std::uint64_t>(data);
    case NpzType::kUint8:
    case NpzType::kBool:
      return ElementAsDouble<std::uint8_t>(data);
  }
  return 0;
}

// The value behind 'key': in the header's dictionary literal, up to the comma or bracket that ends it.
std::string_view HeaderValue(std::string_view dictionary, std::string_view key) {
  std::size_t at = dictionary.find(fmt::format("'{}'", key));
  if (at == std::string_view::npos) return {};
  at = dictionary.find(':', at);
  if (at == std::string_view::npos) return {};
  at = dictionary.find_first_not_of(" :", at);
  if (at == std::string_view::npos) return {};
  const char open = dictionary[at];
  const std::size_t end = open == '(' ? dictionary.find(')', at) : dictionary.find_first_of(",}", at);
  if (end == std::string_view::npos) return {};
  return dictionary.substr(at, end - at);
}

Status ParseShape(std::string_view text, std::vector<std::uint64_t>* shape) {
  if (text.empty() || text[0] != '(') return Status::Invalid("its header has no shape");
  std::uint64_t value = 0;
  bool digits = false;
  const auto end_number = [&] {
    if (digits) shape->push_back(value);
    value = 0, digits = false;
  };
  for (const char c : text.substr(1)) {
    if (c >= '0' && c <= '9') {
      if (value > (std::uint64_t{1} << 58)) return Status::Invalid("its shape is too large");
      value = 10 * value + static_cast<std::uint64_t>(c - '0');
      digits = true;
    } else if (c == ',' || c == ' ') {
      end_number();
    } else {
      return Status::Invalid("its shape cannot be read");
    }
  }
  end_number();
  if (shape->size() > 32) return Status::Invalid("its shape has {} dimensions", shape->size());
  return {};
}

// Splits the bytes of a .npy file into header and content.
Status ParseNpy(std::vector<std::uint8_t> file, NpzArray* array) {
  if (file.size() < 10 || std::memcmp(file.data(), "\x93NUMPY", 6) != 0)
    return Status::Invalid("is no .npy array");
  const int version = file[6];
  if (version < 1 || version > 3)
    return Status::Invalid("is a .npy array of version {}, expected 1 to 3", version);
  const std::size_t prefix = version == 1 ? 10 : 12;
  if (file.size() < prefix) return Status::Invalid("is truncated");
  std::size_t length = file[8] | static_cast<std::size_t>(file[9]) << 8;
  if (version > 1)
    length |= static_cast<std::size_t>(file[10]) << 16 | static_cast<std::size_t>(file[11]) << 24;
  if (length > file.size() - prefix) return Status::Invalid("is truncated");
  const std::string_view dictionary(reinterpret_cast<const char*>(file.data()) + prefix, length);

  const std::string_view description = HeaderValue(dictionary, "descr");
  const TypeInfo* info = nullptr;
  for (const TypeInfo& candidate : kTypes) {
    if (description.size() == 5 && description.substr(2, 2) == candidate.code) info = &candidate;
  }
  const char order = info == nullptr ? ' ' : description[1];
  if (std::string_view("<>=|").find(order) == std::string_view::npos) {
    return Status::Invalid("has the type {}, expected integers or floats of 4 or 8 bytes",
                           description.substr(0, 40));
  }
  array->type = info->type;
  KPSA_RETURN_IF_ERROR(ParseShape(HeaderValue(dictionary, "shape"), &array->shape));
  if (HeaderValue(dictionary, "fortran_order") == "True" && array->shape.size() > 1) {
    return Status::Invalid("is in Fortran order; save it with numpy.ascontiguousarray");
  }
  const std::optional<std::uint64_t> expected = ByteCount(array->shape, info->size);
  const std::size_t content = file.size() - prefix - length;
  if (!expected || *expected != content) {
    return Status::Invalid("holds {} bytes, its shape and type do not", content);
  }
  file.erase(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(prefix + length));
  array->bytes = std::move(file);
  if (order == '>' && info->size > 1) {
    for (std::size_t i = 0; i < array->bytes.size(); i += info->size) {
      std::reverse(array->bytes.begin() + static_cast<std::ptrdiff_t>(i),
                   array->bytes.begin() + static_cast<std::ptrdiff_t>(i + info->size));
    }
  }
  return {};
}

Result<std::vector<std::uint8_t>> ReadEntry(zip_t* archive, zip_uint64_t index, std::uint64_t* budget) {
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_stat_index(archive, index, 0, &stat) != 0 || (stat.valid & ZIP_STAT_SIZE) == 0 ||
      (stat.valid & ZIP_STAT_COMP_SIZE) == 0) {
    return Status::Invalid("has no known size");
  }
  if (stat.size > *budget || stat.size / kInflateLimit > stat.comp_size) {
    return Status::Invalid("claims {} bytes, more than it can hold or than is read", stat.size);
  }
  *budget -= stat.size;
  std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen_index(archive, index, 0), &zip_fclose);
  if (file == nullptr) return Status::Invalid("cannot be read: {}", zip_strerror(archive));
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(stat.size));
  for (std::size_t at = 0; at < bytes.size();) {
    const zip_int64_t got =
        zip_fread(file.get(), bytes.data() + at, std::min<std::size_t>(bytes.size() - at, 1 << 28));
    if (got <= 0)
      return Status::Invalid("is damaged: {}", got < 0 ? zip_file_strerror(file.get()) : "it ends early");
    at += static_cast<std::size_t>(got);
  }
  // The checksum is compared when the end is read
  std::uint8_t extra;
  if (zip_fread(file.get(), &extra, 1) != 0)
    return Status::Invalid("is damaged: {}", zip_file_strerror(file.get()));
  return bytes;
}

}  // namespace

std::vector<double> NpzArray::Doubles() const {
  std::vector<double> values(size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = ElementAsDouble(type, &bytes[i * NpzTypeSize(type)]);
  return values;
}

std::vector<float> NpzArray::Floats() const {
  std::vector<float> values(size());
  if (type == NpzType::kFloat32) {
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  } else {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(ElementAsDouble(type, &bytes[i * NpzTypeSize(type)]));
    }
  }
  return values;
}

const NpzArray* Npz::Find(std::string_view name) const {
  for (const NpzArray& array : arrays) {
    if (array.name == name) return &array;
  }
  return nullptr;
}

Result<Npz> ReadNpz(const std::string& path, std::uint64_t max_bytes) {
  std::error_code unknown;
  if (std::filesystem::exists(path, unknown) && !std::filesystem::is_regular_file(path, unknown))
    return Status::Invalid("is a folder, a pipe or a device, expected a file").At({path});
  int code = 0;
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive(zip_open(path.c_str(), ZIP_RDONLY, &code), &zip_discard);
  if (archive == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const Status status =
        Status::Invalid("cannot be read as .npz: {}", zip_error_strerror(&error)).At({path});
    zip_error_fini(&error);
    return status;
  }
  Npz result;
  const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* raw_name = zip_get_name(archive.get(), static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    std::string name = raw_name == nullptr ? "" : raw_name;
    const auto located = [&](const Status& status) {
      return Status::Invalid("array \"{}\" {}", name, status.errors().front().message).At({path});
    };
    Result<std::vector<std::uint8_t>> bytes =
        ReadEntry(archive.get(), static_cast<zip_uint64_t>(i), &max_bytes);
    if (!bytes.ok()) return located(bytes.status());
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    NpzArray array;
    if (const Status status = ParseNpy(std::move(*bytes), &array); !status.ok()) return located(status);
    array.name = name;
    result.arrays.push_back(std::move(array));
  }
  return result;
}

}  // namespace kpsa::engine
