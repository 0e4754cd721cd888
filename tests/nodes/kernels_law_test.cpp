// The law of bound kernels, for all of them: the bits of a point depend neither on the set of points, nor on
// the vector unit, nor on the split over threads, nor on working in place.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "base/digest.h"
#include "base/simd.h"
#include "nodes/kernels/blend_shape.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/delta_mush_step.h"
#include "nodes/kernels/dual_quaternion.h"
#include "nodes/kernels/lattice.h"
#include "nodes/kernels/non_linear.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/sculpt.h"
#include "nodes/kernels/shrink_wrap.h"
#include "nodes/kernels/skin.h"
#include "nodes/kernels/soft_mod.h"
#include "nodes/kernels/tension.h"
#include "nodes/kernels/weights.h"
#include "nodes/kernels/wire.h"
#include "nodes/kernels/wrap.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

const std::vector<std::string> kTargets = {"avx512", "avx2", "neon", "scalar"};

// One kernel on a mesh, reduced to: the demand of a set of points, and their evaluation from the demanded
// points.
struct Subject {
  std::string name;
  bool local = true;
  std::function<std::vector<Index>(std::span<const Index>)> demand;  // not local only
  std::function<void(std::span<const Index> out_points, std::span<const Index> in_points, ConstPointsView in,
                     PointsView out, const Parallel*)>
      run;
};

class KernelLaw : public testing::Test {
 protected:
  explicit KernelLaw(Index nu = 45, Index nv = 41)
      : mesh_(MakeSheet(nu, nv)),
        skin_(MakeSkin(mesh_.count(), 30, 6, true)),
        points_(mesh_.count()),
        wrapped_(mesh_.count()) {
    // A pose that is not the rest; zeros of both signs in all places where a mirror plane would have them
    Random random(11);
    CopyPoints(mesh_.rest.view(), points_.view());
    for (std::size_t i = 0; i < count(); ++i) {
      points_.view().y[i] += static_cast<float>(0.02 * random.Signed());
      if (i % 7 == 0) points_.view().x[i] = i % 2 == 0 ? -0.0f : 0.0f;
      mask_.push_back(i % 5 == 0 ? 0.0f : i % 3 == 0 ? 1.0f : static_cast<float>(random.Unit()));
    }
    targets_ = MakeTargets(count(), 12, 0.3);
    for (const TestTarget& target : targets_) target_views_.push_back({target.points, target.deltas});
    for (int k = 0; k < 12; ++k) target_weights_.push_back(k % 3 == 0 ? 0.0 : 0.1 * k - 0.5);
    palette_ = MakePalette(30, {0.5, 1, 2});
    for (int i = 0; i < 6; ++i) {
      vertices_.push_back({-0.5 + i / 5.0, 0.1 * (i % 2), 0.2});
      vertex_offsets_.push_back(random.Vector() * 0.1);
    }
    AddSubjects();
  }
  ~KernelLaw() override { SelectSimdTarget(""); }

  std::size_t count() const { return mesh_.count(); }
  std::vector<float> Masked(std::span<const Index> out_points) const {
    return GatherWeights(mask_, out_points);
  }

