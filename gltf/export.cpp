#include "gltf/export.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/check.h"
#include "files/file.h"
#include "gltf/frame_shapes.h"

namespace kpsa::engine {
namespace {

using json = nlohmann::ordered_json;

// The document and its binary chunk while they grow.
struct Glb {
  json root = {{"asset", {{"version", "2.0"}, {"generator", "kpsa"}}}};
  std::vector<std::uint8_t> bytes;

  int AddAccessor(const void* data, std::size_t size, int component_type, const char* type,
                  std::size_t count) {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}});
    const auto* begin = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
    root["accessors"].push_back({{"bufferView", root["bufferViews"].size() - 1},
                                 {"componentType", component_type},
                                 {"type", type},
                                 {"count", count}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }

  // POSITION data needs its bounds.
  int AddVectors(const float* xyz, std::size_t count) {
    const int accessor = AddAccessor(xyz, count * 12, 5126, "VEC3", count);
    json low = json::array(), high = json::array();
    for (std::size_t c = 0; c < 3; ++c) {
      float least = xyz[c], most = xyz[c];
      for (std::size_t i = 0; i < count; ++i)
        least = std::min(least, xyz[3 * i + c]), most = std::max(most, xyz[3 * i + c]);
      low.push_back(least), high.push_back(most);
    }
    root["accessors"].back()["min"] = low;
    root["accessors"].back()["max"] = high;
    return accessor;
  }

  int AddNumbers(const std::vector<float>& values) {
    return AddAccessor(values.data(), values.size() * 4, 5126, "SCALAR", values.size());
  }
};

void AddMesh(const PointCacheMesh& mesh, const FrameShapes& shapes, int times_accessor, Glb* glb) {
  json primitive = {{"attributes", {{"POSITION", glb->AddVectors(shapes.rest.data(), mesh.vertex_count)}}}};
  if (mesh.triangles.empty()) {
    primitive["mode"] = 0;
  } else {
    primitive["indices"] = glb->AddAccessor(mesh.triangles.data(), mesh.triangles.size() * 4, 5125, "SCALAR",
                                            mesh.triangles.size());
  }
  for (Eigen::Index k = 0; k < shapes.shapes.cols(); ++k) {
    const Eigen::VectorXf shape = shapes.shapes.col(k);
    primitive["targets"].push_back({{"POSITION", glb->AddVectors(shape.data(), mesh.vertex_count)}});
  }
  const std::size_t node = glb->root["nodes"].size();
  json out = {{"name", mesh.name}, {"primitives", {primitive}}};
  if (shapes.shapes.cols() > 0) {
    // Row by row: all weights of the first key, then of the second
    std::vector<float> values;
    for (Eigen::Index t = 0; t < shapes.weights.rows(); ++t) {
      for (Eigen::Index k = 0; k < shapes.weights.cols(); ++k) values.push_back(shapes.weights(t, k));
    }
    json& animation = glb->root["animations"][0];
    animation["samplers"].push_back({{"input", times_accessor}, {"output", glb->AddNumbers(values)}});
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", "weights"}}}});
    out["weights"] = std::vector<float>(values.begin(), values.begin() + shapes.weights.cols());
  }
  glb->root["meshes"].push_back(out);
  glb->root["nodes"].push_back({{"name", mesh.name}, {"mesh", glb->root["meshes"].size() - 1}});
  glb->root["scene"] = 0;
  glb->root["scenes"][0]["nodes"].push_back(node);
}

Status WriteContainer(const std::string& path, bool force, Glb glb) {
  if (!glb.bytes.empty()) glb.root["buffers"].push_back({{"byteLength", glb.bytes.size()}});
  std::string text = glb.root.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  glb.bytes.resize((glb.bytes.size() + 3) / 4 * 4, 0);
  const std::uint64_t total = 12 + 8 + text.size() + (glb.bytes.empty() ? 0 : 8 + glb.bytes.size());
  if (total > 0xffffffffu)
    return Status::Invalid("would have {} bytes, .glb holds at most 4 GB", total).At({path});
  std::vector<std::uint8_t> head;
  const auto put = [&](std::uint64_t word) {
    for (int i = 0; i < 4; ++i) head.push_back(static_cast<std::uint8_t>(word >> (8 * i)));
  };
  put(0x46546c67), put(2), put(total), put(text.size()), put(0x4e4f534a);
  head.insert(head.end(), text.begin(), text.end());
  if (!glb.bytes.empty()) put(glb.bytes.size()), put(0x004e4942);
  return WriteFileAtomically(path, force, [&](const ByteSink& sink) -> Status {
    KPSA_RETURN_IF_ERROR(sink(head));
    return sink(glb.bytes);
  });
}

double Diagonal(const PointCache& cache) {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
  bool any = false;
  for (const PointCacheMesh& mesh : cache.meshes) {
    for (std::size_t i = 0; i < mesh.frames.size(); ++i) {
      low[i % 3] = std::min<double>(low[i % 3], mesh.frames[i]);
      high[i % 3] = std::max<double>(high[i % 3], mesh.frames[i]);
      any = true;
    }
  }
  return any ? std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) : 0;
}

}  // namespace

Result<MorphGlbReport> WriteMorphGlb(const std::string& path, const PointCache& cache,
                                     const MorphGlbOptions& options) {
  std::vector<float> times;
  const double shift = cache.times.empty() ? 0 : std::min(cache.times.front(), 0.0);
  for (const double time : cache.times) {
    const auto value = static_cast<float>(time - shift);
    if (!times.empty() && value <= times.back()) {
      return Status::Invalid("cannot be written: glTF wants times that ascend, {} s follows {} s", value,
                             times.back())
          .At({path});
    }
    times.push_back(value);
  }
  MorphGlbReport report;
  report.diagonal = Diagonal(cache);
  Glb glb;
  const int times_accessor = times.size() > 1 ? glb.AddNumbers(times) : -1;
  if (times.size() > 1) {
    glb.root["accessors"].back()["min"] = {times.front()};
    glb.root["accessors"].back()["max"] = {times.back()};
  }
  double square_sum = 0, count = 0;
  for (const PointCacheMesh& mesh : cache.meshes) {
    KPSA_CHECK_EQ(mesh.frames.size(), times.size() * mesh.vertex_count * 3);
    report.targets.push_back(0);
    if (mesh.frames.empty()) continue;
    for (const float value : mesh.frames) {
      if (!std::isfinite(value))
        return Status::Invalid("mesh \"{}\" has points that are not finite", mesh.name).At({path});
    }
    const FrameShapes shapes = ShapesOfFrames(mesh, times.size(), options.tolerance * report.diagonal,
                                              std::max(options.max_targets, 0));
    report.targets.back() = static_cast<int>(shapes.shapes.cols());
    report.max_residual = std::max(report.max_residual, shapes.max_residual);
    square_sum += shapes.square_sum;
    count += static_cast<double>(mesh.frames.size() / 3);
    AddMesh(mesh, shapes, times_accessor, &glb);
  }
  if (count > 0) report.rms_residual = std::sqrt(square_sum / count);
  KPSA_RETURN_IF_ERROR(WriteContainer(path, options.force, std::move(glb)));
  return report;
}

}  // namespace kpsa::engine
