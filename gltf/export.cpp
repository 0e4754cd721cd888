#include "gltf/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "files/cache_normals.h"
#include "gltf/frame_shapes.h"
#include "gltf/glb_file.h"
#include "gltf/skin_export.h"
#include "gltf/skin_residual.h"

namespace kpsa::engine {
namespace {

GlbPrimitive Primitive(const PointCacheMesh& mesh, const CachePart& part, const FrameShapes& shapes,
                       const FrameNormals& normals, GlbFile* glb) {
  GlbPrimitive primitive = PrimitiveOfPart(mesh, part, shapes.rest, normals.rest, glb);
  for (std::size_t k = 0; k < shapes.shapes.size(); ++k) {
    const int position = glb->AddPositions(PartRows(shapes.shapes[k], part, 3));
    const int normal = !primitive.has_normals() ? -1 : glb->AddVectors(PartRows(normals.shapes[k], part, 3));
    primitive.targets.push_back({position, normal});
  }
  return primitive;
}

void AddMesh(const PointCacheMesh& mesh, const FrameShapes& shapes, int times_accessor, GlbFile* glb) {
  const FrameNormals normals = NormalsOfFrames(mesh, shapes);
  GlbMesh out{mesh.name, {}, {}, {}};
  for (const CachePart& part : CacheParts(mesh)) {
    if (part.vertex_count > 0) out.primitives.push_back(Primitive(mesh, part, shapes, normals, glb));
  }
  const std::size_t node = glb->AddNode(mesh.name);
  if (!shapes.shapes.empty()) {
    // All weights of the first key, then of the second
    const std::vector<float>& values = shapes.weights;
    glb->AddChannel(times_accessor, glb->AddNumbers(values), node, "weights");
    out.weights.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(shapes.shapes.size()));
    for (std::size_t k = 0; k < shapes.shapes.size(); ++k)
      out.target_names.push_back(fmt::format("shape{}", k + 1));
  }
  glb->SetMesh(node, glb->AddMesh(out));
  glb->AddToScene(node);
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

Result<GlbReport> WriteGlb(const std::string& path, const PointCache& cache, const GlbOptions& options) {
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
  GlbReport report;
  report.diagonal = Diagonal(cache);
  GlbFile glb;
  const int times_accessor = times.size() > 1 ? glb.AddTimes(times) : -1;
  for (const CacheImage& image : cache.images) glb.AddImage(image);
  for (const CacheMaterial& material : cache.materials) glb.AddMaterial(material);
  for (const PointCacheMesh& mesh : cache.meshes) {
    KPSA_CHECK_EQ(mesh.frames.size(), times.size() * mesh.vertex_count * 3);
    for (const float value : mesh.frames) {
      if (!std::isfinite(value))
        return Status::Invalid("mesh \"{}\" has points that are not finite", mesh.name).At({path});
    }
  }
  double square_sum = 0, count = 0;
  const auto measured = [&](const PointCacheMesh& mesh, double max, double squares) {
    report.max_residual = std::max(report.max_residual, max);
    square_sum += squares;
    count += static_cast<double>(mesh.frames.size() / 3);
  };

  // Meshes that glTF moves itself
  static const SkinnedScene kNone;
  const SkinnedScene& scene = options.scene == nullptr ? kNone : *options.scene;
  const std::vector<NodeTrack> tracks = TracksOf(scene);
  std::vector<const CacheSkin*> skins(cache.meshes.size(), nullptr), chosen;
  for (std::size_t m = 0; m < cache.meshes.size() && options.scene != nullptr; ++m) {
    report.reasons.push_back(scene.reasons[m]);
    if (!scene.meshes[m].has_value() || cache.meshes[m].frames.empty()) continue;
    const CacheSkin& skin = *scene.meshes[m];
    if (const CacheNode* sheared = ShearedNode(scene, skin, tracks); sheared != nullptr) {
      report.reasons[m] = fmt::format("is moved by \"{}\", which shears", sheared->name);
      continue;
    }
    const SkinResidual residual = ResidualOf(cache.meshes[m], skin, tracks);
    if (!(residual.max <= options.skin_tolerance * report.diagonal)) {
      report.reasons[m] = fmt::format("is {:.2g} m off with its morph targets and skin alone", residual.max);
      continue;
    }
    measured(cache.meshes[m], residual.max, residual.square_sum);
    for (std::size_t v = 0; v + 1 < skin.offsets.size(); ++v)
      report.most_joints =
          std::max(report.most_joints, static_cast<int>(skin.offsets[v + 1] - skin.offsets[v]));
    for (const double weight : skin.weights) {
      report.least_weight = std::min(report.least_weight, weight);
      report.most_weight = std::max(report.most_weight, weight);
    }
    skins[m] = &skin;
    chosen.push_back(&skin);
  }
  for (std::size_t m = 0; m < report.reasons.size() && options.only_scene; ++m) {
    if (report.reasons[m].empty()) continue;
    return Status::Usage("mesh \"{}\" {}", cache.meshes[m].name, report.reasons[m]).At({path});
  }
  SkinExport exported(scene, tracks, times_accessor, &glb);
  exported.AddNodes(chosen);

  for (std::size_t m = 0; m < cache.meshes.size(); ++m) {
    const PointCacheMesh& mesh = cache.meshes[m];
    report.targets.push_back(0);
    if (mesh.frames.empty()) continue;
    if (skins[m] != nullptr) {
      exported.AddMesh(mesh, *skins[m]);
      report.targets.back() = static_cast<int>(skins[m]->targets.size());
      ++report.skinned;
      continue;
    }
    const FrameShapes shapes = ShapesOfFrames(mesh, times.size(), options.tolerance * report.diagonal,
                                              std::max(options.max_targets, 0));
    report.targets.back() = static_cast<int>(shapes.shapes.size());
    report.morphed_targets = std::max(report.morphed_targets, report.targets.back());
    measured(mesh, shapes.max_residual, shapes.square_sum);
    AddMesh(mesh, shapes, times_accessor, &glb);
  }
  if (count > 0) report.rms_residual = std::sqrt(square_sum / count);
  glb.NameAnimation(cache.clip);
  KPSA_RETURN_IF_ERROR(glb.Write(path, options.force));
  return report;
}

}  // namespace kpsa::engine