  void AddSubjects() {
    for (bool masked : {false, true}) {
      subjects_.push_back(
          {masked ? "skin with weights" : "skin",
           true,
           {},
           [this, masked](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const SkinKernel kernel({skin_.offsets, skin_.joints, skin_.weights, 30}, out_points,
                                     masked ? Masked(out_points) : std::vector<float>());
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({{Pointers(palette_)}, masked ? 0.75 : 1.0}, in, out, scratch.span(), parallel);
           }});
      subjects_.push_back(
          {masked ? "blendShape with weights" : "blendShape",
           true,
           {},
           [this, masked](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const BlendShapeKernel kernel({count(), target_views_}, out_points,
                                           masked ? Masked(out_points) : std::vector<float>());
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({target_weights_, 0.9}, in, out, scratch.span(), parallel);
           }});
      subjects_.push_back(
          {masked ? "deltaMush with weights" : "deltaMush", false,
           [this, masked](auto out_points) {
             return DeltaMushDemand(mesh_.topology, Mush(masked), out_points,
                                    masked ? Masked(out_points) : std::vector<float>());
           },
           [this, masked](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
             const DeltaMushKernel kernel(mesh_.topology, mesh_.rest.view(), Mush(masked), out_points,
                                          in_points, masked ? Masked(out_points) : std::vector<float>());
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({masked ? 0.6 : 1.0, masked ? 0.8 : 1.0, {0.1, masked ? 1.0 : 0.0, 0}}, in, out,
                        scratch.span(), parallel);
           }});
    }
    const auto step = std::make_shared<const DeltaMushStep>(mesh_.topology, mesh_.rest.view(), Mush(false),
                                                            DeltaMushStep::Constants{1, 0.8, {}});
    subjects_.push_back(
        {"deltaMush, of smoothed points", false,
         [step](auto out_points) { return step->Bind(out_points).inner(); },
         [step](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
           PointBuffer inner(step->inner_points());
           for (std::size_t i = 0; i < in_points.size(); ++i) {
             const Index row = in_points[i];
             inner.view().x[row] = in.x[i], inner.view().y[row] = in.y[i];
             inner.view().z[row] = in.z[i];
           }
           const DeltaMushStep::Part part = step->Bind(out_points);
           AlignedFloats scratch(part.ScratchFloats());
           part.Run(inner.view(), out, scratch.span(), parallel);
         }});
    subjects_.push_back(
        {"cluster", true, {}, [this](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
           const ClusterKernel kernel(out_points, Masked(out_points));
           kernel.Run({ComposeTrs({0.1, 0, 0.2}, Random(3).Rotation(), {1, 2, 1}), {0.1, 0.1, 0}, 0.5}, in,
                      out, {}, parallel);
         }});
    const struct {
      const char* name;
      LatticeSettings settings;
      bool moved;
    } lattices[] = {
        {"lattice, all controls", {{3, 4, 2}, true, {2, 3, 2}}, true},
        {"lattice, Bernstein", {{4, 5, 3}, false}, false},
        {"lattice, stored controls", {{8, 9, 7}, true, {2, 2, 2}, LatticeOutside::kFalloff, 0.5}, true},
        {"lattice, outside", {{5, 5, 5}, true, {2, 2, 2}, LatticeOutside::kAll}, false},
    };
    for (const auto& c : lattices) {
      subjects_.push_back(
          {c.name, true, {}, [this, c](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const Matrix4 base = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
             const LatticeKernel kernel(c.settings, mesh_.rest.view(), InverseOrIdentity(base), out_points,
                                        Masked(out_points));
             Random random(9);
             std::vector<Double3> offsets(kernel.control_count());
             for (Double3& o : offsets) o = random.Vector() * 0.2;
             AlignedFloats scratch(kernel.ScratchFloats());
             const Matrix4 now = c.moved ? base * Translation({0.1, 0.2, 0}) : base;
             kernel.Run({offsets, MovedControls(offsets), base, now, 0.8}, in, out, scratch.span(), parallel);
           }});
    }
    for (CurveBasis basis : {CurveBasis::kLinear, CurveBasis::kCatmullRom, CurveBasis::kBSpline}) {
      subjects_.push_back(
          {"wire " + std::to_string(static_cast<int>(basis)),
           true,
           {},
           [this, basis](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             WireSettings settings;
             settings.basis = basis;
             settings.dropoff = 0.3;
             const WireKernel kernel(settings, vertices_, mesh_.rest.view(), out_points, Masked(out_points));
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({WireOffsets(vertex_offsets_), 0.9}, in, out, scratch.span(), parallel);
           }});
    }
    for (const SculptMode mode : {SculptMode::kFlip, SculptMode::kProject, SculptMode::kStretch}) {
      subjects_.push_back(
          {"sculpt " + std::to_string(static_cast<int>(mode)),
           true,
           {},
           [this, mode](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const Matrix4 handle = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
             const SculptShape shape{mode, SculptDropoff::kLinear, 0.5, 0.6, {0, 0.6, 0.8}};
             SculptKernel(out_points, Masked(out_points)).Run({shape, handle, 0.4, 0.8}, in, out, parallel);
           }});
    }
    AddRingSubjects();
    AddDualQuaternions();
    subjects_.push_back(
        {"wires", true, {}, [this](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
           WireSettings near, far;
           near.dropoff = 0.3, far.dropoff = 0.5, far.closed = true, far.basis = CurveBasis::kLinear;
           const WireCurve curves[] = {{near, std::span(vertices_).last(2)},
                                       {far, std::span(vertices_).first(3)}};
           const WireKernel kernel(curves, 0.3, mesh_.rest.view(), out_points, Masked(out_points));
           AlignedFloats scratch(kernel.ScratchFloats());
           kernel.Run({WireOffsets(std::span(vertex_offsets_).first(5)), 0.9}, in, out, scratch.span(),
                      parallel);
         }});
    for (const NonLinearMap& map : std::vector<NonLinearMap>{
             Bend{1.2, -0.4, 0.5}, Twist{0.3, -2, -0.3, 0.4}, Squash{-0.7, 1.2, 0.3, 0.4, 0.6, -0.3, 0.5},
             Flare{1.5, 0.5, 0.7, 1.2, 0.3, -0.4, 0.3}, Sine{0.1, 0.4, 0.05, 0.5, -0.4, 0.5},
             Wave{0.1, 0.3, 0.05, -0.5, 0.1, 0.5}}) {
      subjects_.push_back(
          {"non-linear " + std::to_string(map.index()),
           true,
           {},
           [this, map](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const Matrix4 frame = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
             NonLinearKernel(out_points, Masked(out_points)).Run({map, frame, 0.8}, in, out, {}, parallel);
           }});
    }
    subjects_.push_back(
        {"normals", false, [this](auto out_points) { return NormalsDemand(mesh_.topology, out_points); },
         [this](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
           const NormalsKernel kernel(mesh_.topology, out_points, in_points);
           AlignedFloats scratch(kernel.ScratchFloats());
           kernel.Run(in, out, scratch.span(), parallel);
         }});
    AddWraps();
    AddShrinkWraps();
  }

