#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "gltf/import.h"
#include "scenes/face_model.h"
#include "tests/scenes/heads.h"
#include "tests/scenes/mesh_checks.h"

namespace kpsa::engine::scenes {
namespace {

const HeadShape& Shape() { return ShapeOf(FaceDesign()); }
const SceneFiles& Face() {
  static const SceneFiles files = GenerateHead(FaceDesign(), Shape());
  return files;
}

std::string FileBytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in.good()) << path;
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Scenes, TheCommittedFilesAreWhatTheGeneratorWrites) {
  for (const auto& [folder, files] : {std::pair<std::string, SceneFiles>{"face/", Face()},
                                      {"boy/", GenerateHead(BoyDesign(), ShapeOf(BoyDesign()))},
                                      {"animal/", GenerateHead(AnimalDesign(), ShapeOf(AnimalDesign()))},
                                      {"hello/", GenerateHello()},
                                      {"gi/", GenerateRoom()},
                                      {"car/", GenerateCar()}}) {
    for (const auto& [name, bytes] : files) {
      EXPECT_TRUE(FileBytes(std::string(KPSA_SCENES_DIR) + "/" + folder + name) == bytes)
          << folder << name << " differs: run generate_scenes " << KPSA_SCENES_DIR;
    }
  }
}

TEST(Scenes, TheFilesAreGlb) {
  const std::string& glb = Face().at("face.glb");
  std::uint32_t head[5];
  ASSERT_GT(glb.size(), sizeof(head));
  std::memcpy(head, glb.data(), sizeof(head));
  EXPECT_EQ(head[0], 0x46546c67u);
  EXPECT_EQ(head[1], 2u);
  EXPECT_EQ(head[2], glb.size());
  EXPECT_LT(glb.size(), 2u << 20);
}

gltf::Character Load(const SceneFiles& files, const std::string& name) {
  const std::string& glb = files.at(name);
  auto character = gltf::LoadGltfFromMemory(
      std::span(reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()), "", name);
  EXPECT_TRUE(character.ok()) << character.status().ToString();
  return character.ok() ? *character : gltf::Character();
}

TEST(Scenes, TheFaceLoadsAsItWasMade) {
  const gltf::Character face = Load(Face(), "face.glb");
  ASSERT_EQ(face.meshes.size(), 2u);
  const gltf::Mesh &skin = face.meshes[0], &eyes = face.meshes[1];
  ASSERT_EQ(skin.vertex_count(), Shape().points.size());
  const std::vector<Expression> expressions = FaceExpressions(FaceDesign(), Shape());
  ASSERT_EQ(skin.targets.size(), expressions.size());
  for (std::size_t t = 0; t < expressions.size(); ++t) {
    EXPECT_EQ(skin.targets[t].name, expressions[t].name);
    ASSERT_FALSE(skin.targets[t].vertices.empty());
    const Double3 d = expressions[t].deltas[skin.targets[t].vertices[0]];
    EXPECT_NEAR(skin.targets[t].deltas[0], d.x * 0.01, 1e-8);
  }
  for (std::size_t i = 0; i < Shape().points.size(); ++i) {
    EXPECT_NEAR(skin.positions[3 * i + 1], Shape().points[i].y * 0.01, 1e-7);
  }
  EXPECT_EQ(skin.colors.size(), skin.positions.size());
  EXPECT_EQ(eyes.colors.size(), eyes.positions.size());
  EXPECT_TRUE(skin.skinned() && eyes.skinned());
  for (const char* clip : {"extreme", "talk_train", "talk", "emotions"})
    EXPECT_NE(face.FindClip(clip), kNoIndex);
  for (const char* joint : {"root", "neck", "head", "jaw", "eye.L", "eye.R", "face_mesh", "eyes"}) {
    EXPECT_TRUE(std::any_of(face.nodes.begin(), face.nodes.end(), [&](const gltf::Node& n) {
      return n.name == joint;
    })) << joint;
  }
  EXPECT_TRUE(face.warnings.empty());
}

