#include "kpsa/training/tile_cues.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "base/parallel.h"
#include "kpsa/subspace.h"
#include "kpsa/training/cue_values.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/greedy_columns.h"
#include "kpsa/training/point_errors.h"
#include "kpsa/training/quantile.h"
#include "kpsa/training/ridge.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

// Of a tile: scalars, and points; more moves points that go through a step, and what these lie among
constexpr std::size_t kMostCues = 100, kMostPoints = 12, kMostCuesBeforeStep = 160,
                      kMostPointsBeforeStep = 20;
constexpr double kFirstRidge = 1e-7;  // of the mean variance of what is measured
constexpr double kMapRidge[] = {1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4};
constexpr std::size_t kMapValidated = 8;     // every so manieth pose says which of them
constexpr std::size_t kStride = 2;           // poses that choose, every so manieth,
constexpr std::size_t kMostChoosing = 1600;  // but no more than these; half of them compare spaces, at
constexpr Eigen::Index kTrialPoints = 4;     // every so manieth point,
constexpr Eigen::Index kTried = 5;           // as of every so manieth of these poses
constexpr std::size_t kSpaceProbes = 6,
                      kProbePoses = 240;  // points and poses that say which joints carry a tile,
constexpr std::size_t kSpaces = 3;        // of which so many are compared, also
constexpr std::size_t kParting = 8;       // in so many poses in which two of them part most
constexpr double kJointWorth = 0.8;       // of the error (fourth powers) without
constexpr double kSeen = 2e-3;            // tolerances: what moves points less is not seen
constexpr double kCueGain = 2e-3;         // of what all scalars leave: a cue has to tell more
constexpr double kNoPointsBelow = 0.25, kFewPoses = 0.99;  // tolerances; share of the poses: no points below
constexpr double kPointGain = 4e-3;                        // of what is left without any points
constexpr std::size_t kLeastPoints = 6;  // where values move the tile, which act before the skin
constexpr double kAimed = 0.3;           // tolerances: poses and points with larger errors count more,
constexpr double kMostPose = 20, kMostPoint = 8;     // so many times at most
constexpr Eigen::Index kResidualDirections = 24;     // of what is left
constexpr double kWeighed = 0.1, kMostWeight = 100;  // the same in the map: tolerances, times
constexpr int kWeighings = 2;

Eigen::MatrixXd Centered(Eigen::MatrixXd rows) {
  const Eigen::VectorXd mean = rows.rowwise().mean();
  rows.colwise() -= mean;
  return rows;
}
std::vector<std::size_t> EveryPose(const PoseMatrix& poses, std::size_t stride) {
  std::vector<std::size_t> rows;
  for (std::size_t t = 0; t < poses.poses(); t += stride) rows.push_back(t);
  return rows;
}

// Some poses as they are seen from a joint (kNoIndex: from the space), but for what it scales. Rows are centred, and in
// scene units. Without poses where the joint's matrix has no inverse.
class View {
 public:
  View(const PoseMatrix& poses, const TileCueOptions& options, Index joint, std::vector<std::size_t> rows)
      : poses_(poses), options_(options), joint_(joint), rows_(std::move(rows)) {
    const double scale = joint == kNoIndex ? 1 : JointScale(poses, options.mean, joint);
    for (const std::size_t t : rows_) {
      std::optional<Affine> back = Affine(Affine::Identity());
      if (joint != kNoIndex)
        back = InverseOf(RelativeMatrix(poses.layout(), poses.row(t), options.mean, joint));
      if (back) *back *= scale;
      if (!back) {
        back_.clear();
        break;
      }
      back_.push_back(*back);
    }
  }
  bool empty() const { return back_.empty(); }
  Eigen::Index poses() const { return static_cast<Eigen::Index>(back_.size()); }

