// EXT_meshopt_compression, by meshoptimizer: its decoders are safe for any bytes, the sizes are checked here.
#include <meshoptimizer.h>

#include "gltf/compressed.h"

namespace kpsa::engine::gltf {
namespace {

// A group of 16 bytes takes two bits at least in a block of attributes, three indices or one take a byte.
constexpr std::uint64_t kMostBytesOfOne = 64;

Status CheckLayout(const MeshoptView& v) {
  const bool attributes = v.mode == "ATTRIBUTES";
  if (!attributes && v.mode != "TRIANGLES" && v.mode != "INDICES") {
    return Status::Invalid("mode is \"{}\", expected ATTRIBUTES, TRIANGLES or INDICES", v.mode);
  }
  if (v.filter != "NONE" && v.filter != "OCTAHEDRAL" && v.filter != "QUATERNION" &&
      v.filter != "EXPONENTIAL") {
    return Status::Invalid("filter is \"{}\", expected NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL",
                           v.filter);
  }
  if (!attributes && v.filter != "NONE") {
    return Status::Invalid("filter is {}, which goes with mode ATTRIBUTES only", v.filter);
  }
  const auto stride = [&](bool good, std::string_view expected) {
    return good ? Status() : Status::Invalid("byteStride is {}, expected {}", v.stride, expected);
  };
  if (!attributes) {
    if (v.mode == "TRIANGLES" && v.count % 3 != 0)
      return Status::Invalid("count is {}, expected three for each triangle", v.count);
    return stride(v.stride == 2 || v.stride == 4, "2 or 4");
  }
  if (v.filter == "OCTAHEDRAL") return stride(v.stride == 4 || v.stride == 8, "4 or 8");
  if (v.filter == "QUATERNION") return stride(v.stride == 8, "8");
  return stride(v.stride > 0 && v.stride <= 256 && v.stride % 4 == 0, "a multiple of 4 up to 256");
}

}  // namespace

Result<std::vector<std::uint8_t>> DecodeMeshopt(const MeshoptView& v, std::span<const std::uint8_t> data) {
  KPSA_RETURN_IF_ERROR(CheckLayout(v));
  std::vector<std::uint8_t> decoded;
  if (v.count == 0) return decoded;
  const std::uint64_t size = v.count * v.stride;  // below 2^61
  if (size / kMostBytesOfOne > data.size()) {
    return Status::Invalid("{} elements of {} bytes cannot come from {} compressed bytes", v.count, v.stride,
                           data.size());
  }
  decoded.resize(static_cast<std::size_t>(size));
  const auto count = static_cast<std::size_t>(v.count), stride = static_cast<std::size_t>(v.stride);
  int error = 0;
  if (v.mode == "ATTRIBUTES") {
    error = meshopt_decodeVertexBuffer(decoded.data(), count, stride, data.data(), data.size());
  } else if (v.mode == "TRIANGLES") {
    error = meshopt_decodeIndexBuffer(decoded.data(), count, stride, data.data(), data.size());
  } else {
    error = meshopt_decodeIndexSequence(decoded.data(), count, stride, data.data(), data.size());
  }
  if (error != 0) return Status::Invalid("the compressed bytes are damaged");
  if (v.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(decoded.data(), count, stride);
  if (v.filter == "QUATERNION") meshopt_decodeFilterQuat(decoded.data(), count, stride);
  if (v.filter == "EXPONENTIAL") meshopt_decodeFilterExp(decoded.data(), count, stride);
  return decoded;
}

}  // namespace kpsa::engine::gltf
