// Nanoseconds a point of every kernel, on one core, beside a plain float loop over x y z triples that does
// the same, and beside its limit: the larger one of the times that its arrays take to pass through the core once,
// at the bandwidth of a triad over as many bytes, and that its additions and multiplications take at their peak.
//   bench_kernels [points along an edge] [part of a kernel's name]
// KPSA_SIMD=avx512|avx2|scalar limits the vector unit.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>

#include "base/simd.h"
#include "bench/kernel_limits.h"
#include "nodes/kernels/blend_shape.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/dual_quaternion.h"
#include "nodes/kernels/lattice.h"
#include "nodes/kernels/non_linear.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/skin.h"
#include "nodes/kernels/soft_mod.h"
#include "nodes/kernels/weights.h"
#include "nodes/kernels/wire.h"
#include "nodes/kernels/wrap.h"
#include "tests/nodes/kernel_support.h"
#include "tests/nodes/non_linear_twin.h"

namespace kpsa::engine {
namespace {

struct Float3 {
  float x, y, z;
};
Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Float3 operator*(Float3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
Float3 Cross(Float3 a, Float3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
float Dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Float3 Unit(Float3 a) { return a * (1 / std::sqrt(std::max(Dot(a, a), 1e-30f))); }

struct Affine {
  float m[12];  // rows
  explicit Affine(const Matrix4& matrix) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) m[4 * r + c] = static_cast<float>(matrix(r, c));
    }
  }
  Float3 operator*(Float3 p) const {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
            m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
  }
};

// A rigid motion as a dual quaternion: rotation x y z w, dual part x y z w.
struct Motion {
  float m[8] = {};
  Motion() = default;
  explicit Motion(const Matrix4& matrix) {
    const Quaternion q = QuaternionFromRotation(matrix);
    const Quaternion d = Quaternion{0.5 * matrix(0, 3), 0.5 * matrix(1, 3), 0.5 * matrix(2, 3), 0} * q;
    const double parts[8] = {q.x, q.y, q.z, q.w, d.x, d.y, d.z, d.w};
    for (std::size_t i = 0; i < 8; ++i) m[i] = static_cast<float>(parts[i]);
  }
  void Add(const Motion& other, float weight) {
    float cosine = 0;
    for (std::size_t i = 0; i < 4; ++i) cosine += m[i] * other.m[i];
    for (std::size_t i = 0; i < 8; ++i) m[i] += (cosine < 0 ? -weight : weight) * other.m[i];
  }
  Float3 operator*(Float3 p) const {
    const float scale = 1 / std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + m[3] * m[3]);
    const Float3 v = Float3{m[0], m[1], m[2]} * scale, d = Float3{m[4], m[5], m[6]} * scale;
    const Float3 turned = Cross(v, Cross(v, p) + p * (m[3] * scale));
    return p + (turned + d * (m[3] * scale) - v * (m[7] * scale) + Cross(v, d)) * 2.0f;
  }
};

// The least time of several runs, a point.
double NanosecondsAPoint(std::size_t points, const std::function<void()>& run) {
  using Clock = std::chrono::steady_clock;
  double best = 1e30;
  const auto start = Clock::now();
  for (int i = 0; i < 2000 && (i < 20 || Clock::now() - start < std::chrono::milliseconds(400)); ++i) {
    const auto before = Clock::now();
    run();
    best = std::min(best, std::chrono::duration<double, std::nano>(Clock::now() - before).count());
  }
  return best / static_cast<double>(points);
}

bool all_faster = true;
std::string wanted;  // part of the names of those to measure

// What a kernel cannot do without, a point: bytes of its arrays, input, output and what was bound, each once a
// pass, what is gathered counted once; additions and multiplications of numbers that count, spare lanes left out.
struct Work {
  double bytes, operations;
};

void Report(const std::string& name, std::size_t points, Work work, const std::function<void()>& kernel,
            const std::function<void()>& twin) {
  if (name.find(wanted) == std::string::npos) return;
  const double ours = NanosecondsAPoint(points, kernel), theirs = NanosecondsAPoint(points, twin);
  all_faster &= ours <= theirs;
  static const double peak = OperationsANanosecond();
  const double moved = work.bytes / BytesANanosecond(static_cast<std::size_t>(work.bytes) * points);
  const double computed = work.operations / peak;
  fmt::print("{:<34} {:>8.2f} {:>10.2f} {:>8.1f}x {:>8.2f}  {:<10} {:>4.0f} %\n", name, ours, theirs,
             theirs / ours, std::max(moved, computed), moved > computed ? "bytes" : "arithmetic",
             100 * std::max(moved, computed) / ours);
}

