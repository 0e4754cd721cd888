// From a linear map to tiles (kpsa/tiles.h): which cues each tile reads, its factors, their precision.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "kpsa/tiles.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

struct TileOptions {
  double rms_budget = 0;  // expected RMS point error that a tile may add, scene units; > 0
  double max_budget =
      std::numeric_limits<double>::infinity();  // largest point error that it may add in the samples
  // Of what is left out of a tile anyway (RMS, TileInputs::left_out): where that is more than rms_budget, it
  // is the tile's, and max_budget grows with it.
  double left_out_share = 0;
};
// What is known of y.
struct TileInputs {
  Eigen::MatrixXd covariance;  // [r x r]; empty: the identity
  Eigen::MatrixXd samples;     // [r x S] y of some poses, for max_budget; may be empty
  Eigen::VectorXd left_out;    // [cN] variance of every row that no y tells; empty: 0
  // Poses that products are fitted to: their rows hold f - mu of the output from `first_column` on. Null:
  // none.
  const PoseMatrix* poses = nullptr;
  const Eigen::MatrixXd* measured = nullptr;  // y of these poses [r x T]
  std::size_t first_column = 0;
  std::size_t clip_poses = 0;                     // the first poses, neighbours in time of each other
  Eigen::VectorXd row_mean = {}, row_scale = {};  // [r] of y = (raw - mean) * scale, where tiles have joints
};
// What the tiles cost in accuracy; scene units. Where precision or the number of attempts do not allow the
// budgets, these exceed them.
struct TileReport {
  double rms = 0, worst_tile_rms = 0;  // expected
  double largest = 0;                  // in the samples
  std::size_t direct_tiles = 0;
};
// gain: B [cN x r]; mean [cN] interleaved. Rows of one output.
TileMap BuildTiles(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components,
                   const TileInputs& inputs, const TileOptions& options, TileReport* report = nullptr);
// The same where each tile has a map of its own, from some of the cues: asked for tile after tile, from
// several threads; r as TileInputs has it. Of the inputs, covariance and left_out are the models'.
struct TileModel {
  std::vector<std::uint32_t> columns;     // of y, ascending
  Eigen::MatrixXd gain;                   // [3n x |columns|]
  Eigen::MatrixXd covariance;             // of these columns
  double left_out = 0;                    // variance of a point that they do not tell
  double of_budget = 1;                   // how much of the budgets it has
  std::vector<std::uint32_t> joint_rows;  // where the tile lies in the space of a joint: those of its matrix
  double joint_scale = 1;                 // of that joint: the tile lies there as if it had none (JointScale)
  Eigen::VectorXd mean;                   // [3n], there; empty: as BuildTiles has it
  Eigen::MatrixXd target;  // [3n x T] less the mean, of the poses that products are fitted to; empty: theirs
};
TileMap BuildTiles(const std::function<TileModel(std::size_t tile)>& models, const Eigen::VectorXd& mean,
                   int components, std::size_t inputs_count, const TileInputs& inputs,
                   const TileOptions& options, TileReport* report = nullptr);
// The same, some tiles after the other: of each part its models and its inputs, whose poses, measured alike, hold that
// part from first_column on.
class TileBuilder {
 public:
  TileBuilder(int components, std::size_t inputs_count);
  ~TileBuilder();
  TileBuilder(const TileBuilder&) = delete;
  TileBuilder& operator=(const TileBuilder&) = delete;
  void Add(std::size_t tiles, const std::function<TileModel(std::size_t tile)>& models,
           const TileInputs& inputs, const TileOptions& options);
  // mean: of all rows [cN]; inputs: row_mean and row_scale.
  TileMap Finish(const Eigen::VectorXd& mean, const TileInputs& inputs, TileReport* report = nullptr);

 private:
  struct Made;
  const int components_;
  const std::size_t inputs_count_;
  std::unique_ptr<Made> made_;
};

}  // namespace kpsa::engine