TEST(Scenes, TheColumnLoadsAndBends) {
  const gltf::Character column = Load(GenerateHello(), "hello.glb");
  ASSERT_EQ(column.meshes.size(), 1u);
  EXPECT_TRUE(column.meshes[0].colors.empty());
  ASSERT_EQ(column.clips.size(), 1u);
  EXPECT_NEAR(column.clips[0].duration, 2, 1e-6);
}

TEST(Head, HasItsSizeAndItsNumberOfPoints) {
  EXPECT_GE(Shape().points.size(), 4000u);
  EXPECT_LE(Shape().points.size(), 5000u);
  double low = 1e9, high = -1e9, width = 0;
  for (const Double3& p : Shape().points) {
    low = std::min(low, p.y), high = std::max(high, p.y), width = std::max(width, 2 * std::fabs(p.x));
  }
  EXPECT_EQ(low, 0);
  EXPECT_NEAR(high, 30, 1);
  EXPECT_NEAR(width, 17, 2);
}

TEST(Head, IsSymmetricToTheBit) {
  for (std::size_t i = 0; i < Shape().points.size(); ++i) {
    const Double3 p = Shape().points[i], m = Shape().points[static_cast<std::size_t>(Shape().mirror[i])];
    EXPECT_EQ(p.x, -m.x);
    EXPECT_EQ(p.y, m.y);
    EXPECT_EQ(p.z, m.z);
  }
}

// The neck and the sockets.
TEST(Head, IsAManifoldWithThreeBorders) { EXPECT_EQ(CountBorders(Shape().quads, "face"), 3); }

TEST(Head, NoTwoPointsCoincideAndNoTriangleIsFlat) {
  CheckPointsAndTriangles(Shape().points, Shape().quads, 1e-5, "face");
}

TEST(Head, WeightsAddUpToExactlyOneInFourJoints) {
  std::set<int> used;
  for (const auto& shares : FaceWeights(FaceDesign(), Shape())) {
    for (double w : shares) EXPECT_GE(w, 0);
    const Influences influences = MakeInfluences(std::span(shares.data(), FaceDesign().joints.size()));
    float sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sum += influences.weights[k];
      if (influences.weights[k] > 0) used.insert(influences.joints[k]);
    }
    EXPECT_EQ(sum, 1.0f);
  }
  EXPECT_EQ(used.size(), FaceDesign().joints.size());
}

TEST(Head, TheJawMovesTheLowerLipAndNotTheUpper) {
  const auto weights = FaceWeights(FaceDesign(), Shape());
  const std::vector<int>& contact = Shape().mouth_rings[static_cast<std::size_t>(Shape().contact_ring)];
  const std::size_t quarter = contact.size() / 4;
  EXPECT_LT(weights[static_cast<std::size_t>(contact[quarter])][kJaw], 0.01);
  EXPECT_GT(weights[static_cast<std::size_t>(contact[3 * quarter])][kJaw], 0.99);
}

TEST(Expressions, AreManyNamedLocalAndMirrored) {
  const std::vector<Expression> expressions = FaceExpressions(FaceDesign(), Shape());
  EXPECT_GE(expressions.size(), 40u);
  std::map<std::string, const Expression*> by_name;
  for (const Expression& e : expressions) {
    EXPECT_TRUE(by_name.emplace(e.name, &e).second) << e.name;
    std::size_t moved = 0;
    double largest = 0;
    for (const Double3& d : e.deltas) {
      moved += Length(d) > 2e-4;
      largest = std::max(largest, Length(d));
    }
    EXPECT_GT(moved, 20u) << e.name;
    EXPECT_LT(moved, e.deltas.size() / 3) << e.name;
    EXPECT_GT(largest, 0.15) << e.name;
    EXPECT_LT(largest, 2.0) << e.name;
  }
  for (const char* name : {"smile", "frown", "browInnerUp", "browOuterUp", "browDown", "blink", "squint",
                           "sneer", "cheekPuff"}) {
    const Expression *left = by_name.at(std::string(name) + ".L"),
                     *right = by_name.at(std::string(name) + ".R");
    for (std::size_t i = 0; i < left->deltas.size(); ++i) {
      const Double3 d = left->deltas[i], m = right->deltas[static_cast<std::size_t>(Shape().mirror[i])];
      EXPECT_EQ(d, (Double3{-m.x, m.y, m.z})) << name;
    }
  }
  for (const char* name : {"mouthOpen", "pucker"}) EXPECT_TRUE(by_name.contains(name));
}