  // The points that the law is about are the driver's; a sheet beside it follows.
  void AddWraps() {
    const Matrix4 beside = ComposeTrs({0.01, 0, 0.06}, {0, 0, 0.1, 1}, {0.95, 0.9, 0.8});
    for (std::size_t i = 0; i < count(); ++i) {
      driver_rest_.push_back({mesh_.rest.view().x[i], mesh_.rest.view().y[i], mesh_.rest.view().z[i]});
      const Double3 p = TransformPoint(beside, driver_rest_.back());
      wrapped_.view().x[i] = static_cast<float>(p.x);
      wrapped_.view().y[i] = static_cast<float>(p.y);
      wrapped_.view().z[i] = static_cast<float>(p.z);
    }
    surface_ = TriangleTree(mesh_.rest.view(), mesh_.topology.triangles());
    singles_ = TriangleTree(mesh_.rest.view(), PointTriangles(mesh_.topology));
    const struct {
      const char* name;
      WrapMode mode;
      int smooth;
      bool nearest;
    } wraps[] = {{"proximityWrap, offset", WrapMode::kOffset, 0, false},
                 {"proximityWrap, smooth", WrapMode::kOffset, 2, false},
                 {"proximityWrap, surface", WrapMode::kSurface, 0, false},
                 {"proximityWrap, snap", WrapMode::kSnap, 0, false},
                 {"wrap", WrapMode::kOffset, 0, true}};
    for (const auto& c : wraps) {
      const auto search = [this, c](std::span<const Index> out_points) {
        return c.nearest
                   ? NearestInfluences(singles_, wrapped_.view(), out_points, 0.2, 6, Masked(out_points))
                   : SurfaceInfluences(surface_, mesh_.topology, wrapped_.view(), out_points, 10, c.smooth,
                                       Masked(out_points));
      };
      // Those of all points are asked for again and again
      const auto of_all = std::make_shared<std::optional<WrapInfluences>>();
      const auto influences = [this, search, of_all](std::span<const Index> out_points) {
        if (out_points.size() < count()) return search(out_points);
        if (!of_all->has_value()) *of_all = search(out_points);
        return **of_all;
      };
      subjects_.push_back({c.name, false,
                           [this, c, influences](auto out_points) {
                             return WrapDemand(mesh_.topology, driver_rest_, influences(out_points), c.mode);
                           },
                           [this, c, influences](auto out_points, auto in_points, auto in, auto out,
                                                 const Parallel* parallel) {
                             const WrapKernel kernel(c.mode, mesh_.topology, driver_rest_,
                                                     Translation({0, 0.01, 0}), influences(out_points),
                                                     wrapped_.view(), out_points, in_points,
                                                     Masked(out_points));
                             AlignedFloats scratch(kernel.ScratchFloats());
                             PointBuffer points(out_points.size()), driver(in_points.size());
                             GatherPoints(wrapped_.view(), out_points, points.view());
                             CopyPoints(in, driver.view());  // the engine never gives one buffer for both
                             kernel.Run({0.8, driver.view()}, points.view(), out, scratch.span(), parallel);
                           }});
    }
  }

