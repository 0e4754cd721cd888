#include "files/safetensors.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "base/check.h"
#include "base/fresh_pages.h"
#include "files/file.h"
#include "files/missing_file.h"

static_assert(std::endian::native == std::endian::little, "tensors are copied as they lie in memory");

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMaxHeader = 64u << 20;  // bytes of JSON
constexpr std::uint64_t kMaxFile = std::uint64_t{4} << 30;
constexpr std::size_t kMaxDimensions = 16;
constexpr std::size_t kAlignment = 64;  // of the data within the file, so that it maps well

struct TensorTypeInfo {
  TensorType type;
  std::string_view name;
  std::size_t size;
};
constexpr TensorTypeInfo kTensorTypes[] = {
    {TensorType::kU8, "U8", 1},   {TensorType::kU16, "U16", 2}, {TensorType::kU32, "U32", 4},
    {TensorType::kU64, "U64", 8}, {TensorType::kI32, "I32", 4}, {TensorType::kI64, "I64", 8},
    {TensorType::kF16, "F16", 2}, {TensorType::kF32, "F32", 4}, {TensorType::kF64, "F64", 8},
};

bool Multiply(std::uint64_t a, std::uint64_t b, std::uint64_t* product) {
  return !__builtin_mul_overflow(a, b, product);
}

std::string ShapeText(std::span<const std::uint64_t> shape) {
  std::string text;
  for (const std::uint64_t size : shape) {
    text += (text.empty() ? "" : ", ") +
            (size == SafetensorsFile::kAnySize ? std::string("any") : std::to_string(size));
  }
  return "[" + text + "]";
}

// JSON text of the header; duplicate keys are an error, as the format says.
Result<Json> ParseHeader(std::string_view text, const std::string& name) {
  std::vector<std::set<std::string>> keys;
  std::string duplicate;
  int depth_reached = 0;
  const Json::parser_callback_t callback = [&](int depth, Json::parse_event_t event, Json& parsed) {
    depth_reached = std::max(depth_reached, depth);
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string key = parsed.get<std::string>();
      if (!keys.back().insert(key).second && duplicate.empty()) duplicate = key;
    }
    return depth <= 4;  // deeper values are dropped; the depth is reported below
  };
  const Json header = Json::parse(text, callback, false);
  if (header.is_discarded() || !header.is_object())
    return Status::Invalid("the header is not a JSON object").At({name});
  if (depth_reached > 4)
    return Status::Invalid("the header is nested deeper than the format allows").At({name});
  if (!duplicate.empty()) return Status::Invalid("the header names \"{}\" twice", duplicate).At({name});
  return header;
}

// One entry of the header -> type, shape and place; begin and end are relative to the data.
Status ParseTensor(const std::string& name, const std::string& key, const Json& entry,
                   std::uint64_t data_size, Tensor* tensor, std::uint64_t* begin, std::uint64_t* end) {
  const auto bad = [&](const char* what) {
    return Status::Invalid("tensor \"{}\": {}", key, what).At({name});
  };
  if (!entry.is_object() || !entry.contains("dtype") || !entry.contains("shape") ||
      !entry.contains("data_offsets")) {
    return bad("expected an object with dtype, shape and data_offsets");
  }
  const Json &type = entry["dtype"], &shape = entry["shape"], &offsets = entry["data_offsets"];
  if (!type.is_string()) return bad("dtype is not a string");
  const auto info =
      std::find_if(std::begin(kTensorTypes), std::end(kTensorTypes),
                   [&](const TensorTypeInfo& t) { return t.name == type.get_ref<const std::string&>(); });
  if (info == std::end(kTensorTypes))
    return Status::Invalid("tensor \"{}\": unknown dtype \"{}\"", key, type.get_ref<const std::string&>())
        .At({name});
  tensor->type = info->type;
  if (!shape.is_array() || shape.size() > kMaxDimensions)
    return bad("shape is not a list of at most 16 sizes");
  std::uint64_t size = info->size;
  for (const Json& extent : shape) {
    if (!extent.is_number_unsigned()) return bad("a size in its shape is not a whole number");
    tensor->shape.push_back(extent.get<std::uint64_t>());
    if (!Multiply(size, tensor->shape.back(), &size)) return bad("its shape overflows");
  }
  if (!offsets.is_array() || offsets.size() != 2 || !offsets[0].is_number_unsigned() ||
      !offsets[1].is_number_unsigned()) {
    return bad("data_offsets is not a pair of whole numbers");
  }
  *begin = offsets[0].get<std::uint64_t>();
  *end = offsets[1].get<std::uint64_t>();
  if (*begin > *end || *end > data_size) {
    return Status::Invalid("tensor \"{}\" lies at bytes {} to {} of {}{}", key, *begin, *end, data_size,
                           *end > data_size ? ": the file is cut short" : "")
        .At({name});
  }
  if (*end - *begin != size) {
    return Status::Invalid("tensor \"{}\" of shape {} needs {} bytes, it has {}", key,
                           ShapeText(tensor->shape), size, *end - *begin)
        .At({name});
  }
  return {};
}

