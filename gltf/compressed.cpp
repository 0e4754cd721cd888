#include "gltf/compressed.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cstring>
#include <tuple>

#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

// Decoded bytes that are kept, for each byte of the file: meshoptimizer's most. Draco keeps less than that
// of what it decodes.
constexpr std::uint64_t kMostDecoded = 64;
constexpr std::uint64_t kFreeDecoded = std::uint64_t{64} << 20;
// Compressed bytes of Draco that are read, for each byte of the file: views may overlap, primitives may ask
// the same view for something else, and what a decoder reads besides points and faces (metadata) counts
// nowhere else.
constexpr std::uint64_t kMostRead = 4;
constexpr std::uint64_t kFreeRead = std::uint64_t{8} << 20;

class Decompressor {
 public:
  Decompressor(tinygltf::Model* model, Document* document) : model_(*model), document_(*document) {
    for (const auto& buffer : document->buffers) {
      room_ += kMostDecoded * buffer.size();
      unread_ += kMostRead * buffer.size();
    }
  }

  Status AddView(const MeshoptView& v) {
    tinygltf::BufferView& view = model_.bufferViews[v.view];
    const std::string where = fmt::format("bufferViews[{}].extensions.EXT_meshopt_compression", v.view);
    if (view.byteLength != v.count * v.stride) {
      return Status::Invalid("{}: {} elements of {} bytes, but the view has {} bytes", where, v.count,
                             v.stride, view.byteLength);
    }
    if (view.byteStride != 0 && view.byteStride != v.stride)
      return Status::Invalid("{}: byteStride is {}, the view's is {}", where, v.stride, view.byteStride);
    std::span<const std::uint8_t> data;
    KPSA_RETURN_IF_ERROR(Range(v.buffer, v.offset, v.length, where, &data));
    KPSA_RETURN_IF_ERROR(TakeRoom(view.byteLength, where));
    Result<std::vector<std::uint8_t>> decoded = DecodeMeshopt(v, data);
    if (!decoded.ok()) return Status::Invalid("{}: {}", where, decoded.status().errors().front().message);
    view.buffer = AddBuffer(std::move(*decoded));
    view.byteOffset = 0;
    return {};
  }