  // Onto the sheet that follows in the other subjects.
  void AddShrinkWraps() {
    using Projection = ShrinkWrapSettings::Projection;
    for (const Projection projection : {Projection::kClosest, Projection::kNormals}) {
      ShrinkWrapSettings settings;
      settings.projection = projection;
      settings.bidirectional = true;
      subjects_.push_back(
          {projection == Projection::kClosest ? "shrinkWrap" : "shrinkWrap along normals",
           projection == Projection::kClosest,
           [this, settings](auto out_points) {
             return ShrinkWrapDemand(settings, mesh_.topology, out_points, Masked(out_points));
           },
           [this, settings](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
             const ShrinkWrapKernel kernel(
                 settings, mesh_.topology, MovingSurface(mesh_.rest.view(), mesh_.topology.triangles()),
                 Translation({0, 0, 0.01}), mesh_.topology, out_points, in_points, Masked(out_points));
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({0.9, 0.002, wrapped_.view()}, in, out, scratch.span(), parallel);
           }});
    }
  }

  void AddDualQuaternions() {
    Random random(12);
    for (int j = 0; j < 30; ++j) centers_.push_back(random.Vector() * 0.5);
    for (bool blended : {false, true}) {
      subjects_.push_back(
          {blended ? "dual quaternions and linear" : "dual quaternions",
           true,
           {},
           [this, blended](auto out_points, auto, auto in, auto out, const Parallel* parallel) {
             const SkinWeights weights{skin_.offsets, skin_.joints, skin_.weights, 30};
             const std::vector<float> mask = Masked(out_points);
             const SkinKernel linear(weights, out_points);
             const DualQuaternionKernel kernel(weights, centers_, out_points,
                                               blended ? std::vector<float>() : mask,
                                               blended ? mask : std::vector<float>());
             AlignedFloats scratch(kernel.ScratchFloats()), linear_scratch(linear.ScratchFloats());
             PointBuffer apart(out_points.size());
             if (blended)
               linear.Run({{Pointers(palette_)}, 1}, in, apart.view(), linear_scratch.span(), parallel);
             kernel.Run({{Pointers(palette_)}, 1, std::as_const(apart).view()}, in, out, scratch.span(),
                        parallel);
           }});
    }
  }

  void AddRingSubjects() {
    for (bool masked : {false, true}) {
      subjects_.push_back(
          {masked ? "tension with weights" : "tension", false,
           [this, masked](auto out_points) {
             return TensionDemand(mesh_.topology, out_points,
                                  masked ? Masked(out_points) : std::vector<float>());
           },
           [this, masked](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
             const TensionPushKernel kernel(mesh_.topology, mesh_.rest.view(), out_points, in_points,
                                            masked ? Masked(out_points) : std::vector<float>());
             AlignedFloats scratch(kernel.ScratchFloats());
             kernel.Run({1.1, 0.1, -0.2, 0.7}, in, out, scratch.span(), parallel);
           }});
    }
    subjects_.push_back(
        {"strain", false, [this](auto out_points) { return TensionDemand(mesh_.topology, out_points); },
         [this](auto out_points, auto in_points, auto in, auto out, const Parallel* parallel) {
           const StrainKernel kernel(mesh_.topology, mesh_.rest.view(), out_points, in_points);
           std::vector<float> strain(out_points.size());
           kernel.Run(1, in, strain.data(), parallel);
           for (std::size_t i = 0; i < strain.size(); ++i) out.x[i] = strain[i], out.y[i] = 0, out.z[i] = 0;
         }});
  }

