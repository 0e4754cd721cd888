#include "kpsa/training/tile_trust.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/check.h"

namespace kpsa::engine {

std::vector<double> TrustInTiles(std::span<const ScoreJudge> judges) {
  const std::size_t tiles = judges.empty() ? 0 : judges[0].pose.tile_doubts.size();
  const auto fourth = [](float value) {
    const double square = static_cast<double>(value) * static_cast<double>(value);
    return square * square;
  };
  std::vector<double> errors(tiles), doubts(tiles), trust(tiles);
  for (const ScoreJudge& judge : judges) {
    if (judge.guard >= 1) continue;
    for (std::size_t t = 0; t < tiles; ++t) {
      errors[t] += fourth(judge.pose.tile_errors[t]);
      doubts[t] += fourth(judge.pose.tile_doubts[t]);
    }
  }
  double most = 0;
  for (std::size_t t = 0; t < tiles; ++t) {
    const double ratio = doubts[t] > 0 ? errors[t] / doubts[t] : 0;
    trust[t] = std::isfinite(ratio) ? std::sqrt(std::sqrt(ratio)) : 0;
    most = std::max(most, trust[t]);
  }
  if (!(most > 0)) return {};
  for (double& of : trust) of = std::max(of / most, kLeastTrust);
  return trust;
}

void WeighDoubts(std::span<const double> trust, const Subspace& subspace, std::span<ScoreJudge> judges) {
  std::vector<double> of_patches(subspace.patches.patches);
  for (ScoreJudge& judge : judges) {
    JudgedPose& pose = judge.pose;
    KPSA_CHECK_EQ(pose.tile_doubts.size(), trust.size());
    pose.doubt = 0;
    for (std::size_t t = 0; t < trust.size(); ++t) {
      pose.tile_doubts[t] *= static_cast<float>(trust[t]);
      pose.doubt = std::max(pose.doubt, static_cast<double>(pose.tile_doubts[t]));
    }
    if (of_patches.empty() || pose.patches.empty()) continue;
    LargestOfPatches(subspace, pose.tile_doubts, of_patches);
    for (std::size_t p = 0; p < of_patches.size(); ++p) pose.patches[p].score = of_patches[p];
  }
}

void WeighTiles(std::span<const double> trust, Subspace* subspace) {
  for (TileMap& tiles : subspace->tiles) {
    tiles = tiles.WithDoubts(trust.first(tiles.tiles()));
    trust = trust.subspan(tiles.tiles());
  }
}

}  // namespace kpsa::engine