  Eigen::MatrixXd Points(std::size_t first_column, std::size_t height) const {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(height), poses());
    Put(first_column, height / 3, 0, &rows);
    return Centered(std::move(rows));
  }
  // What tiles are fitted to: centred, and the mean.
  void Target(const TileCandidates& tile, TileModel* model) const {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(tile.height), poses());
    Put(tile.first_column, tile.height / 3, 0, &rows);
    model->mean = rows.rowwise().mean();
    model->target = Centered(std::move(rows));
    if (joint_ == kNoIndex)  // the poses are centred
      model->mean += options_.mean->segment(static_cast<Eigen::Index>(tile.first_column), model->mean.size());
  }
  Eigen::MatrixXd Cues(std::span<const CueRef> cues) const {
    const PoseLayout& layout = poses_.layout();
    std::size_t height = 0;
    for (const CueRef& cue : cues) height += CueHeight(layout, cue);
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(height), poses());
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < cues.size(); ++k) {
      const CueRef& cue = cues[k];
      if (cue.kind != CueKind::kScalar) {
        Put(CueColumn(layout, cue), 1, row, &rows);
        row += 3;
      } else if (cue.index < layout.relative_begin) {
        for (Eigen::Index t = 0; t < poses(); ++t)
          rows(row, t) = options_.turn_reach * static_cast<double>(RowOf(t)[CueColumn(layout, cue)]);
        ++row;
      } else {  // entries of one matrix that follow each other
        std::size_t last = k + 1;
        const Index entry = (cue.index - layout.relative_begin) % 12;
        while (last < cues.size() && cues[last].index == cue.index + (last - k) && entry + (last - k) < 12)
          ++last;
        const double turn = options_.turn_reach / JointScale(poses_, options_.mean, cue.index - entry);
        for (Eigen::Index t = 0; t < poses(); ++t) {
          const Affine matrix = Product(back_[static_cast<std::size_t>(t)],
                                        RelativeMatrix(layout, RowOf(t), options_.mean, cue.index - entry));
          for (std::size_t i = k; i < last; ++i) {
            const std::size_t e = entry + (i - k);
            rows(row + static_cast<Eigen::Index>(i - k), t) = (e < 9 ? turn : 1) * matrix.data()[e];
          }
        }
        row += static_cast<Eigen::Index>(last - k);
        k = last - 1;
      }
    }
    return Centered(std::move(rows));
  }

 private:
  std::span<const float> RowOf(Eigen::Index t) const {
    return poses_.row(rows_[static_cast<std::size_t>(t)]);
  }
  void Put(std::size_t column, std::size_t points, Eigen::Index row, Eigen::MatrixXd* to) const {
    const auto height = static_cast<Eigen::Index>(3 * points);
    const Eigen::VectorXd mean = options_.mean->segment(static_cast<Eigen::Index>(column), height);
    Eigen::VectorXd at(height);
    for (Eigen::Index t = 0; t < poses(); ++t) {
      at = Eigen::Map<const Eigen::VectorXf>(RowOf(t).data() + column, height).cast<double>();
      if (joint_ != kNoIndex) {
        at += mean;
        const Affine& back = back_[static_cast<std::size_t>(t)];
        Eigen::Map<Eigen::Matrix3Xd> xyz(at.data(), 3, height / 3);
        xyz = ((back.leftCols<3>() * xyz).colwise() + back.col(3)).eval();
      }
      to->col(t).segment(row, height) = at;
    }
  }

  const PoseMatrix& poses_;
  const TileCueOptions& options_;
  const Index joint_;
  const std::vector<std::size_t> rows_;
  std::vector<Affine> back_;
};

// Chooses for one tile.
class TileChooser {
 public:
  TileChooser(const PoseMatrix& poses, const TileCandidates& tile, const TileCueOptions& options)
      : poses_(poses),
        tile_(tile),
        options_(options),
        stride_(std::max(kStride, (poses.poses() + kMostChoosing - 1) / kMostChoosing)) {}