int Main(int argc, char** argv) {
  if (const std::string problem = ApplySimdChoice(); !problem.empty()) {
    fmt::print(stderr, "{}\n", problem);
    return 2;
  }
  const Index edge = argc > 1 ? static_cast<Index>(std::clamp(std::atoi(argv[1]), 8, 2000)) : 131;
  if (argc > 2) wanted = argv[2];
  const TestMesh mesh = MakeSheet(edge, edge);
  const std::size_t n = mesh.count();
  const std::vector<Index> all = AllPoints(n);
  PointBuffer out(n);
  const ConstPointsView in = mesh.rest.view();
  std::vector<Float3> points(n), result(n);
  for (std::size_t i = 0; i < n; ++i) points[i] = {in.x[i], in.y[i], in.z[i]};
  AlignedFloats scratch(64 * n + 4096);
  fmt::print("{} points, {}\n{:<34} {:>8} {:>10} {:>9} {:>8}  {:<10} {:>6}\n", n, SimdTargetName(), "kernel",
             "ns/point", "naive", "faster", "limit", "of", "near");
  const double ring = static_cast<double>(mesh.topology.neighbors().values.size()) / static_cast<double>(n);

  for (int influences : {1, 4, 8}) {
    const TestSkin skin = MakeSkin(n, 64, influences, false);
    const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 64}, all);
    const std::vector<Matrix4> palette = MakePalette(64, {});
    Report(
        fmt::format("skin, {} influences", influences), n,
        Work{30.0 + 8 * influences, 30.0 + 24 * influences},
        [&] {
          kernel.Run({{Pointers(palette)}, 1}, in, out.view(), scratch.span());
        },
        [&] {
          std::vector<Affine> joints(palette.begin(), palette.end());
          for (std::size_t i = 0; i < n; ++i) {
            Float3 sum{0, 0, 0};
            for (Index e = skin.offsets[i]; e < skin.offsets[i + 1]; ++e) {
              sum = sum + (joints[skin.joints[e]] * points[i]) * skin.weights[e];
            }
            result[i] = sum;
          }
        });
  }
  {
    const TestSkin skin = MakeSkin(n, 64, 8, true);
    const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 64}, all);
    const std::vector<Matrix4> palette = MakePalette(64, {});
    Report(
        "skin, 1 to 8 influences", n, Work{30 + 8 * 4.5, 30 + 24 * 4.5},
        [&] {
          kernel.Run({{Pointers(palette)}, 1}, in, out.view(), scratch.span());
        },
        [&] {
          std::vector<Affine> joints(palette.begin(), palette.end());
          for (std::size_t i = 0; i < n; ++i) {
            Float3 sum{0, 0, 0};
            for (Index e = skin.offsets[i]; e < skin.offsets[i + 1]; ++e) {
              sum = sum + (joints[skin.joints[e]] * points[i]) * skin.weights[e];
            }
            result[i] = sum;
          }
        });
  }
  for (int influences : {4, 8}) {
    const TestSkin skin = MakeSkin(n, 64, influences, false);
    const std::vector<Double3> centers(64);
    const DualQuaternionKernel kernel({skin.offsets, skin.joints, skin.weights, 64}, centers, all);
    std::vector<Matrix4> palette = MakePalette(64, {});
    for (Matrix4& m : palette) {
      Double3 place, scale;
      Quaternion rotation;
      DecomposeTrs(m, &place, &rotation, &scale);
      m = ComposeTrs(place, rotation, {1, 1, 1});
    }
    Report(
        fmt::format("dual quaternions, {} influences", influences), n,
        Work{30.0 + 8 * influences, 74.0 + 16 * influences},
        [&] {
          kernel.Run({{Pointers(palette)}, 1}, in, out.view(), scratch.span());
        },
        [&] {
          std::vector<Motion> joints(palette.begin(), palette.end());
          for (std::size_t i = 0; i < n; ++i) {
            Motion sum;
            for (Index e = skin.offsets[i]; e < skin.offsets[i + 1]; ++e)
              sum.Add(joints[skin.joints[e]], skin.weights[e]);
            result[i] = sum * points[i];
          }
        });
  }
  for (double share : {0.1, 0.4}) {
    const std::vector<TestTarget> targets = MakeTargets(n, 40, share);
    std::vector<BlendTarget> views;
    for (const TestTarget& target : targets) views.push_back({target.points, target.deltas});
    const BlendShapeKernel kernel({n, views}, all);
    std::vector<double> weights(40, 0.0);
    for (std::size_t k = 0; k < 40; k += 5) weights[k] = 0.1 * static_cast<double>(k + 1);
    Report(
        fmt::format("blendShape, 8 of 40, {:.0f} % each", 100 * share), n,
        Work{24 + 8 * share * 16, 8 * share * 6},
        [&] {
          kernel.Run({weights, 1}, in, out.view(), scratch.span());
        },
        [&] {
          result = points;
          for (std::size_t k = 0; k < targets.size(); ++k) {
            const float w = static_cast<float>(weights[k]);
            if (w == 0) continue;
            const TestTarget& t = targets[k];
            for (std::size_t i = 0; i < t.points.size(); ++i) {
              Float3& p = result[t.points[i]];
              p = p + Float3{t.deltas[3 * i], t.deltas[3 * i + 1], t.deltas[3 * i + 2]} * w;
            }
          }
        });
  }
  {
    Random random(5);
    std::vector<float> weights;
    for (std::size_t i = 0; i < n; ++i) weights.push_back(static_cast<float>(random.Unit()));
    const ClusterKernel kernel(all, weights);
    const Matrix4 delta = ComposeTrs({0.1, 0.2, 0.3}, random.Rotation(), {1, 1.1, 1});
    Report(
        "cluster", n, {28, 28},
        [&] {
          kernel.Run({delta, {}, 1}, in, out.view(), {});
        },
        [&] {
          const Affine m(delta);
          for (std::size_t i = 0; i < n; ++i)
            result[i] = points[i] + (m * points[i] - points[i]) * weights[i];
        });
  }
  struct LatticeCase {
    const char* name;
    int divisions;
    bool local;
    int influence;
  };
  for (const LatticeCase& c : {LatticeCase{"lattice 2x2x2", 2, true, 2},
                               {"lattice 5x5x5 linear", 5, true, 2},
                               {"lattice 5x5x5 cubic", 5, true, 4},
                               {"lattice 5x5x5 Bernstein", 5, false, 2},
                               {"lattice 10x10x10 linear", 10, true, 2}}) {
    LatticeSettings settings{
        {c.divisions, c.divisions, c.divisions}, c.local, {c.influence, c.influence, c.influence}};
    const Matrix4 lattice_from_rest = Translation({0, 0, -0.2});
    const LatticeKernel kernel(settings, in, lattice_from_rest, all);
    Random random(6);
    std::vector<Double3> offsets(kernel.control_count());
    for (Double3& o : offsets) o = random.Vector() * 0.1;
    const std::vector<Index> every = AllPoints(offsets.size());
    const Matrix4 base = InverseOrIdentity(lattice_from_rest),
                  moved = base * ComposeTrs({0.1, 0, 0}, random.Rotation(), {1, 1, 1});
    // The naive twin stores its basis, too
    std::vector<std::array<std::vector<float>, 3>> basis(n);
    std::vector<std::array<int, 3>> first(n);
    const int order = c.local ? c.influence : 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Double3 q = TransformPoint(lattice_from_rest, {in.x[i], in.y[i], in.z[i]}) + Double3{.5, .5, .5};
      for (int a = 0; a < 3; ++a) {
        const std::vector<double> w = LatticeBasis(c.divisions, order, q[a]);
        int from = 0;
        const int size = c.local ? c.influence : c.divisions;
        while (from + size < c.divisions && w[static_cast<std::size_t>(from)] == 0) ++from;
        first[i][static_cast<std::size_t>(a)] = from;
        for (int k = from; k < from + size; ++k)
          basis[i][static_cast<std::size_t>(a)].push_back(static_cast<float>(w[static_cast<std::size_t>(k)]));
      }
    }
    // The move of the lattice as a whole, then that of its controls, of which distant ones are not stored
    const double across = c.local ? c.influence : c.divisions, all_controls = c.divisions;
    const double width = across * across * across, controls = all_controls * all_controls * all_controls;
    const Work work =
        c.local && controls > 13 * width
            ? Work{28 + 28 + 8 * width, 28 + 6 * width}
            : Work{28 + 28 + 12 * all_controls, 28 + 6 * (controls + all_controls * (all_controls + 1))};
    Report(
        c.name, n, work,
        [&] {
          kernel.Run({offsets, every, base, moved, 1}, in, out.view(), scratch.span());
        },
        [&] {
          std::vector<Float3> moves;
          for (Double3 o : offsets) {
            const Double3 d = TransformVector(moved, o);
            moves.push_back({static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)});
          }
          const Affine delta(moved * lattice_from_rest);
          for (std::size_t i = 0; i < n; ++i) {
            Float3 sum{0, 0, 0};
            const auto& b = basis[i];
            for (std::size_t u = 0; u < b[2].size(); ++u) {
              for (std::size_t t = 0; t < b[1].size(); ++t) {
                const std::size_t row = static_cast<std::size_t>(
                    first[i][0] + c.divisions * (first[i][1] + static_cast<int>(t) +
                                                 c.divisions * (first[i][2] + static_cast<int>(u))));
                const float w = b[2][u] * b[1][t];
                for (std::size_t s = 0; s < b[0].size(); ++s) sum = sum + moves[row + s] * (w * b[0][s]);
              }
            }
            result[i] = delta * points[i] + sum;
          }
        });
  }
  {
    std::vector<Double3> vertices;
    for (int i = 0; i < 8; ++i) vertices.push_back({-0.5 + i / 7.0, 0.1 * std::sin(i), 0.2});
    WireSettings settings;
    settings.dropoff = 2;  // every point follows
    const WireKernel kernel(settings, vertices, in, all);
    Random random(7);
    std::vector<Double3> offsets(8);
    for (Double3& o : offsets) o = random.Vector() * 0.1;
    const WireOffsets moved(offsets);
    const CurveShape shape{settings.basis, false, 8};
    std::vector<std::array<Index, 4>> controls(n);
    std::vector<std::array<float, 4>> weights(n);
    for (std::size_t i = 0; i < n; ++i) {
      double w[4];
      const Double3 p{in.x[i], in.y[i], in.z[i]};
      const double u = shape.Nearest(vertices, p);
      shape.Weights(u, controls[i].data(), w);
      const double falloff =
          settings.profile.Evaluate(Length(shape.Point(vertices, u) - p) / settings.dropoff);
      for (std::size_t k = 0; k < 4; ++k) weights[i][k] = static_cast<float>(falloff * w[k]);
    }
    Report(
        "wire, all points near", n, {24 + 28 + 32, 27},
        [&] {
          kernel.Run({moved, 1}, in, out.view(), scratch.span());
        },
        [&] {
          for (std::size_t i = 0; i < n; ++i) {
            Float3 p = points[i];
            for (std::size_t k = 0; k < 4; ++k) {
              const Double3 o = offsets[controls[i][k]];
              p = p + Float3{static_cast<float>(o.x), static_cast<float>(o.y), static_cast<float>(o.z)} *
                          weights[i][k];
            }
            result[i] = p;
          }
        });
  }
  const struct {
    const char* name;
    double operations;  // of the map
    NonLinearMap map;
  } maps[] = {{"bend", 80, Bend{1.2, -0.4, 0.5}},
              {"twist", 47, Twist{0.3, -2, -0.3, 0.4}},
              {"squash", 24, Squash{-0.7, 1.2, 0.3, 0.4, 0.6, -0.3, 0.5}},
              {"flare", 18, Flare{1.5, 0.5, 0.7, 1.2, 0.3, -0.4, 0.3}},
              {"sine", 25, Sine{0.1, 0.4, 0.05, 0.5, -0.4, 0.5}},
              {"wave", 31, Wave{0.1, 0.3, 0.05, -0.5, 0.1, 0.5}}};
  for (const auto& c : maps) {
    const NonLinearKernel kernel(all);
    const Matrix4 frame = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
    Report(
        c.name, n, Work{28, 45 + c.operations},
        [&] {
          kernel.Run({c.map, frame, 1}, in, out.view(), {});
        },
        [&] {  // in double, since that is what the bounds of floats are stated against
          const Matrix4 inverse = InverseOrIdentity(frame);
          non_linear_twin::WithMap(c.map, [&](const auto& f) {
            for (std::size_t i = 0; i < n; ++i) {
              const Double3 q = TransformPoint(inverse, {points[i].x, points[i].y, points[i].z});
              const Double3 move = TransformVector(frame, f(q) - q);
              result[i] = points[i] + Float3{static_cast<float>(move.x), static_cast<float>(move.y),
                                             static_cast<float>(move.z)};
            }
          });
        });
  }
  for (double distance_weight : {0.0, 1.0}) {
    DeltaMushSettings settings;
    settings.distance_weight = distance_weight;
    const DeltaMushKernel kernel(mesh.topology, in, settings, all, all);
    const auto neighbors = mesh.topology.neighbors();
    std::vector<Float3> a(n), b(n), detail(n, Float3{0, 0, 0.001f});
    std::vector<float> weights;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < neighbors.row(i).size(); ++k)
        weights.push_back(1.0f / static_cast<float>(neighbors.row(i).size()));
    }
    Report(
        distance_weight == 0 ? "deltaMush, 10 iterations" : "deltaMush, 10, distance weights", n,
        Work{28 + 10 * (36 + 4 * ring + 4 * ring * distance_weight) + 40 + 12 * ring,
             10 * (9 + 3 * ring + 3 * ring * distance_weight) + 15 * ring + 120},
        [&] { kernel.Run({}, in, out.view(), scratch.span()); },
        [&] {
          a = points;
          for (int iteration = 0; iteration < 10; ++iteration) {
            for (std::size_t i = 0; i < n; ++i) {
              Float3 sum{0, 0, 0};
              const auto row = neighbors.row(i);
              if (distance_weight == 0) {
                for (Index q : row) sum = sum + a[q];
                sum = sum * (1.0f / static_cast<float>(row.size()));
              } else {
                for (std::size_t k = 0; k < row.size(); ++k)
                  sum = sum + a[row[k]] * weights[neighbors.offsets[i] + k];
              }
              b[i] = a[i] + (sum - a[i]) * 0.5f;
            }
            std::swap(a, b);
          }
          // The simplest frame there is: normal of the triangles around, tangent to the first neighbour
          for (std::size_t i = 0; i < n; ++i) {
            Float3 normal{0, 0, 0};
            for (Index t : mesh.topology.point_triangles().row(i)) {
              const Index* v = &mesh.topology.triangles()[3 * t];
              normal = normal + Cross(a[v[1]] - a[v[0]], a[v[2]] - a[v[0]]);
            }
            normal = Unit(normal);
            const Float3 edge_to = a[neighbors.row(i)[0]] - a[i];
            const Float3 tangent = Unit(edge_to - normal * Dot(edge_to, normal)),
                         binormal = Cross(normal, tangent);
            result[i] = a[i] + tangent * detail[i].x + binormal * detail[i].y + normal * detail[i].z;
          }
        });
  }
  for (const bool nearest : {false, true}) {
    // A sheet of as many points, a little above its driver
    const std::vector<Double3> driver_rest = ToDouble(in);
    PointBuffer above(n);
    CopyPoints(in, above.view());
    for (std::size_t i = 0; i < n; ++i) above.view().x[i] *= 0.99f, above.view().z[i] += 0.01f;
    const ConstPointsView follower = std::as_const(above).view();
    const TriangleTree tree(
        in, nearest ? PointTriangles(mesh.topology)
                    : std::vector<Index>(mesh.topology.triangles().begin(), mesh.topology.triangles().end()));
    const WrapInfluences influences = nearest ? NearestInfluences(tree, follower, all, 1, 8)
                                              : SurfaceInfluences(tree, mesh.topology, follower, all, 1, 0);
    const WrapKernel kernel(WrapMode::kOffset, mesh.topology, driver_rest, Matrix4(), influences, follower,
                            all, all);
    PointBuffer driver(n);
    const Matrix4 motion = ComposeTrs({0.1, 0.2, 0.3}, {0.1, 0.2, 0, 1}, {1, 1.1, 1});
    for (std::size_t i = 0; i < n; ++i) {
      const Double3 p = TransformPoint(motion, driver_rest[i]);
      driver.view().x[i] = static_cast<float>(p.x), driver.view().y[i] = static_cast<float>(p.y);
      driver.view().z[i] = static_cast<float>(p.z);
    }
    const ConstPointsView now = std::as_const(driver).view();
    // The twin has the simplest frames: normals of the triangles around, tangents to the first neighbour
    struct Frame {
      Float3 t, b, n;
    };
    const auto neighbors = mesh.topology.neighbors();
    const auto frames_of = [&](const std::vector<Float3>& at, std::vector<Frame>* frames) {
      for (std::size_t i = 0; i < n; ++i) {
        Float3 normal{0, 0, 0};
        for (Index t : mesh.topology.point_triangles().row(i)) {
          const Index* v = &mesh.topology.triangles()[3 * t];
          normal = normal + Cross(at[v[1]] - at[v[0]], at[v[2]] - at[v[0]]);
        }
        normal = Unit(normal);
        const Float3 edge_to = at[neighbors.row(i)[0]] - at[i];
        const Float3 tangent = Unit(edge_to - normal * Dot(edge_to, normal));
        (*frames)[i] = {tangent, Cross(normal, tangent), normal};
      }
    };
    std::vector<Frame> rest_frames(n), frames(n);
    frames_of(points, &rest_frames);
    std::vector<Float3> offsets, driver_points(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (Index e = influences.offsets[i]; e < influences.offsets[i + 1]; ++e) {
        const Index p = influences.points[e];
        const Float3 o = Float3{follower.x[i], follower.y[i], follower.z[i]} - points[p];
        const Frame& f = rest_frames[p];
        offsets.push_back({Dot(o, f.t), Dot(o, f.b), Dot(o, f.n)});
      }
    }
    const double shares = static_cast<double>(influences.points.size()) / static_cast<double>(n);
    Report(
        nearest ? "wrap, 8 influences" : "proximityWrap", n,
        Work{28 + 84 + 20 * ring + 64 + 104 + 8 * shares, 40 + 33 * ring + 30 * shares + 140},
        [&] {
          kernel.Run({1, now}, follower, out.view(), scratch.span());
        },
        [&] {
          for (std::size_t i = 0; i < n; ++i) driver_points[i] = {now.x[i], now.y[i], now.z[i]};
          frames_of(driver_points, &frames);
          for (std::size_t i = 0; i < n; ++i) {
            Float3 sum{0, 0, 0};
            for (Index e = influences.offsets[i]; e < influences.offsets[i + 1]; ++e) {
              const Frame& f = frames[influences.points[e]];
              const Float3 o = offsets[e];
              sum = sum + (driver_points[influences.points[e]] + f.t * o.x + f.b * o.y + f.n * o.z) *
                              static_cast<float>(influences.weights[e]);
            }
            result[i] = sum;
          }
        });
  }
  {
    const NormalsKernel kernel(mesh.topology, all, all);
    Report(
        "normals", n, Work{24 + 2 * 28 + 16 + 4 * ring, 2 * 14 + 3 * ring + 9},
        [&] { kernel.Run(in, out.view(), scratch.span()); },
        [&] {
          std::fill(result.begin(), result.end(), Float3{0, 0, 0});
          const auto triangles = mesh.topology.triangles();
          for (std::size_t t = 0; t < triangles.size(); t += 3) {
            const Float3 cross = Cross(points[triangles[t + 1]] - points[triangles[t]],
                                       points[triangles[t + 2]] - points[triangles[t]]);
            for (std::size_t c = 0; c < 3; ++c) result[triangles[t + c]] = result[triangles[t + c]] + cross;
          }
          for (Float3& normal : result) normal = Unit(normal);
        });
  }
  {
    // A sheet that is bent, and the same points a little off it
    const TriangleTree tree(in, mesh.topology.triangles());
    TriangleTree moving(in, mesh.topology.triangles());
    PointBuffer bent(n);
    float sway = 0;
    double sum = 0;
    const auto each = [&](const auto& search) {
      for (std::size_t i = 0; i < n; ++i)
        sum += search(Double3{in.x[i] * 0.99, in.y[i] * 0.98, in.z[i] + 0.01});
    };
    fmt::print("\n{} triangles\n", mesh.topology.triangle_count());
    const auto row = [](const char* name, double ns) { fmt::print("{:<34} {:>8.2f}\n", name, ns); };
    row("nearest place",
        NanosecondsAPoint(n, [&] { each([&](Double3 p) { return tree.Closest(p).squared; }); }));
    row("where a line meets them", NanosecondsAPoint(n, [&] {
          each([&](Double3 p) { return tree.FirstHit(p, {0.1, 0.2, -1}).weights[0]; });
        }));
    row("following their points, a triangle", NanosecondsAPoint(mesh.topology.triangle_count(), [&] {
          sway += 0.001f;
          for (std::size_t i = 0; i < n; ++i) {
            bent.view().x[i] = in.x[i];
            bent.view().y[i] = in.y[i];
            bent.view().z[i] = in.z[i] + sway * in.x[i] * in.x[i];
          }
          moving.Move(bent.view());
        }));
    if (!(sum > 0)) fmt::print("nothing was found\n");
  }
  fmt::print("\n{}\n", all_faster ? "no kernel is slower than its naive twin"
                                  : "A KERNEL IS SLOWER THAN ITS NAIVE TWIN");
  return all_faster ? 0 : 1;
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
