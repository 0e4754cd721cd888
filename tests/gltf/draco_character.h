// A character whose sheet is compressed by Draco's encoder.
#pragma once

#include <draco/compression/expert_encode.h>
#include <draco/metadata/geometry_metadata.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/rig/grid_character.h"

namespace kpsa::engine {

// The sheet as Draco's mesh, and the document that holds it compressed.
class DracoCharacter {
 public:
  explicit DracoCharacter(std::size_t n, int method, int position_bits = 0, std::size_t metadata_bytes = 0)
      : grid(n) {
    mesh_.set_num_points(static_cast<std::uint32_t>(grid.vertex_count));
    position = Add(draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, 3, grid.positions.data(), 12);
    color = Add(draco::GeometryAttribute::COLOR, draco::DT_UINT8, 4, grid.colors.data(), 4);
    uvs = Add(draco::GeometryAttribute::TEX_COORD, draco::DT_FLOAT32, 2, grid.uvs.data(), 8);
    normals = Add(draco::GeometryAttribute::NORMAL, draco::DT_FLOAT32, 3, grid.normals.data(), 12);
    joints = Add(draco::GeometryAttribute::GENERIC, draco::DT_UINT8, 4, grid.joints.data(), 4);
    weights = Add(draco::GeometryAttribute::GENERIC, draco::DT_FLOAT32, 4, grid.weights.data(), 16);
    for (std::size_t i = 0; i < grid.indices.size(); i += 3) {
      mesh_.AddFace({draco::PointIndex(grid.indices[i]), draco::PointIndex(grid.indices[i + 1]),
                     draco::PointIndex(grid.indices[i + 2])});
    }
    if (metadata_bytes > 0) {
      auto metadata = std::make_unique<draco::GeometryMetadata>();
      metadata->AddEntryString("note", std::string(metadata_bytes, 'x'));
      mesh_.AddMetadata(std::move(metadata));
    }
    draco::ExpertEncoder encoder(mesh_);
    encoder.SetEncodingMethod(method);
    if (position_bits > 0) encoder.SetAttributeQuantization(position, position_bits);
    draco::EncoderBuffer encoded;
    const draco::Status status = encoder.EncodeToBuffer(&encoded);
    EXPECT_TRUE(status.ok()) << status.error_msg_string();
    data.assign(encoded.data(), encoded.data() + encoded.size());
  }

  // Unique ids: those of POSITION, COLOR_0, TEXCOORD_0, NORMAL, JOINTS_0 and WEIGHTS_0.
  nlohmann::json Ids() const {
    const auto id = [&](int attribute) { return mesh_.attribute(attribute)->unique_id(); };
    return {{"POSITION", id(position)}, {"COLOR_0", id(color)},   {"TEXCOORD_0", id(uvs)},
            {"NORMAL", id(normals)},    {"JOINTS_0", id(joints)}, {"WEIGHTS_0", id(weights)}};
  }
  // The document; what Draco holds has no view of its own.
  GltfBuilder Document() {
    GltfBuilder b = grid.builder;
    const int view = b.View(data);
    for (const int accessor :
         {grid.position, grid.color, grid.uv, grid.normal, grid.joint, grid.weight, grid.index})
      b.root["accessors"][static_cast<std::size_t>(accessor)].erase("bufferView");
    b.root["meshes"][0]["primitives"][0]["extensions"] = {
        {"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", Ids()}}}};
    b.root["extensionsUsed"] = b.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    return b;
  }

  GridCharacter grid;
  std::vector<std::uint8_t> data;
  int position = 0, color = 0, uvs = 0, normals = 0, joints = 0, weights = 0;

 private:
  int Add(draco::GeometryAttribute::Type type, draco::DataType data_type, int components, const void* values,
          std::size_t stride) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, static_cast<std::uint8_t>(components), data_type, false,
                   static_cast<std::int64_t>(stride), 0);
    const auto points = static_cast<std::uint32_t>(grid.vertex_count);
    const int id = mesh_.AddAttribute(attribute, true, points);
    for (std::uint32_t i = 0; i < points; ++i) {
      mesh_.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                             static_cast<const char*>(values) + i * stride);
    }
    return id;
  }
  draco::Mesh mesh_;
};

}  // namespace kpsa::engine