// exponent: the bits that are all set in an infinity and in what is no number. Without a way out, so that many are
// looked at at once.
template <typename Bits>
bool AllFinite(std::span<const std::byte> bytes, Bits exponent) {
  // Where all of them are set, the lowest one more carries into the sign
  const auto lowest = static_cast<Bits>(exponent & (~exponent + 1u));
  Bits carried = 0;
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(Bits)) {
    Bits value;
    std::memcpy(&value, bytes.data() + i, sizeof(Bits));
    carried = static_cast<Bits>(carried | static_cast<Bits>((value & exponent) + lowest));
  }
  return (carried >> (8 * sizeof(Bits) - 1)) == 0;
}

}  // namespace

std::size_t TensorItemSize(TensorType type) { return kTensorTypes[static_cast<std::size_t>(type)].size; }
std::string_view TensorTypeName(TensorType type) { return kTensorTypes[static_cast<std::size_t>(type)].name; }

std::uint64_t Tensor::count() const {
  std::uint64_t product = 1;
  for (const std::uint64_t size : shape) product *= size;
  return product;
}

namespace {

// For a while only: large pages may hold more than the file.
AlignedFloats MemoryFor(std::size_t file_size) {
  const std::size_t unit = file_size >= kLargePage ? kLargePage : 64;
  return AlignedFloats::Uninitialized((file_size + unit - 1) / unit * unit / sizeof(float));
}

}  // namespace

Result<SafetensorsFile> SafetensorsFile::Parse(std::span<const std::byte> bytes, const std::string& name) {
  AlignedFloats memory = MemoryFor(bytes.size());
  if (!bytes.empty()) std::memcpy(memory.data(), bytes.data(), bytes.size());
  return ParseOwn(std::move(memory), bytes.size(), name);
}

Result<SafetensorsFile> SafetensorsFile::ParseOwn(AlignedFloats memory, std::size_t size,
                                                  const std::string& name) {
  SafetensorsFile file;
  file.name_ = name;
  file.memory_ = std::move(memory);
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(file.memory_.data()), size);
  if (bytes.size() < 8) return Status::Invalid("{} bytes are too few for a header", bytes.size()).At({name});
  std::uint64_t header_size;
  std::memcpy(&header_size, bytes.data(), 8);
  if (header_size > bytes.size() - 8 || header_size > kMaxHeader) {
    return Status::Invalid(
               "the header claims {} bytes, the file has {} (not a safetensors file, or cut short: expected "
               "one that kpsa train wrote)",
               header_size, bytes.size())
        .At({name});
  }
  const Result<Json> header =
      ParseHeader({reinterpret_cast<const char*>(bytes.data()) + 8, header_size}, name);
  if (!header.ok()) return header.status();
  const std::span<const std::byte> data = bytes.subspan(8 + header_size);

  // Every byte of the data belongs to exactly one tensor
  struct Extent {
    std::uint64_t begin, end;
    const std::string* key;
  };
  std::vector<Extent> extents;
  for (const auto& [key, entry] : header->items()) {
    if (key == "__metadata__") {
      if (!entry.is_object()) return Status::Invalid("__metadata__ is not an object of strings").At({name});
      for (const auto& [item, value] : entry.items()) {
        if (!value.is_string())
          return Status::Invalid("__metadata__ \"{}\" is not a string", item).At({name});
        file.metadata_[item] = value.get<std::string>();
      }
      continue;
    }
    Tensor tensor;
    Extent extent{};
    KPSA_RETURN_IF_ERROR(ParseTensor(name, key, entry, data.size(), &tensor, &extent.begin, &extent.end));
    tensor.bytes = data.subspan(extent.begin, extent.end - extent.begin);
    const auto place = file.tensors_.emplace(key, std::move(tensor)).first;
    extent.key = &place->first;
    extents.push_back(extent);
  }
  std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) {
    return a.begin != b.begin ? a.begin < b.begin : a.end < b.end;
  });
  std::uint64_t at = 0;
  for (const Extent& extent : extents) {
    if (extent.begin != at) {
      return Status::Invalid("tensor \"{}\" begins at byte {}, expected {} (tensors overlap or leave a hole)",
                             *extent.key, extent.begin, at)
          .At({name});
    }
    at = extent.end;
  }
  if (at != data.size())
    return Status::Invalid("{} bytes of data, the tensors account for {}", data.size(), at).At({name});
  return file;
}