TEST(Expressions, ABlinkClosesTheEyeWithoutCuttingTheEyeball) {
  const std::vector<Expression> expressions = FaceExpressions(FaceDesign(), Shape());
  const auto blink = std::find_if(expressions.begin(), expressions.end(),
                                  [](const Expression& e) { return e.name == "blink.L"; });
  const std::vector<int>& edge = Shape().eye_rings[static_cast<std::size_t>(Shape().lid_ring)];
  const std::size_t n = edge.size(), top = n / 4;
  const auto at = [&](std::size_t k) { return static_cast<std::size_t>(edge[k]); };
  const auto closed = [&](std::size_t k) { return Shape().points[at(k)] + blink->deltas[at(k)]; };
  const double open_gap = Length(Shape().points[at(top)] - Shape().points[at(n - top)]);
  EXPECT_GT(open_gap, 0.7);
  EXPECT_LT(Length(closed(top) - closed(n - top)), 0.1 * open_gap);
  for (std::size_t k = 0; k < n; ++k) {
    for (double share : {0.25, 0.5, 0.75, 1.0}) {
      const Double3 p = Shape().points[at(k)] + blink->deltas[at(k)] * share;
      EXPECT_GT(Length(p - FaceDesign().eye_center), FaceDesign().eye_radius - 0.02) << k << " at " << share;
    }
  }
}

TEST(Clips, HaveUnitRotationsAndWeightsInRange) {
  std::vector<std::string> names;
  for (const Expression& e : FaceExpressions(FaceDesign(), Shape())) names.push_back(e.name);
  const std::vector<GlbClip> clips = FaceClips(FaceDesign(), names, 6);
  ASSERT_EQ(clips.size(), 4u);
  EXPECT_EQ(clips[0].name, "extreme");
  EXPECT_EQ(clips[1].name, "talk_train");
  EXPECT_EQ(clips[2].name, "talk");
  EXPECT_EQ(clips[3].name, "emotions");
  for (const GlbClip& clip : clips) {
    for (const GlbChannel& channel : clip.channels) {
      const std::size_t width = channel.weights ? names.size() : 4;
      ASSERT_EQ(channel.values.size(), width * static_cast<std::size_t>(clip.frames));
      for (std::size_t i = 0; channel.weights && i < channel.values.size(); ++i) {
        EXPECT_GE(channel.values[i], 0);
        EXPECT_LE(channel.values[i], 1);
      }
      for (std::size_t i = 0; !channel.weights && i < channel.values.size(); i += 4) {
        double length = 0;
        for (std::size_t k = 0; k < 4; ++k) length += double{channel.values[i + k]} * channel.values[i + k];
        EXPECT_NEAR(length, 1, 1e-6);
      }
    }
  }
  // `extreme` shows each expression alone, at full
  const GlbChannel& weights = clips[0].channels.back();
  for (std::size_t e = 0; e < names.size(); ++e) {
    bool alone = false;
    for (int f = 0; f < clips[0].frames && !alone; ++f) {
      const float* row = &weights.values[static_cast<std::size_t>(f) * names.size()];
      alone = row[e] == 1 &&
              std::count(row, row + names.size(), 0.0f) == static_cast<std::ptrdiff_t>(names.size()) - 1;
    }
    EXPECT_TRUE(alone) << names[e];
  }
  // Train and test differ
  const std::vector<float>&train = clips[1].channels.back().values, &test = clips[2].channels.back().values;
  EXPECT_FALSE(std::equal(test.begin(), test.end(), train.begin()));
}

