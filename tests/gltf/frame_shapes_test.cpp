// The basis of many frames of many vertices, which is found without their whole matrix, beside the exact one.
#include "gltf/frame_shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kpsa::engine {
namespace {

constexpr std::size_t kVertices = 240, kModes = 12;

// Frames that are mixtures of kModes shapes, ever weaker ones, and noise of a micrometre.
PointCacheMesh Mixtures(std::size_t frames) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<std::vector<double>> shapes(kModes, std::vector<double>(3 * kVertices));
  for (auto& shape : shapes) {
    for (double& x : shape) x = unit(random);
  }
  PointCacheMesh mesh{"mesh", kVertices, {}, {}};
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t i = 0; i < 3 * kVertices; ++i) {
      double x = 1e-6 * unit(random);
      for (std::size_t k = 0; k < kModes; ++k)
        x += std::pow(0.5, static_cast<double>(k)) * shapes[k][i] *
             std::sin(0.02 * static_cast<double>(t * (k + 1)) + static_cast<double>(k));
      mesh.frames.push_back(static_cast<float>(x));
    }
  }
  return mesh;
}

TEST(FrameShapes, OfManyFramesAreAsGoodAsTheExactOnes) {
  // 500 frames are below the limit of what is solved exactly, 700 are beyond; both hold the same motion
  for (const int most : {5, static_cast<int>(kModes)}) {
    const FrameShapes exact = ShapesOfFrames(Mixtures(500), 500, 0, most);
    const FrameShapes found = ShapesOfFrames(Mixtures(700), 700, 0, most);
    ASSERT_EQ(found.shapes.size(), static_cast<std::size_t>(most));
    const double exact_rms = std::sqrt(exact.square_sum / 500), found_rms = std::sqrt(found.square_sum / 700);
    EXPECT_LT(found_rms, 1.05 * exact_rms) << most;
    EXPECT_LT(found.max_residual, 1.3 * exact.max_residual) << most;
    if (most == static_cast<int>(kModes)) {
      EXPECT_LT(found.max_residual, 4e-6);
    }
  }
  const FrameShapes again = ShapesOfFrames(Mixtures(700), 700, 0, 5),
                    once = ShapesOfFrames(Mixtures(700), 700, 0, 5);
  EXPECT_EQ(again.shapes, once.shapes);
  EXPECT_EQ(again.weights, once.weights);
}

}  // namespace
}  // namespace kpsa::engine