  std::vector<CueRef> Run() {
    ChooseSpace();
    const View view(poses_, options_, joint_, EveryPose(poses_, stride_));
    y_ = view.Points(tile_.first_column, tile_.height);
    ChooseScalars(view);
    FindResidual();
    const Eigen::VectorXd largest = errors_.colwise().maxCoeff().transpose();
    const double most = Quantile({largest.begin(), largest.end()}, kFewPoses);
    if (most > kNoPointsBelow * options_.tolerance && !tile_.points.empty()) AddPoints(view, largest);
    return std::move(chosen_);
  }
  Index joint() const { return joint_; }

 private:
  std::vector<CueRef> ScalarsIn(Index joint) const {
    std::vector<CueRef> cues;
    for (const Index other : tile_.joints) {
      for (Index e = 0; e < 12 && other != joint; ++e) cues.push_back({CueKind::kScalar, other + e, joint});
    }
    cues.insert(cues.end(), options_.values.begin(), options_.values.end());
    return cues;
  }

  // Of the space and the joints in whose spaces the tile moves least, where it is told best.
  void ChooseSpace() {
    const std::size_t stride = std::max<std::size_t>(1, poses_.poses() / kProbePoses),
                      points = tile_.height / 3, probes = std::min(kSpaceProbes, points);
    std::vector<std::pair<double, Index>> moved;
    for (const Index joint : tile_.joints) {
      const View view(poses_, options_, joint, EveryPose(poses_, stride));
      if (view.empty()) continue;
      double sum = 0;
      for (std::size_t p = 0; p < probes; ++p) {
        const std::size_t point = (2 * p + 1) * points / (2 * probes);
        sum += view.Points(tile_.first_column + 3 * point, 3).squaredNorm();
      }
      moved.emplace_back(sum, joint);
    }
    std::sort(moved.begin(), moved.end());
    if (moved.empty()) return;
    if (moved.size() > kSpaces) moved.resize(kSpaces);
    const std::vector<std::size_t> apart = WhereTheyPart(moved);
    double least = kJointWorth * ErrorIn(kNoIndex, apart);
    for (const auto& [sum, joint] : moved) {
      const double error = ErrorIn(joint, apart);
      if (error < least) least = error, joint_ = joint;
    }
  }

