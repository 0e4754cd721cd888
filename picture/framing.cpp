#include "picture/framing.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/vertex_choice.h"

namespace kpsa::engine {
namespace {

// The chosen vertices in all poses, as points without triangles.
Result<RenderInput> PointsOf(const Rig& rig, const std::vector<Pose>& poses, const std::string& fit) {
  std::vector<MeshVertices> chosen;
  if (Result<NamedVertices> named = FindVertices(rig, fit); named.ok()) {
    chosen = std::move(named->meshes);
  } else if (fit == "face") {
    Result<std::vector<MeshVertices>> face = FaceVertices(rig);
    if (!face.ok()) return face.status();
    chosen = std::move(*face);
  } else {
    return named.status();
  }
  auto points = std::make_shared<std::vector<float>>();
  for (const Pose& pose : poses) {
    for (const MeshVertices& one : chosen) {
      const std::vector<float>& xyz = pose[one.mesh];
      if (xyz.empty()) continue;  // not shown
      const std::vector<Index>& point_of = rig.scene.meshes[one.mesh].mesh().data().vertex_to_point;
      for (Index v : one.vertices) {
        for (std::size_t k = 0; k < 3; ++k) points->push_back(xyz[3 * std::size_t{point_of[v]} + k]);
      }
    }
  }
  if (points->empty()) return Status::Usage("\"{}\" is of no mesh that is shown", fit);
  RenderInput input;
  RenderPart part;
  part.points = *points, part.owner = points;
  input.parts.push_back(part);
  return input;
}

}  // namespace

Result<std::vector<std::size_t>> ChooseMeshes(const Rig& rig, std::span<const std::string> names) {
  if (names.empty()) return ShownMeshes(rig.scene);
  std::vector<std::string> known;
  for (const CharacterMesh& mesh : rig.scene.meshes) known.push_back(mesh.name);
  std::vector<std::size_t> meshes;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end())
      return Status::Usage("no mesh is called \"{}\"{}", name, DidYouMean(name, known)).At({"--mesh"});
    meshes.push_back(static_cast<std::size_t>(at - known.begin()));
  }
  std::sort(meshes.begin(), meshes.end());
  meshes.erase(std::unique(meshes.begin(), meshes.end()), meshes.end());
  return meshes;
}

Result<std::vector<Camera>> FrameRig(const Rig& rig, const std::vector<Pose>& poses,
                                     const RenderOptions& options, const Framing& framing, int around) {
  RenderInput seen;
  if (framing.fit.has_value()) {
    Result<RenderInput> points = PointsOf(rig, poses, *framing.fit);
    if (!points.ok()) return Status(points.status()).At({"--fit"});
    seen = std::move(*points);
  } else {
    for (const Pose& pose : poses) {
      for (const std::vector<float>& points : pose) seen.parts.emplace_back().points = points;
    }
  }
  std::vector<Camera> cameras =
      around > 0 ? FrameAround(seen, options, around, framing.elevation)
                 : std::vector<Camera>{FrameCamera(seen, options, framing.azimuth, framing.elevation)};
  for (Camera& camera : cameras) {
    if (framing.look_at.has_value()) {
      camera.eye = camera.eye + (*framing.look_at - camera.target);
      camera.target = *framing.look_at;
    }
    // Nearer by a longer lens, so that nothing comes before the camera; farther by going back
    if (framing.zoom > 1) {
      camera.field_of_view = 2 * std::atan(std::tan(camera.field_of_view / 2) / framing.zoom);
    } else {
      camera.eye = camera.target + (camera.eye - camera.target) * (1 / framing.zoom);
    }
  }
  return cameras;
}

}  // namespace kpsa::engine
