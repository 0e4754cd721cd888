#include "kpsa/training/time_limit.h"

#include <algorithm>
#include <cmath>

#include "kpsa/training/gemm.h"
#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kProbedPoses = 256, kLeastPosesWithin = 250;
constexpr std::size_t kOneSparedOf = 4;
constexpr double kOfGram = 8;  // training without cues of tiles, in Gram matrices of its poses

}  // namespace

double TimeLimit::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void TimeLimit::LeaveOut(const std::string& what) {
  if (std::ranges::find(left_out_, what) == left_out_.end()) left_out_.push_back(what);
}
std::string TimeLimit::left_out() const { return fmt::format("{}", fmt::join(left_out_, ", ")); }

std::size_t PosesWithin(double seconds, const PoseMatrix& poses) {
  const std::size_t all = poses.poses(), probed = std::min(all, kProbedPoses);
  if (!std::isfinite(seconds) || all <= kLeastPosesWithin) return all;
  const TimeLimit clock(seconds);
  Gram(GemmOperand::Poses(poses, 0, probed, 0, poses.layout().outputs()));
  const double a_pair = clock.elapsed() / static_cast<double>(probed * probed);
  const double within = std::sqrt(std::max(0.0, seconds) / std::max(kOfGram * a_pair, 1e-15));
  return within >= static_cast<double>(all) ? all
                                            : std::max(kLeastPosesWithin, static_cast<std::size_t>(within));
}

void KeepSpread(std::size_t count, PoseMatrix* poses, std::size_t* of_clips) {
  PoseMatrix kept(poses->layout());
  std::size_t clips = 0;
  for (const Index t : EvenSpread(poses->poses(), count)) {
    kept.Append(*poses, t);
    clips += t < *of_clips;
  }
  *poses = std::move(kept);
  *of_clips = clips;
}

bool FitIntoTime(PoseMatrix* poses, std::size_t* of_clips, std::size_t not_recorded, TimeLimit* limit) {
  const std::size_t all = poses->poses(), within = std::min(all, PosesWithin(limit->left(), *poses));
  if (within < all) KeepSpread(within, poses, of_clips);
  if (within < all + not_recorded) limit->LeaveOut(fmt::format("{} of {} poses", within, all + not_recorded));
  return within < all;
}

std::optional<PoseMatrix> SpareForModes(PoseMatrix* poses, std::size_t* of_clips, double most_work) {
  const auto count = static_cast<double>(poses->poses());
  if (count * count * static_cast<double>(poses->columns()) <= most_work) return std::nullopt;
  PoseMatrix spare = poses->TakeEvery(kOneSparedOf);
  *of_clips -= *of_clips / kOneSparedOf;
  return spare;
}

}  // namespace kpsa::engine