  // Poses in which joints, and the space, would carry the middle of the tile farthest from each other. A tongue hardly
  // moves in its jaw: whose chin it is, few poses tell.
  std::vector<std::size_t> WhereTheyPart(const std::vector<std::pair<double, Index>>& joints) const {
    const Eigen::VectorXd& mean = *options_.mean;
    const auto first = static_cast<Eigen::Index>(tile_.first_column),
               points = static_cast<Eigen::Index>(tile_.height / 3);
    const Eigen::Vector3d middle =
        Eigen::Map<const Eigen::Matrix3Xd>(mean.data() + first, 3, points).rowwise().mean();
    std::vector<Eigen::Matrix3Xd> carried{middle.replicate(1, static_cast<Eigen::Index>(poses_.poses()))};
    const std::vector<float> no_pose(poses_.layout().columns(), 0.0f);
    for (const auto& [sum, joint] : joints) {
      const std::optional<Affine> back =
          InverseOf(RelativeMatrix(poses_.layout(), no_pose, options_.mean, joint));
      if (!back) continue;
      const Eigen::Vector3d in_joint = back->leftCols<3>() * middle + back->col(3);
      Eigen::Matrix3Xd& to = carried.emplace_back(3, carried[0].cols());
      for (Eigen::Index t = 0; t < to.cols(); ++t) {
        const Affine matrix =
            RelativeMatrix(poses_.layout(), poses_.row(static_cast<std::size_t>(t)), options_.mean, joint);
        to.col(t) = matrix.leftCols<3>() * in_joint + matrix.col(3);
      }
    }
    std::set<std::size_t> found;
    for (std::size_t a = 0; a < carried.size(); ++a) {
      for (std::size_t b = a + 1; b < carried.size(); ++b) {
        const Eigen::VectorXd apart = (carried[a] - carried[b]).colwise().squaredNorm();
        std::vector<std::size_t> order = EveryPose(poses_, 1);
        const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(kParting, order.size()));
        std::partial_sort(order.begin(), end, order.end(), [&](std::size_t s, std::size_t t) {
          return std::pair(-apart[static_cast<Eigen::Index>(s)], s) <
                 std::pair(-apart[static_cast<Eigen::Index>(t)], t);
        });
        found.insert(order.begin(), end);
      }
    }
    return {found.begin(), found.end()};
  }

  // Mean fourth power of a point's error in poses that are not fitted to, some of which are given.
  double ErrorIn(Index joint, const std::vector<std::size_t>& apart) const {
    std::vector<std::size_t> rows = EveryPose(poses_, 2 * stride_);
    std::erase_if(rows, [&](std::size_t t) { return std::ranges::binary_search(apart, t); });
    const std::size_t first_apart = rows.size();
    rows.insert(rows.end(), apart.begin(), apart.end());
    const View view(poses_, options_, joint, std::move(rows));
    if (view.empty()) return std::numeric_limits<double>::infinity();
    const Eigen::MatrixXd all = view.Points(tile_.first_column, tile_.height),
                          x = Moving(view.Cues(ScalarsIn(joint)), nullptr);
    Eigen::MatrixXd y((all.rows() / 3 + kTrialPoints - 1) / kTrialPoints * 3, all.cols());
    for (Eigen::Index i = 0; 3 * i < y.rows(); ++i)
      y.middleRows(3 * i, 3) = all.middleRows(3 * kTrialPoints * i, 3);
    std::vector<Eigen::Index> held, fitted;
    for (Eigen::Index t = 0; t < y.cols(); ++t)
      (t % kTried == 2 || t >= static_cast<Eigen::Index>(first_apart) ? held : fitted).push_back(t);
    Eigen::MatrixXd left = y(Eigen::all, held);
    if (x.rows() > 0) {
      const Eigen::MatrixXd xf = x(Eigen::all, fitted), yf = y(Eigen::all, fitted);
      left -= RidgeAt(xf, yf, x(Eigen::all, held), kFirstRidge);
    }
    return PointErrors(left).array().square().square().mean();
  }

  // The rows that move points as far as is seen; which ones, in `kept`.
  Eigen::MatrixXd Moving(const Eigen::MatrixXd& rows, std::vector<Eigen::Index>* kept) const {
    const double seen = kSeen * options_.tolerance;
    std::vector<Eigen::Index> moving;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      if (rows.row(i).squaredNorm() > seen * seen * static_cast<double>(rows.cols())) moving.push_back(i);
    }
    if (kept != nullptr) *kept = moving;
    return rows(moving, Eigen::all);
  }

  // Those of the scalars that tell what all of them do.
  void ChooseScalars(const View& view) {
    const std::vector<CueRef> scalars = ScalarsIn(joint_);
    std::vector<Eigen::Index> kept;
    const Eigen::MatrixXd all = Moving(view.Cues(scalars), &kept);
    x_.resize(0, y_.cols());
    if (kept.empty()) return;
    const Eigen::MatrixXd gram = GramOf(all), cross = CrossOf(y_, all);
    const double total = y_.squaredNorm(), told = ToldByRidge(all, y_, gram, cross, kFirstRidge);
    const double seen = kSeen * options_.tolerance,
                 least = kCueGain * std::max(total - told, seen * seen * static_cast<double>(y_.size() / 3));
    const std::vector<Eigen::Index> found =
        GreedyColumns(gram, cross,
                      {.total = total,
                       .left = 0,
                       .most = tile_.before_step ? kMostCuesBeforeStep : kMostCues,
                       .least_variance = 1e-7,
                       .least_gain = least});
    for (const Eigen::Index i : found) {
      chosen_.push_back(scalars[static_cast<std::size_t>(kept[static_cast<std::size_t>(i)])]);
      has_values_ |= chosen_.back().index < poses_.layout().relative_begin;
    }
    x_ = all(found, Eigen::all);
  }

  void FindResidual() {
    residual_ = y_;
    if (x_.rows() > 0) {
      const Eigen::MatrixXd map = Damped(GramOf(x_), kFirstRidge).Solve(CrossOf(x_, y_));
      residual_ -= Multiply(GemmOperand::Dense(map).Transposed(), GemmOperand::Dense(x_));
    }
    errors_ = PointErrors(residual_);
  }

  // largest [T]
  void AddPoints(const View& view, const Eigen::VectorXd& largest) {
    const double aimed = kAimed * options_.tolerance;
    Eigen::VectorXd pose_weight = 1 + (largest.array() / aimed).min(kMostPose);
    pose_weight = (pose_weight.array() / pose_weight.mean()).sqrt();
    for (Eigen::Index i = 0; i < errors_.rows(); ++i) {
      const double rare = Quantile({errors_.row(i).begin(), errors_.row(i).end()}, kFewPoses);
      residual_.middleRows(3 * i, 3) *= std::min(kMostPoint, rare / aimed + 0.2);
    }
    const Eigen::MatrixXd left = residual_ * pose_weight.asDiagonal();
    const SymmetricEigen main = LargestEigen(GramOf(left), std::min(kResidualDirections, left.rows()), 1);
    const Eigen::MatrixXd r = Multiply(main.vectors.transpose(), left);  // [24 x T]
    std::vector<CueRef> candidates = tile_.points;
    for (CueRef& cue : candidates) cue.joint = joint_;
    const Eigen::MatrixXd c = view.Cues(candidates) * pose_weight.asDiagonal();
    Eigen::MatrixXd s = GramOf(c), b = CrossOf(c, r);
    if (x_.rows() > 0) {
      const Eigen::MatrixXd x = x_ * pose_weight.asDiagonal(), xc = CrossOf(x, c), xr = CrossOf(x, r);
      const Cholesky solver = Damped(GramOf(x), kFirstRidge);
      const Eigen::MatrixXd map = solver.Solve(xc);
      s -= map.transpose() * xc;
      b -= map.transpose() * xr;
    }
    const double deviation = kSeen * options_.tolerance,
                 noise = deviation * deviation * static_cast<double>(view.poses());
    const double total = r.squaredNorm();
    std::vector<std::size_t> taken;
    const auto points = tile_.points.size();
    const std::size_t most_points = tile_.before_step ? kMostPointsBeforeStep : kMostPoints;
    while (taken.size() < most_points) {
      std::size_t best = points;
      double most = kPointGain * total;
      for (std::size_t i = 0; i < points; ++i) {
        if (std::find(taken.begin(), taken.end(), i) != taken.end()) continue;
        const auto at = static_cast<Eigen::Index>(3 * i);
        const Eigen::Matrix3d own = s.block<3, 3>(at, at) + 20 * noise * Eigen::Matrix3d::Identity();
        const double gain = (own.inverse() * b.middleRows(at, 3)).cwiseProduct(b.middleRows(at, 3)).sum();
        if (gain > most) most = gain, best = i;
      }
      if (best == points) break;
      taken.push_back(best);
      const auto at = static_cast<Eigen::Index>(3 * best);
      const Eigen::Matrix3d own = s.block<3, 3>(at, at) + noise * Eigen::Matrix3d::Identity();
      const Eigen::MatrixXd map = own.inverse() * s.middleRows(at, 3);  // [3 x 3q]
      b -= map.transpose() * b.middleRows(at, 3).eval();
      s -= map.transpose() * s.middleRows(at, 3).eval();
    }
    // Spread over the tile: what values do before the skin is not seen elsewhere
    const std::size_t least = has_values_ ? std::min(kLeastPoints, tile_.own_points) : 0;
    for (std::size_t k = taken.size(); k < least; ++k) {
      const std::size_t i = (2 * k + 1) * tile_.own_points / (2 * least);
      if (std::find(taken.begin(), taken.end(), i) == taken.end()) taken.push_back(i);
    }
    for (const std::size_t i : taken) chosen_.push_back(candidates[i]);
  }

  const PoseMatrix& poses_;
  const TileCandidates& tile_;
  const TileCueOptions& options_;
  const std::size_t stride_;
  std::vector<CueRef> chosen_;
  bool has_values_ = false;
  Index joint_ = kNoIndex;
  Eigen::MatrixXd x_, y_;              // [p x T], [3n x T]
  Eigen::MatrixXd residual_, errors_;  // [3n x T], [n x T]
};