Result<SafetensorsFile> SafetensorsFile::Read(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Status::Invalid("no such file{}", InsteadOfMissing(path)).At({path});
  if (!std::filesystem::is_regular_file(path, error))
    return Status::Invalid("is a folder, a pipe or a device, expected a file").At({path});
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) return Status::Invalid("cannot be opened").At({path});
  // The header is looked at first: a huge file of another kind is not read into memory
  std::uint64_t header_size = 0;
  stream.read(reinterpret_cast<char*>(&header_size), 8);
  if (!stream || header_size > size - 8 || header_size > kMaxHeader) {
    return Status::Invalid("not a safetensors file, or cut short: expected a file that kpsa train wrote")
        .At({path});
  }
  if (size > kMaxFile)
    return Status::Invalid("is larger than {} bytes, the most that is read", kMaxFile).At({path});
  AlignedFloats memory = MemoryFor(size);
  stream.seekg(0);
  stream.read(reinterpret_cast<char*>(memory.data()), static_cast<std::streamsize>(size));
  if (!stream) return Status::Invalid("could not be read to its end").At({path});
  return ParseOwn(std::move(memory), size, path);
}

Result<std::string> SafetensorsFile::Metadata(const std::string& key) const {
  const auto found = metadata_.find(key);
  if (found != metadata_.end()) return found->second;
  std::vector<std::string> keys;
  for (const auto& [name, value] : metadata_) keys.push_back(name);
  return Status::Invalid("the header has no \"{}\"{}", key, DidYouMean(key, keys)).At({name_});
}

Result<const Tensor*> SafetensorsFile::Checked(const std::string& key, TensorType type,
                                               std::span<const std::uint64_t> shape) const {
  const auto found = tensors_.find(key);
  if (found == tensors_.end()) {
    std::vector<std::string> keys;
    for (const auto& [name, tensor] : tensors_) keys.push_back(name);
    return Status::Invalid("there is no tensor \"{}\"{}", key, DidYouMean(key, keys)).At({name_});
  }
  const Tensor& tensor = found->second;
  bool same = tensor.shape.size() == shape.size();
  for (std::size_t i = 0; same && i < shape.size(); ++i)
    same = shape[i] == kAnySize || shape[i] == tensor.shape[i];
  if (tensor.type != type || !same) {
    return Status::Invalid("tensor \"{}\" is {} {}, expected {} {}", key, TensorTypeName(tensor.type),
                           ShapeText(tensor.shape), TensorTypeName(type), ShapeText(shape))
        .At({name_});
  }
  const bool finite = type == TensorType::kF16   ? AllFinite<std::uint16_t>(tensor.bytes, 0x7c00u)
                      : type == TensorType::kF32 ? AllFinite<std::uint32_t>(tensor.bytes, 0x7f800000u)
                      : type == TensorType::kF64 ? AllFinite<std::uint64_t>(tensor.bytes, 0x7ffull << 52)
                                                 : true;
  if (!finite) return Status::Invalid("tensor \"{}\" holds a NaN or an infinity", key).At({name_});
  return &tensor;
}

void SafetensorsFile::CopyBytes(std::span<const std::byte> from, void* to) {
  if (!from.empty()) std::memcpy(to, from.data(), from.size());
}

void SafetensorsWriter::AddBytes(const std::string& key, TensorType type, std::vector<std::uint64_t> shape,
                                 std::span<const std::byte> bytes) {
  KPSA_CHECK(key != "__metadata__" && !items_.contains(key));
  std::uint64_t size = TensorItemSize(type);
  for (const std::uint64_t extent : shape) KPSA_CHECK(Multiply(size, extent, &size));
  KPSA_CHECK_EQ(size, std::uint64_t{bytes.size()});
  items_[key] = Item{type, std::move(shape), {bytes.begin(), bytes.end()}};
}

std::vector<std::byte> SafetensorsWriter::Serialize() const {
  // Wide items first, so that each tensor is aligned to its own item
  std::vector<const std::pair<const std::string, Item>*> order;
  for (const auto& item : items_) order.push_back(&item);
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return TensorItemSize(a->second.type) > TensorItemSize(b->second.type);
  });
  Json header = Json::object();
  header["__metadata__"] = metadata_;
  std::uint64_t at = 0;
  for (const auto* item : order) {
    const std::uint64_t end = at + item->second.bytes.size();
    header[item->first] = {{"dtype", TensorTypeName(item->second.type)},
                           {"shape", item->second.shape},
                           {"data_offsets", {at, end}}};
    at = end;
  }
  std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 8 + kAlignment - 1) / kAlignment * kAlignment - 8, ' ');
  const std::uint64_t size = text.size();
  std::vector<std::byte> bytes(8 + text.size() + at);
  std::memcpy(bytes.data(), &size, 8);
  std::memcpy(bytes.data() + 8, text.data(), text.size());
  std::byte* target = bytes.data() + 8 + text.size();
  for (const auto* item : order)
    target = std::copy(item->second.bytes.begin(), item->second.bytes.end(), target);
  return bytes;
}

Status SafetensorsWriter::Write(const std::string& path) const {
  const std::vector<std::byte> bytes = Serialize();
  return WriteFileAtomically(path, true, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

}  // namespace kpsa::engine