  static DeltaMushSettings Mush(bool other) {
    DeltaMushSettings settings;
    settings.iterations = other ? 3 : 6;
    settings.distance_weight = other ? 0.7 : 0;
    settings.pin_borders = other;
    return settings;
  }

  std::vector<Index> Demand(const Subject& subject, std::span<const Index> out_points) const {
    return subject.local ? std::vector<Index>(out_points.begin(), out_points.end())
                         : subject.demand(out_points);
  }
  // x y z x y z ... of the output points.
  std::vector<float> Evaluate(const Subject& subject, std::span<const Index> out_points,
                              const Parallel* parallel = nullptr) const {
    const std::vector<Index> in_points = Demand(subject, out_points);
    PointBuffer in(in_points.size()), out(out_points.size());
    GatherPoints(points_.view(), in_points, in.view());
    subject.run(out_points, in_points, in.view(), out.view(), parallel);
    return out.Interleaved();
  }

  TestMesh mesh_;
  TestSkin skin_;
  PointBuffer points_;
  std::vector<float> mask_;
  std::vector<TestTarget> targets_;
  std::vector<BlendTarget> target_views_;
  std::vector<double> target_weights_;
  std::vector<Matrix4> palette_;
  std::vector<Double3> centers_;
  std::vector<Double3> vertices_, vertex_offsets_, driver_rest_;
  PointBuffer wrapped_;
  TriangleTree surface_, singles_;
  std::vector<Subject> subjects_;
};

// The number of points whose bits differ.
std::size_t Differences(const std::vector<float>& whole, std::span<const Index> points,
                        const std::vector<float>& part) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    count += std::memcmp(&whole[3 * points[i]], &part[3 * i], 12) != 0;
  return count;
}

std::vector<Index> RandomSubset(Random* random, std::size_t count, std::size_t size) {
  std::vector<Index> points;
  while (points.size() < size) {
    points.push_back(random->Below(count));
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
  }
  return points;
}

TEST_F(KernelLaw, EveryKernelMovesPoints) {
  const std::vector<Index> all = AllPoints(count());
  for (const Subject& subject : subjects_) {
    EXPECT_GT(Differences(points_.Interleaved(), all, Evaluate(subject, all)), count() / 20) << subject.name;
  }
}

TEST_F(KernelLaw, EveryVectorUnitGivesTheSameBits) {
  const std::vector<Index> all = AllPoints(count());
  for (const Subject& subject : subjects_) {
    SelectSimdTarget("scalar");
    const std::vector<float> scalar = Evaluate(subject, all);
    Hasher bits;
    bits.Add(std::span<const float>(scalar));
    std::string name = subject.name;  // of an attribute in XML
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c == ' ' || c == ','; }, '_');
    RecordProperty(name, bits.Finish().ToHex());  // tests/wide.sh compares them with another machine's
    for (const std::string& target : kTargets) {
      if (!SelectSimdTarget(target)) continue;
      ASSERT_EQ(SimdTargetName(), target);
      EXPECT_EQ(Differences(scalar, all, Evaluate(subject, all)), 0u) << subject.name << " on " << target;
    }
  }
}

TEST_F(KernelLaw, SubsetsHaveTheBitsOfTheWhole) {
  Random random(21);
  for (const Subject& subject : subjects_) {
    SelectSimdTarget("");
    const std::vector<float> whole = Evaluate(subject, AllPoints(count()));
    for (std::size_t size = 1; size <= 65; ++size) {
      SelectSimdTarget(kTargets[size % 2]);
      const std::vector<Index> points = RandomSubset(&random, count(), size);
      ASSERT_EQ(Differences(whole, points, Evaluate(subject, points)), 0u)
          << subject.name << ", " << size << " points";
    }
    SelectSimdTarget("scalar");
    for (std::size_t size : {5ul, 19ul, 300ul}) {
      const std::vector<Index> points = RandomSubset(&random, count(), size);
      ASSERT_EQ(Differences(whole, points, Evaluate(subject, points)), 0u)
          << subject.name << ", " << size << " points";
    }
  }
}