std::tuple<std::size_t, Index> KeyOf(const PoseLayout& layout, const CueRef& cue) {
  return {CueColumn(layout, cue), cue.joint};
}

// At most kMaxCueJoints spaces: the tiles of the rarest ones stay in the space of the points.
std::vector<Index> FrequentJoints(std::span<const Index> joints) {
  std::map<Index, std::size_t> count;
  for (const Index joint : joints) count[joint] += joint != kNoIndex;
  std::vector<Index> order;
  for (const auto& [joint, tiles] : count) {
    if (tiles > 0) order.push_back(joint);
  }
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return count[a] > count[b]; });
  if (order.size() > kMaxCueJoints) order.resize(kMaxCueJoints);
  return order;
}

}  // namespace

TileCues ChooseTileCues(const PoseMatrix& poses, std::span<const TileCandidates> tiles,
                        const TileCueOptions& options) {
  TileCues result;
  result.joint.assign(tiles.size(), kNoIndex);
  std::vector<std::vector<CueRef>> own(tiles.size());
  const auto choose = [&](std::size_t t, const TileCandidates& tile) {
    TileChooser chooser(poses, tile, options);
    own[t] = chooser.Run();
    result.joint[t] = chooser.joint();
  };
  ParallelFor(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) choose(t, tiles[t]);
  });
  const std::vector<Index> joints = FrequentJoints(result.joint);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (result.joint[t] == kNoIndex || std::ranges::find(joints, result.joint[t]) != joints.end()) continue;
    TileCandidates stays = tiles[t];
    std::erase(stays.joints, result.joint[t]);
    choose(t, stays);
    if (result.joint[t] != kNoIndex && std::ranges::find(joints, result.joint[t]) == joints.end()) {
      stays.joints.clear();
      choose(t, stays);
    }
  }
  // In the order of the poses' columns
  const PoseLayout& layout = poses.layout();
  std::map<std::tuple<std::size_t, Index>, CueRef> all;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    for (const CueRef& cue : own[t]) all.emplace(KeyOf(layout, cue), cue);
    for (Index e = 0; e < 12 && result.joint[t] != kNoIndex; ++e) {
      const CueRef cue{CueKind::kScalar, result.joint[t] + e};
      all.emplace(KeyOf(layout, cue), cue);
    }
  }
  std::map<std::tuple<std::size_t, Index>, std::uint32_t> number;
  for (const auto& [key, cue] : all) {
    number.emplace(key, static_cast<std::uint32_t>(result.cues.size()));
    result.cues.push_back(cue);
  }
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    std::vector<std::uint32_t>& of_tile = result.of_tile.emplace_back();
    for (const CueRef& cue : own[t]) of_tile.push_back(number.at(KeyOf(layout, cue)));
    for (CueRef cue : tiles[t].points) {  // that others measure anyway
      cue.joint = result.joint[t];
      if (const auto found = number.find(KeyOf(layout, cue)); found != number.end())
        of_tile.push_back(found->second);
    }
    std::sort(of_tile.begin(), of_tile.end());
    of_tile.erase(std::unique(of_tile.begin(), of_tile.end()), of_tile.end());
  }
  return result;
}