// The test clip is rich: its principal modes are counted in expression space with the skin left out, which is
// a lower bound of what the whole stack does.
TEST(Clips, TheTestClipNeedsManyModes) {
  const std::vector<Expression> expressions = FaceExpressions(FaceDesign(), Shape());
  std::vector<std::string> names;
  for (const Expression& e : expressions) names.push_back(e.name);
  const GlbClip talk = FaceClips(FaceDesign(), names, 6)[2];
  const GlbChannel& weights = talk.channels.back();
  const std::size_t n = names.size(), frames = static_cast<std::size_t>(talk.frames);
  // Covariance of the weights and Gram matrix of the shapes; the eigenvalues of their product are the
  // variances
  std::vector<double> mean(n), covariance(n * n), gram(n * n);
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t e = 0; e < n; ++e) mean[e] += weights.values[f * n + e] / static_cast<double>(frames);
  }
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      for (std::size_t f = 0; f < frames; ++f) {
        covariance[a * n + b] +=
            (weights.values[f * n + a] - mean[a]) * (weights.values[f * n + b] - mean[b]);
      }
      for (std::size_t i = 0; i < Shape().points.size(); ++i)
        gram[a * n + b] += Dot(expressions[a].deltas[i], expressions[b].deltas[i]);
    }
  }
  // gram = L L^T (Cholesky), S = L^T covariance L, then Jacobi rotations
  std::vector<double> lower(n * n);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      double sum = gram[a * n + b];
      for (std::size_t k = 0; k < b; ++k) sum -= lower[a * n + k] * lower[b * n + k];
      lower[a * n + b] = a == b ? std::sqrt(std::max(sum, 1e-12)) : sum / lower[b * n + b];
    }
  }
  std::vector<double> s(n * n), half(n * n);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      for (std::size_t k = 0; k < n; ++k) half[a * n + b] += covariance[a * n + k] * lower[k * n + b];
    }
  }
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      for (std::size_t k = 0; k < n; ++k) s[a * n + b] += lower[k * n + a] * half[k * n + b];
    }
  }
  for (int sweep = 0; sweep < 12; ++sweep) {
    for (std::size_t p = 0; p < n; ++p) {
      for (std::size_t q = p + 1; q < n; ++q) {
        const double angle = 0.5 * std::atan2(2 * s[p * n + q], s[q * n + q] - s[p * n + p]);
        const double c = std::cos(angle), d = std::sin(angle);
        for (std::size_t k = 0; k < n; ++k) {
          const double x = s[k * n + p], y = s[k * n + q];
          s[k * n + p] = c * x - d * y, s[k * n + q] = d * x + c * y;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double x = s[p * n + k], y = s[q * n + k];
          s[p * n + k] = c * x - d * y, s[q * n + k] = d * x + c * y;
        }
      }
    }
  }
  std::vector<double> variances;
  double total = 0;
  for (std::size_t k = 0; k < n; ++k)
    variances.push_back(std::max(s[k * n + k], 0.0)), total += variances.back();
  std::sort(variances.rbegin(), variances.rend());
  double sum = 0;
  int modes = 0;
  for (; sum < 0.999 * total; ++modes) sum += variances[static_cast<std::size_t>(modes)];
  EXPECT_GE(modes, 25);
}

TEST(Curves, RunFromSideToSide) {
  const auto x = [](int i) { return Shape().points[static_cast<std::size_t>(i)].x; };
  for (const auto* curve : {&Shape().upper_lip_curve, &Shape().lower_lip_curve, &Shape().brow_curve_left}) {
    for (std::size_t k = 1; k < curve->size(); ++k) EXPECT_LT(x((*curve)[k - 1]), x((*curve)[k]));
  }
  EXPECT_EQ(Shape().upper_lip_curve.front(), Shape().lower_lip_curve.front());
  EXPECT_EQ(Shape().upper_lip_curve.back(), Shape().lower_lip_curve.back());
}

TEST(Influences, KeepTheFourLargest) {
  const double weights[] = {0.05, 0.3, 0.1, 0.2, 0.35};
  const Influences out = MakeInfluences(weights);
  EXPECT_EQ(out.joints, (std::array<std::uint16_t, 4>{4, 1, 3, 2}));
  EXPECT_EQ(out.weights[0] + out.weights[1] + out.weights[2] + out.weights[3], 1.0f);
  EXPECT_NEAR(out.weights[0], 0.35 / 0.95, 2e-3);
}

}  // namespace
}  // namespace kpsa::engine::scenes
