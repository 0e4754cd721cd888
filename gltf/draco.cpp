// KHR_draco_mesh_compression, by Draco. Its decoder checks indices and the ends of its data, but allocates
// what the data ask for: sizes are looked at before each of its two stages.
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>

#include <cstring>
#include <new>
#include <type_traits>

#include "gltf/compressed.h"

namespace kpsa::engine::gltf {
namespace {

// What a decoder may allocate for so many bytes. Draco takes a few hundred bytes a face, and writes a face in
// half a byte and more.
std::uint64_t MemoryFor(std::size_t bytes) { return (std::uint64_t{64} << 20) + std::uint64_t{512} * bytes; }
// Tables of corners, vertices and seams, in bytes a face; and of a decoded attribute, in bytes a point.
constexpr std::uint64_t kBytesOfFace = 200, kBytesOfSeams = 40, kBytesOfPoint = 32, kBytesOfComponent = 16;

struct DracoLimits {
  std::uint64_t memory = 0;
  std::size_t points = 0, most_indices = 0;
};

// A decoder of Draco that stops where it would allocate too much. (Members of a template's base need this->.)
template <typename Base>
class Limited final : public Base {
 public:
  explicit Limited(const DracoLimits& limits) : limits_(limits) {}
  const Status& refusal() const { return refusal_; }
  std::uint64_t memory() const { return memory_; }

 protected:
  bool DecodeConnectivity() override {
    if (this->bitstream_version() != DRACO_BITSTREAM_VERSION(2, 2))
      return Refuse(Status::Invalid("is no Draco bitstream of version 2.2"));
    draco::DecoderBuffer ahead = *this->buffer();
    std::uint32_t points = 0, faces = 0;
    std::uint8_t seams = 0;
    bool good = true;
    if constexpr (std::is_same_v<Base, draco::MeshSequentialDecoder>) {
      good = draco::DecodeVarint(&faces, &ahead) && draco::DecodeVarint(&points, &ahead);
    } else {
      good =
          draco::DecodeVarint(&points, &ahead) && draco::DecodeVarint(&faces, &ahead) && ahead.Decode(&seams);
    }
    if (!good) return false;
    if (points > limits_.points || faces > limits_.most_indices / 3) {
      return Refuse(Status::Invalid("has {} vertices and {} triangles, the accessors have room for {} and {}",
                                    points, faces, limits_.points, limits_.most_indices / 3));
    }
    return Fits(faces * (kBytesOfFace + kBytesOfSeams * seams) + kBytesOfPoint * points) &&
           Base::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    const draco::PointCloud* cloud = this->point_cloud();
    if (cloud->num_points() != limits_.points) {
      return Refuse(Status::Invalid("decodes to {} vertices, the accessors say {}", cloud->num_points(),
                                    limits_.points));
    }
    std::uint64_t bytes = 0;
    for (int i = 0; i < cloud->num_attributes(); ++i)
      bytes += kBytesOfPoint + kBytesOfComponent * cloud->attribute(i)->num_components();
    return Fits(bytes * limits_.points) && Base::DecodeAllAttributes();
  }

 private:
  bool Refuse(Status status) {
    refusal_ = std::move(status);
    return false;
  }
  bool Fits(std::uint64_t bytes) {
    memory_ += bytes;
    return memory_ <= limits_.memory ||
           Refuse(Status::Invalid("would decode {} bytes, far more than its data can fill", memory_));
  }
  const DracoLimits limits_;
  std::uint64_t memory_ = 0;
  Status refusal_;
};

template <typename Base>
Status DecodeBy(const DracoLimits& limits, draco::DecoderBuffer* buffer, draco::Mesh* mesh,
                std::uint64_t* memory) {
  Limited<Base> decoder(limits);
  const draco::DecoderOptions options;
  const draco::Status status = decoder.Decode(options, buffer, mesh);
  *memory = decoder.memory();
  if (!decoder.refusal().ok()) return decoder.refusal();
  if (!status.ok()) return Status::Invalid("is damaged: {}", status.error_msg_string());
  return {};
}

template <typename T>
bool ConvertValues(const draco::PointAttribute& from, std::size_t points, DracoAttribute* to) {
  const std::size_t size = static_cast<std::size_t>(to->components) * sizeof(T);
  T value[16];
  to->values.resize(points * size);
  for (std::size_t p = 0; p < points; ++p) {
    const draco::AttributeValueIndex at = from.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(p)));
    if (at.value() >= from.size() ||
        !from.ConvertValue<T>(at, static_cast<std::int8_t>(to->components), value))
      return false;
    std::memcpy(&to->values[p * size], value, size);
  }
  return true;
}