  Status AddPrimitive(const DracoPrimitive& p) {
    tinygltf::Primitive& primitive = model_.meshes[p.mesh].primitives[p.primitive];
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) return {};  // no vertices
    const std::string where =
        fmt::format("meshes[{}].primitives[{}].extensions.KHR_draco_mesh_compression", p.mesh, p.primitive);
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != TINYGLTF_MODE_TRIANGLE_STRIP)
      return Status::Invalid("{}: the primitive's mode is {}, expected 4 or 5", where, primitive.mode);
    const std::size_t points = AccessorOf(position->second).count;
    DracoMesh mesh;
    mesh.points = points;
    mesh.most_indices =
        primitive.indices < 0 ? 3 * std::size_t{kNoIndex} : AccessorOf(primitive.indices).count;
    for (const auto& [name, id] : p.attributes) {
      const auto found = primitive.attributes.find(name);
      if (found == primitive.attributes.end() || !IsRead(name)) continue;
      const tinygltf::Accessor& accessor = AccessorOf(found->second);
      if (accessor.count != points) {
        return Status::Invalid("{}: the accessor of {} has {} elements, that of POSITION {}", where, name,
                               accessor.count, points);
      }
      DracoAttribute attribute;
      attribute.name = name;
      attribute.unique_id = id;
      attribute.component_type = accessor.componentType;
      attribute.components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
      mesh.attributes.push_back(std::move(attribute));
    }
    const tinygltf::BufferView& view = model_.bufferViews[p.view];
    std::span<const std::uint8_t> data;
    KPSA_RETURN_IF_ERROR(
        Range(static_cast<std::size_t>(view.buffer), view.byteOffset, view.byteLength, where, &data));
    if (points >= kNoIndex) return Status::Invalid("{} has {} vertices", where, points);
    const auto [it, added] = decoded_.try_emplace(RequestOf(p.view, mesh));
    if (added) KPSA_RETURN_IF_ERROR(Decode(data, std::move(mesh), where, &it->second));
    const Decoded& decoded = it->second;
    if (primitive.indices >= 0 && decoded.indices < AccessorOf(primitive.indices).count)
      ++primitives_with_fewer_;
    for (const auto& [name, values] : decoded.values) {
      int& accessor = primitive.attributes[name];
      accessor = AddAccessor(AccessorOf(accessor), points, values);
    }
    tinygltf::Accessor indices;
    indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    indices.type = TINYGLTF_TYPE_SCALAR;
    primitive.indices = AddAccessor(indices, decoded.indices, decoded.triangles);
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    return {};
  }

  void Finish() {
    if (primitives_with_fewer_ == 0) return;
    document_.warnings.push_back(fmt::format(
        "{} primitive(s) decode by KHR_draco_mesh_compression to fewer triangles than their accessors say",
        primitives_with_fewer_));
  }

 private:
  // What a primitive asks for: a view, points, the most indices, and of each attribute its name, id,
  // component type and components. Primitives that ask for the same share what it decodes to.
  using Request = std::tuple<std::size_t, std::size_t, std::size_t,
                             std::vector<std::tuple<std::string, std::uint32_t, int, int>>>;
  static Request RequestOf(std::size_t view, const DracoMesh& mesh) {
    Request request{view, mesh.points, mesh.most_indices, {}};
    for (const DracoAttribute& a : mesh.attributes)
      std::get<3>(request).emplace_back(a.name, a.unique_id, a.component_type, a.components);
    return request;
  }
  struct Decoded {
    std::vector<std::pair<std::string, int>> values;  // views of the attributes, by glTF name
    int triangles = 0;                                // view
    std::size_t indices = 0;
  };
  Status Decode(std::span<const std::uint8_t> data, DracoMesh mesh, const std::string& where,
                Decoded* decoded) {
    if (data.size() > unread_)
      return Status::Invalid("{}: too many primitives share compressed bytes", where);
    unread_ -= data.size();
    if (Status status = DecodeDraco(data, &mesh); !status.ok())
      return Status::Invalid("{} {}", where, status.errors().front().message);
    std::uint64_t size = 4 * mesh.triangles.size();
    for (const DracoAttribute& attribute : mesh.attributes) size += attribute.values.size();
    KPSA_RETURN_IF_ERROR(document_.budget.TakeWork(size + mesh.memory, where));
    KPSA_RETURN_IF_ERROR(TakeRoom(size, where));
    for (DracoAttribute& attribute : mesh.attributes)
      decoded->values.emplace_back(attribute.name, AddBufferView(std::move(attribute.values)));
    std::vector<std::uint8_t> bytes(4 * mesh.triangles.size());
    if (!bytes.empty()) std::memcpy(bytes.data(), mesh.triangles.data(), bytes.size());
    decoded->triangles = AddBufferView(std::move(bytes));
    decoded->indices = mesh.triangles.size();
    return {};
  }
  // Others are not decoded: nobody asks for them.
  static bool IsRead(const std::string& name) {
    return name == "POSITION" || name == "NORMAL" || name == "COLOR_0" || name.starts_with("TEXCOORD_") ||
           name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
  }
  const tinygltf::Accessor& AccessorOf(int index) const {
    return model_.accessors[static_cast<std::size_t>(index)];
  }
  // Numbers are below 2^53: no sum overflows.
  Status Range(std::size_t buffer, std::uint64_t offset, std::uint64_t length, const std::string& where,
               std::span<const std::uint8_t>* data) const {
    const std::vector<std::uint8_t>& bytes = document_.buffers[buffer];
    if (offset + length > bytes.size()) {
      return Status::Invalid("{}: the compressed bytes end at byte {} of buffers[{}], which has {}", where,
                             offset + length, buffer, bytes.size());
    }
    *data = std::span<const std::uint8_t>(bytes).subspan(static_cast<std::size_t>(offset),
                                                         static_cast<std::size_t>(length));
    return {};
  }
  Status TakeRoom(std::uint64_t bytes, const std::string& where) {
    if (bytes > room_)
      return Status::Invalid("{} would decode {} bytes, far more than the file's own", where, bytes);
    room_ -= bytes;
    document_.budget.memory += 8 * bytes;
    document_.budget.work += 64 * bytes;
    return {};
  }
  int AddBuffer(std::vector<std::uint8_t> bytes) {
    document_.buffers.push_back(std::move(bytes));
    return static_cast<int>(document_.buffers.size() - 1);
  }
  int AddBufferView(std::vector<std::uint8_t> values) {
    tinygltf::BufferView view;
    view.byteLength = values.size();
    view.buffer = AddBuffer(std::move(values));
    model_.bufferViews.push_back(std::move(view));
    return static_cast<int>(model_.bufferViews.size() - 1);
  }
  // A copy of an accessor over all of a view; the old one may have other users.
  int AddAccessor(tinygltf::Accessor accessor, std::size_t count, int view) {
    accessor.bufferView = view;
    accessor.byteOffset = 0;
    accessor.count = count;
    accessor.sparse.isSparse = false;
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size() - 1);
  }

  tinygltf::Model& model_;
  Document& document_;
  std::uint64_t room_ = kFreeDecoded, unread_ = kFreeRead;
  std::map<Request, Decoded> decoded_;
  int primitives_with_fewer_ = 0;
};

}  // namespace

Status Decompress(const std::vector<MeshoptView>& views, const std::vector<DracoPrimitive>& primitives,
                  tinygltf::Model* model, Document* document) {
  Decompressor decompressor(model, document);
  for (const MeshoptView& view : views) KPSA_RETURN_IF_ERROR(decompressor.AddView(view));
  for (const DracoPrimitive& primitive : primitives)
    KPSA_RETURN_IF_ERROR(decompressor.AddPrimitive(primitive));
  decompressor.Finish();
  return {};
}

}  // namespace kpsa::engine::gltf