// Large enough for every kernel to be split.
class KernelLawLarge : public KernelLaw {
 protected:
  KernelLawLarge() : KernelLaw(140, 121) {}
};

TEST_F(KernelLawLarge, SplittingOverThreadsKeepsTheBits) {
  // Every grain by itself, the last one first
  int splits = 0;
  const Parallel backwards{[](void* self, std::size_t size, std::size_t grain, RangeBody body) {
                             ++*static_cast<int*>(self);
                             for (std::size_t end = (size + grain - 1) / grain * grain; end > 0;
                                  end -= grain) {
                               body(end - grain, std::min(end, size));
                             }
                           },
                           &splits};
  const Parallel threads{
      [](void*, std::size_t size, std::size_t grain, RangeBody body) { ParallelFor(size, grain, body); },
      nullptr};
  const std::vector<Index> all = AllPoints(count());
  for (const Subject& subject : subjects_) {
    const std::vector<float> serial = Evaluate(subject, all);
    splits = 0;
    EXPECT_EQ(Differences(serial, all, Evaluate(subject, all, &backwards)), 0u) << subject.name;
    EXPECT_GT(splits, 0) << subject.name;
    EXPECT_EQ(Differences(serial, all, Evaluate(subject, all, &threads)), 0u) << subject.name;
  }
}

TEST_F(KernelLaw, WorkingInPlaceKeepsTheBits) {
  const std::vector<Index> all = AllPoints(count());
  for (const Subject& subject : subjects_) {
    const std::vector<float> apart = Evaluate(subject, all);
    PointBuffer buffer(count());
    CopyPoints(points_.view(), buffer.view());
    subject.run(all, all, buffer.view(), buffer.view(), nullptr);
    EXPECT_EQ(Differences(apart, all, buffer.Interleaved()), 0u) << subject.name;
  }
}

TEST_F(KernelLaw, TheDemandSuffices) {
  // All points are in the buffer, but those that no one asked for are poisoned
  Random random(22);
  const std::vector<Index> all = AllPoints(count());
  for (const Subject& subject : subjects_) {
    if (subject.local) continue;
    const std::vector<float> whole = Evaluate(subject, all);
    for (std::size_t size : {1ul, 7ul, 40ul}) {
      const std::vector<Index> points = RandomSubset(&random, count(), size), demand = subject.demand(points);
      PointBuffer in(count()), out(size);
      std::fill_n(in.view().x, 3 * PaddedCount(count()), std::numeric_limits<float>::quiet_NaN());
      for (Index p : demand) {
        in.view().x[p] = points_.view().x[p], in.view().y[p] = points_.view().y[p],
        in.view().z[p] = points_.view().z[p];
      }
      subject.run(points, all, in.view(), out.view(), nullptr);
      EXPECT_EQ(Differences(whole, points, out.Interleaved()), 0u) << subject.name;
    }
  }
}

TEST_F(KernelLaw, TheDemandIsMinimal) {
  // Each demanded point, made not-a-number, reaches an output
  Random random(23);
  for (const Subject& subject : subjects_) {
    if (subject.local) continue;
    const std::vector<Index> points = RandomSubset(&random, count(), 3), demand = subject.demand(points);
    PointBuffer in(demand.size()), out(points.size());
    for (std::size_t i = 0; i < demand.size(); ++i) {
      GatherPoints(points_.view(), demand, in.view());
      in.view().x[i] = std::numeric_limits<float>::quiet_NaN();
      subject.run(points, demand, in.view(), out.view(), nullptr);
      const std::vector<float> xyz = out.Interleaved();
      EXPECT_TRUE(std::any_of(xyz.begin(), xyz.end(), [](float f) { return std::isnan(f); }))
          << subject.name << ": point " << demand[i] << " changes nothing";
    }
  }
}

TEST_F(KernelLaw, NoPointsAreFine) {
  for (const Subject& subject : subjects_) EXPECT_TRUE(Evaluate(subject, {}).empty()) << subject.name;
}

}  // namespace
}  // namespace kpsa::engine
