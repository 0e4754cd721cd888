// A coloured room with a figure that moves and a lamp that swings: light after bounces.
#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "scenes/face_model.h"
#include "scenes/head_shape.h"

namespace kpsa::engine::scenes {
namespace {

enum Joint { kHips, kChest, kHead, kShoulderL, kElbowL, kShoulderR, kElbowR, kLampArm, kRoom, kJoints };

Float3 Float(Double3 p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

Influences Rigid(Joint joint) {
  std::array<double, kJoints> weights = {};
  weights[joint] = 1;
  return MakeInfluences(weights);
}

void Finish(std::vector<std::array<int, 4>> quads, GlbMesh* mesh, GlbScene* scene) {
  mesh->triangles = Triangulate(quads);
  mesh->normals = SmoothNormals(mesh->positions, mesh->triangles);
  scene->nodes.push_back({mesh->name, -1, {}, static_cast<int>(scene->meshes.size())});
  scene->meshes.push_back(std::move(*mesh));
}

// A wall that does not move, from one corner along two edges, with a grid of `cells` squares each way.
void AddWall(const char* name, Float3 color, Double3 corner, Double3 u, Double3 v, GlbScene* scene) {
  constexpr int kCells = 8;
  GlbMesh mesh;
  mesh.name = name;
  mesh.base_color = color;
  std::vector<std::array<int, 4>> quads;
  for (int row = 0; row <= kCells; ++row) {
    for (int column = 0; column <= kCells; ++column) {
      mesh.positions.push_back(Float(corner + u * (1.0 * column / kCells) + v * (1.0 * row / kCells)));
      mesh.influences.push_back(Rigid(kRoom));
      const int a = row * (kCells + 1) + column, b = a + kCells + 1;
      if (row < kCells && column < kCells) quads.push_back({a, a + 1, b + 1, b});
    }
  }
  Finish(std::move(quads), &mesh, scene);
}

// Corners of each side of its own, so that its edges are hard.
void AddBox(const char* name, Float3 color, Double3 low, Double3 high, GlbScene* scene) {
  GlbMesh mesh;
  mesh.name = name;
  mesh.base_color = color;
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  std::vector<std::array<int, 4>> quads;
  for (const auto& side : kSides) {
    const int first = static_cast<int>(mesh.positions.size());
    for (const int i : side) {
      mesh.positions.push_back(
          Float({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z}));
      mesh.influences.push_back(Rigid(kRoom));
    }
    quads.push_back({first, first + 1, first + 2, first + 3});
  }
  Finish(std::move(quads), &mesh, scene);
}

// A limb with rounded ends from a to b; weights(t) gives those of the joints at t of the way.
template <typename Weights>
void AddLimb(Double3 a, Double3 b, double radius_a, double radius_b, Weights weights, GlbMesh* mesh,
             std::vector<std::array<int, 4>>* quads) {
  constexpr int kRings = 20, kAround = 16;
  const Double3 along = (b - a) * (1 / Length(b - a)),
                helper = std::fabs(along.y) < 0.9 ? Double3{0, 1, 0} : Double3{0, 0, 1};
  const Double3 x = Cross(helper, along) * (1 / Length(Cross(helper, along))), y = Cross(along, x);
  const int first = static_cast<int>(mesh->positions.size());
  for (int ring = 0; ring <= kRings; ++ring) {
    const double t = static_cast<double>(ring) / kRings, end = std::fabs(2 * t - 1);
    const double round = std::sqrt(std::max(0.0, 1 - end * end * end * end)),
                 radius = std::max(1e-4, (radius_a + (radius_b - radius_a) * t) * round);
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * kPi * k / kAround;
      mesh->positions.push_back(
          Float(a + (b - a) * t + x * (radius * Cos(angle)) + y * (radius * Sin(angle))));
      const std::array<double, kJoints> w = weights(t);
      mesh->influences.push_back(MakeInfluences(w));
      const int next = (k + 1) % kAround, from = first + ring * kAround;
      if (ring < kRings) quads->push_back({from + k, from + next, from + kAround + next, from + kAround + k});
    }
  }
}

std::array<double, kJoints> Between(Joint a, Joint b, double share) {
  std::array<double, kJoints> weights = {};
  weights[a] = 1 - share, weights[b] = share;
  return weights;
}

void AddFigure(GlbScene* scene) {
  GlbMesh mesh;
  mesh.name = "figure";
  mesh.base_color = {0.85f, 0.72f, 0.35f};
  std::vector<std::array<int, 4>> quads;
  AddLimb(
      {0, 0.05, 0}, {0, 1.15, 0}, 0.34, 0.24,
      [](double t) { return Between(kHips, kChest, Smooth(0.35, 0.65, t)); }, &mesh, &quads);
  AddLimb(
      {0, 1.08, 0}, {0, 1.6, 0}, 0.2, 0.2,
      [](double t) { return Between(kChest, kHead, Smooth(0.05, 0.35, t)); }, &mesh, &quads);
  for (const double side : {1.0, -1.0}) {
    const Joint shoulder = side > 0 ? kShoulderL : kShoulderR, elbow = side > 0 ? kElbowL : kElbowR;
    AddLimb(
        {0.16 * side, 0.98, 0}, {0.95 * side, 0.98, 0}, 0.11, 0.08,
        [&](double t) { return Between(shoulder, elbow, Smooth(0.45, 0.6, t)); }, &mesh, &quads);
  }
  Finish(std::move(quads), &mesh, scene);
}

// Turns of a joint over the frames of a clip: an angle about an axis each.
template <typename Angle>
GlbChannel Turning(int node, int frames, Double3 axis, Angle angle) {
  GlbChannel channel{node, false, {}};
  for (int f = 0; f < frames; ++f) {
    double sine, cosine;
    SinCos(angle(static_cast<double>(f) / (frames - 1)) / 2, &sine, &cosine);
    for (double v : {axis.x * sine, axis.y * sine, axis.z * sine, cosine})
      channel.values.push_back(static_cast<float>(v));
  }
  return channel;
}

GlbClip MakeClip(const char* name, int frames, double speed, double phase) {
  const auto wave = [&](double amplitude, double cycles, double shift) {
    return [=](double t) { return amplitude * Sin(2 * kPi * (cycles * speed * t + shift + phase)); };
  };
  const Double3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  return {
      name,
      frames,
      {Turning(kHips, frames, y, wave(0.9, 1, 0)), Turning(kChest, frames, z, wave(0.35, 2, 0.1)),
       Turning(kHead, frames, x, wave(0.3, 3, 0.3)), Turning(kShoulderL, frames, z, wave(0.9, 2, 0)),
       Turning(kElbowL, frames, y, wave(-0.9, 2, 0.2)), Turning(kShoulderR, frames, z, wave(-0.8, 2, 0.4)),
       Turning(kElbowR, frames, y, wave(0.9, 1, 0.6)), Turning(kLampArm, frames, z, wave(0.55, 1, 0.25))}};
}

}  // namespace

SceneFiles GenerateRoom() {
  GlbScene scene;
  scene.nodes = {{"hips", -1, {0.2, 0.45, -0.3}, -1},
                 {"chest", 0, {0, 0.45, 0}, -1},
                 {"head", 1, {0, 0.3, 0}, -1},
                 {"shoulder.L", 1, {0.2, 0.1, 0}, -1},
                 {"elbow.L", 3, {0.38, 0, 0}, -1},
                 {"shoulder.R", 1, {-0.2, 0.1, 0}, -1},
                 {"elbow.R", 5, {-0.38, 0, 0}, -1},
                 {"lampArm", -1, {0, 2.95, 0.2}, -1},
                 {"room", -1, {}, -1}};
  for (int j = 0; j < kJoints; ++j) scene.joints.push_back(j);
  constexpr Float3 kWhite = {0.75f, 0.74f, 0.72f}, kRed = {0.75f, 0.12f, 0.1f}, kBlue = {0.12f, 0.25f, 0.7f};
  AddWall("floor", kWhite, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, &scene);
  AddWall("ceiling", kWhite, {-2, 3, -2}, {4, 0, 0}, {0, 0, 4}, &scene);
  AddWall("back", kWhite, {-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, &scene);
  AddWall("left", kRed, {-2, 0, 2}, {0, 0, -4}, {0, 3, 0}, &scene);
  AddWall("right", kBlue, {2, 0, -2}, {0, 0, 4}, {0, 3, 0}, &scene);
  AddBox("box", {0.3f, 0.65f, 0.3f}, {-1.6, 0, -1.5}, {-0.9, 0.9, -0.8}, &scene);
  const auto first = static_cast<std::ptrdiff_t>(scene.meshes.size());
  AddFigure(&scene);
  for (auto mesh = scene.meshes.begin() + first; mesh != scene.meshes.end(); ++mesh) {
    for (Float3& p : mesh->positions) p[0] += 0.2f, p[2] -= 0.3f;  // where the hips stand
  }
  scene.clips = {MakeClip("dance", 97, 1, 0), MakeClip("slow", 73, 0.5, 0.37)};
  return {{"room.glb", WriteGlb(scene)}};
}

}  // namespace kpsa::engine::scenes
