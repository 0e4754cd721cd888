// The smallest character: a soft column of two joints that bends in its only clip.
#include <cmath>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::engine::scenes {

SceneFiles GenerateHello() {
  constexpr int kAround = 24, kRows = 32;
  constexpr double kHeight = 0.4, kRadius = 0.05;  // metres
  GlbScene scene;
  scene.nodes = {{"lower", -1, {}, -1}, {"upper", 0, {0, kHeight / 2, 0}, -1}, {"column", -1, {}, 0}};
  scene.joints = {0, 1};
  GlbMesh mesh;
  mesh.name = "column";
  std::vector<std::array<int, 4>> quads;
  const auto add = [&](Double3 p) {
    mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    const double upper =
        Smooth(0.42, 0.58, p.y / kHeight);  // a tight elbow, so that smoothing has work to do
    const double weights[] = {1 - upper, upper};
    mesh.influences.push_back(MakeInfluences(weights));
  };
  add({0, 0, 0});
  for (int row = 0; row <= kRows; ++row) {
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * kPi * k / kAround;
      add({kRadius * Sin(angle), kHeight * row / kRows, kRadius * Cos(angle)});
    }
  }
  add({0, kHeight, 0});
  const int top = static_cast<int>(mesh.positions.size()) - 1;
  for (int k = 0; k < kAround; ++k) {
    const int next = (k + 1) % kAround;
    quads.push_back({0, 1 + next, 1 + k, 1 + k});
    for (int row = 0; row < kRows; ++row) {
      const int a = 1 + row * kAround, b = a + kAround;
      quads.push_back({a + k, a + next, b + next, b + k});
    }
    const int last = 1 + kRows * kAround;
    quads.push_back({last + k, last + next, top, top});
  }
  mesh.triangles = Triangulate(quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  scene.meshes = {mesh};

  constexpr int kFrames = 49;
  GlbChannel bend = {1, false, {}};
  for (int f = 0; f < kFrames; ++f) {
    const double phase = 2 * kPi * f / (kFrames - 1);
    const Double3 turn = {0.5 * Sin(2 * phase), 0, -1.3 * (0.5 - 0.5 * Cos(phase))};
    const Quaternion q = QuaternionFromRotation(RotationFromEuler(turn, RotateOrder::kXyz));
    for (double v : {q.x, q.y, q.z, q.w}) bend.values.push_back(static_cast<float>(v));
  }
  scene.clips = {{"wave", kFrames, {bend}}};
  return {{"hello.glb", WriteGlb(scene)}};
}

}  // namespace kpsa::engine::scenes