void SetTarget(const PoseMatrix& poses, const TileCueOptions& options, const TileCandidates& tile,
               Index joint, TileModel* model) {
  View(poses, options, joint, EveryPose(poses, 1)).Target(tile, model);
}

TileModel FitTile(const PoseMatrix& poses, const Eigen::MatrixXd& measured, const CueSet& set,
                  const TileCueOptions& options, const TileCandidates& tile, Index joint,
                  std::vector<std::uint32_t> columns) {
  TileModel model;
  model.columns = std::move(columns);
  // In scene units a penalty is the same for all
  const auto height = static_cast<Eigen::Index>(model.columns.size());
  Eigen::VectorXd unit(height);
  for (Eigen::Index i = 0; i < height; ++i) {
    const std::uint32_t row = model.columns[static_cast<std::size_t>(i)];
    const auto cue =
        static_cast<std::size_t>(std::ranges::upper_bound(set.offsets, row) - set.offsets.begin() - 1);
    const CueRef& of = set.cues[cue];
    const PoseLayout& layout = poses.layout();
    const bool of_matrix = of.kind == CueKind::kScalar && of.index >= layout.relative_begin;
    const Index entry = of_matrix ? (of.index - layout.relative_begin) % 12 : 0;
    double reach = of.kind != CueKind::kScalar || (of_matrix && entry >= 9) ? 1 : options.turn_reach;
    if (of_matrix && entry < 9) reach /= JointScale(poses, options.mean, of.index - entry);
    if (of.joint != kNoIndex) reach *= JointScale(poses, options.mean, of.joint);
    unit[i] = reach / set.scale[row];
  }
  const View view(poses, options, joint, EveryPose(poses, 1));
  const Eigen::Index count = measured.cols();
  view.Target(tile, &model);
  const Eigen::MatrixXd& y = model.target;
  const Eigen::MatrixXd x = unit.asDiagonal() * measured(model.columns, Eigen::all);
  // Rounded, as what the map leaves makes up for that
  const Eigen::MatrixXd gram = GramOf(x),
                        cross = MultiplyFloats(GemmOperand::Dense(x), GemmOperand::Dense(y).Transposed());
  const Eigen::VectorXd back = unit.cwiseInverse();
  model.covariance = back.asDiagonal() * gram * back.asDiagonal() / static_cast<double>(count);
  model.gain.setZero(y.rows(), height);
  model.left_out = y.squaredNorm() / static_cast<double>(y.size() / 3);
  if (height == 0) return model;
  std::vector<Eigen::Index> held;
  for (Eigen::Index t = 3; t < count; t += kMapValidated) held.push_back(t);
  const Eigen::MatrixXd xh = x(Eigen::all, held), yh = y(Eigen::all, held);
  const Eigen::MatrixXd gram_held = GramOf(xh), cross_held = CrossOf(xh, yh), fitted = gram - gram_held,
                        wanted = cross - cross_held;
  double best = std::numeric_limits<double>::infinity(), ridge = kMapRidge[0];
  for (const double candidate : kMapRidge) {
    const Eigen::MatrixXd map = Damped(fitted, candidate).Solve(wanted);  // [p x 3n]
    // |yh - map^T xh|^2 without the constant
    const double error =
        Multiply(gram_held, map).cwiseProduct(map).sum() - 2 * map.cwiseProduct(cross_held).sum();
    if (error < best) best = error, ridge = candidate;
  }
  model.left_out = std::max(0.0, yh.squaredNorm() + best) / static_cast<double>(yh.size() / 3);
  Eigen::MatrixXd map = Damped(gram, ridge).Solve(cross), left;
  for (int round = 0; round < kWeighings; ++round) {
    MultiplyFloats(GemmOperand::Dense(map).Transposed(), GemmOperand::Dense(x), &left);
    left = y - left;
    const Eigen::ArrayXd largest = LargestErrors(left).array() / (kWeighed * options.tolerance);
    const Eigen::VectorXd weight = 1 + largest.square().min(kMostWeight);
    const Eigen::MatrixXd weighed = x * weight.asDiagonal(), gram_weighed = CrossOf(weighed, x);
    // x w y^T by what the map leaves of y: that is small, so that it may be rounded
    const Eigen::MatrixXd cross_left =
        MultiplyFloats(GemmOperand::Dense(weighed), GemmOperand::Dense(left).Transposed());
    map = Damped(gram_weighed, ridge).Solve(Multiply(gram_weighed, map) + cross_left);
  }
  model.gain = map.transpose() * unit.asDiagonal();
  return model;
}

}  // namespace kpsa::engine