bool ConvertTo(const draco::PointAttribute& from, std::size_t points, DracoAttribute* to) {
  switch (to->component_type) {
    case 5120:
      return ConvertValues<std::int8_t>(from, points, to);
    case 5121:
      return ConvertValues<std::uint8_t>(from, points, to);
    case 5122:
      return ConvertValues<std::int16_t>(from, points, to);
    case 5123:
      return ConvertValues<std::uint16_t>(from, points, to);
    case 5125:
      return ConvertValues<std::uint32_t>(from, points, to);
    case 5126:
      return ConvertValues<float>(from, points, to);
    default:
      return false;
  }
}

Status ReadDracoAttribute(const draco::Mesh& mesh, std::size_t points, DracoAttribute* to) {
  const draco::PointAttribute* from = mesh.GetAttributeByUniqueId(to->unique_id);
  if (from == nullptr) return Status::Invalid("has no attribute {} for {}", to->unique_id, to->name);
  if (from->num_components() != to->components || to->components > 16) {
    return Status::Invalid("has {} components of {}, its accessor has {}", from->num_components(), to->name,
                           to->components);
  }
  const draco::DataType type = from->data_type();
  const bool known = (type >= draco::DT_INT8 && type <= draco::DT_UINT32) || type == draco::DT_FLOAT32;
  const bool mapped =
      from->buffer() != nullptr && (from->is_mapping_identity() || from->indices_map_size() >= points);
  if (!known || !mapped || !ConvertTo(*from, points, to)) {
    return Status::Invalid("has values of {} that do not fit its accessor's component type {}", to->name,
                           to->component_type);
  }
  return {};
}

Status DecodeMesh(std::span<const std::uint8_t> data, DracoMesh* out) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(data.data()), data.size());
  draco::DracoHeader header;
  draco::DecoderBuffer ahead = buffer;
  if (!draco::PointCloudDecoder::DecodeHeader(&ahead, &header).ok())
    return Status::Invalid("does not begin as Draco data do");
  if (header.encoder_type != draco::TRIANGULAR_MESH) return Status::Invalid("is no Draco mesh of triangles");

  const DracoLimits limits{MemoryFor(data.size()), out->points, out->most_indices};
  draco::Mesh mesh;
  if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
    KPSA_RETURN_IF_ERROR(DecodeBy<draco::MeshSequentialDecoder>(limits, &buffer, &mesh, &out->memory));
  } else if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
    KPSA_RETURN_IF_ERROR(DecodeBy<draco::MeshEdgebreakerDecoder>(limits, &buffer, &mesh, &out->memory));
  } else {
    return Status::Invalid("is encoded by an unknown method {}", header.encoder_method);
  }
  for (DracoAttribute& attribute : out->attributes)
    KPSA_RETURN_IF_ERROR(ReadDracoAttribute(mesh, out->points, &attribute));
  out->triangles.reserve(3 * static_cast<std::size_t>(mesh.num_faces()));
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    for (const draco::PointIndex& point : mesh.face(draco::FaceIndex(f)))
      out->triangles.push_back(point.value());
  }
  return {};
}

}  // namespace

Status DecodeDraco(std::span<const std::uint8_t> data, DracoMesh* mesh) {
  try {
    return DecodeMesh(data, mesh);
  } catch (const std::exception& exception) {
    return Status::Invalid("cannot be decoded: {}", exception.what());
  }
}

}  // namespace kpsa::engine::gltf
