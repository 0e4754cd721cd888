#include "host/bench/frame_errors.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "host/rig_frames.h"
#include "kpsa/accelerate.h"
#include "kpsa/training/error_split.h"

namespace kpsa::engine {
namespace {

constexpr Eigen::Index kFramesAtATime = 64;

// Poses and estimates of one subspace, a block of frames, less the mean.
struct SplitBlock {
  Eigen::MatrixXd modes, poses, estimates;
  Eigen::VectorXd mean;
  std::size_t points = 0;
};

SplitBlock MakeBlock(const AppliedSubspace& one) {
  const Subspace& s = *one.subspace;
  SplitBlock block;
  block.modes = Eigen::Map<const Eigen::MatrixXf>(s.kept_modes.values.data(),
                                                  static_cast<Eigen::Index>(s.kept_modes.rows),
                                                  static_cast<Eigen::Index>(s.kept_modes.columns))
                    .cast<double>();
  block.poses.resize(block.modes.rows(), kFramesAtATime);
  block.estimates.resize(block.modes.rows(), kFramesAtATime);
  block.mean.resize(block.modes.rows());
  const std::vector<float> zero(s.rows(), 0.0f);  // cues at their means
  Eigen::Index row = 0;
  for (const TileMap& tiles : s.tiles) {
    PointBuffer mean(tiles.points());
    tiles.Reconstruct(zero, mean.view());
    const ConstPointsView p = std::as_const(mean).view();
    const float* const components[3] = {p.x, p.y, p.z};
    for (std::size_t i = 0; i < p.count; ++i) {
      for (int c = 0; c < s.components; ++c) block.mean[row++] = components[c][i];
    }
    block.points += p.count;
  }
  return block;
}

// Points in the subspace's space, from row `first` on; the next row.
Eigen::Index StoreColumn(ConstPointsView points, const Matrix4* space_from_world, int components,
                         const Eigen::VectorXd& mean, Eigen::Index first,
                         Eigen::Ref<Eigen::VectorXd> column) {
  for (std::size_t i = 0; i < points.count; ++i) {
    Double3 p{points.x[i], points.y[i], points.z[i]};
    if (space_from_world != nullptr) p = TransformPoint(*space_from_world, p);
    for (int c = 0; c < components; ++c, ++first) column[first] = p[c] - mean[first];
  }
  return first;
}

}  // namespace

void FrameErrors::Append(const FrameErrors& later) {
  const auto append = [](auto* to, const auto& from) { to->insert(to->end(), from.begin(), from.end()); };
  append(&times, later.times);
  append(&projection, later.projection), append(&cueing, later.cueing), append(&storage, later.storage);
  append(&total, later.total), append(&soft_cache, later.soft_cache), append(&hit, later.hit);
  append(&miss, later.miss);
}

double OverFrames(const std::vector<double>& values) {
  double sum = 0;
  for (double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

bool HaveKeptModes(const std::vector<AppliedSubspace>& applied) {
  return std::ranges::all_of(applied, [](const AppliedSubspace& one) {
    return !one.subspace->kept_modes.values.empty() && !one.subspace->of_inner();
  });
}

Result<FrameErrors> SplitFrames(const RigOpener& opener, const RigChange& clip,
                                const AccelerationChoice& choice, const std::vector<double>& times,
                                const FullWeights& weights, const Watch& watch) {
  const Result<std::unique_ptr<OpenRig>> open = opener.open(clip);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  AccelerationChoice always = choice;
  always.every_frame = true;
  Compiler compiler;
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, always);
  if (!applied.ok()) return applied.status();
  FrameErrors errors;
  std::vector<SplitBlock> blocks;
  Request request;
  request.varying.push_back(rig.scene.time);
  for (const AppliedSubspace& one : *applied) {
    blocks.push_back(MakeBlock(one));
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      request.outputs.push_back({one.entry.points[p].points, {}});
      request.outputs.push_back({one.Output(*rig.graph, p), {}});
    }
    if (one.entry.space) {
      const int world = rig.graph->def(*one.entry.space).FindAttribute("worldMatrix");
      request.outputs.push_back({{*one.entry.space, world, -1, -1}, {}});
    }
  }
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  const Index time = (*plan)->FindVarying(rig.scene.time);

  const auto add = [&](std::size_t first, Eigen::Index count) {
    std::vector<double> squares[5];
    for (auto& list : squares) list.resize(static_cast<std::size_t>(count));
    std::size_t points = 0;
    for (std::size_t n = 0; n < blocks.size(); ++n) {
      const std::vector<SplitError> split =
          SplitErrors(blocks[n].modes, blocks[n].poses.leftCols(count), blocks[n].estimates.leftCols(count));
      points += blocks[n].points;
      for (std::size_t f = 0; f < split.size(); ++f) {
        const double emitted = (1 - weights[first + f][n]) * split[f].total;
        const double parts[5] = {split[f].projection, split[f].cueing, split[f].storage, split[f].total,
                                 emitted};
        for (std::size_t k = 0; k < 5; ++k) squares[k][f] += parts[k] * parts[k];
      }
    }
    std::vector<double>* const lists[5] = {&errors.projection, &errors.cueing, &errors.storage, &errors.total,
                                           &errors.soft_cache};
    for (std::size_t f = 0; f < squares[0].size(); ++f) {
      errors.times.push_back(times[first + f]);
      errors.hit.push_back(std::all_of(weights[first + f].begin(), weights[first + f].end(),
                                       [](double weight) { return weight == 0; }));
      errors.miss.push_back(std::any_of(weights[first + f].begin(), weights[first + f].end(),
                                        [](double weight) { return weight >= 1; }));
      for (std::size_t k = 0; k < 5; ++k)
        lists[k]->push_back(std::sqrt(squares[k][f] / static_cast<double>(std::max<std::size_t>(1, points))));
    }
  };
  Eigen::Index column = 0;
  for (std::size_t f = 0; f < times.size(); ++f) {
    if (watch.cancelled()) return CancelledStatus();
    if (time != kNoIndex) evaluator.Set(time, times[f]);
    if (const Status status = evaluator.Evaluate(); !status.ok()) return FailedAt(rig, times[f], status);
    Index output = 0;
    for (std::size_t n = 0; n < blocks.size(); ++n) {
      const AppliedSubspace& one = (*applied)[n];
      const auto outputs = static_cast<Index>(2 * one.entry.points.size());
      Matrix4 space_from_world;
      if (one.entry.space) space_from_world = InverseOrIdentity(evaluator.Get<Matrix4>(output + outputs));
      Eigen::Index row = 0;
      for (Index p = 0; p < outputs; p += 2) {
        const Matrix4* const space =
            one.entry.space && one.config->data().outputs_in_space[p / 2] != 0 ? &space_from_world : nullptr;
        const int components = one.subspace->components;
        StoreColumn(evaluator.Points(output + p), space, components, blocks[n].mean, row,
                    blocks[n].poses.col(column));
        row = StoreColumn(evaluator.Points(output + p + 1), space, components, blocks[n].mean, row,
                          blocks[n].estimates.col(column));
      }
      output += outputs + (one.entry.space ? 1 : 0);
    }
    if (++column == kFramesAtATime || f + 1 == times.size())
      add(f + 1 - static_cast<std::size_t>(column), column), column = 0;
  }
  return errors;
}

}  // namespace kpsa::engine
