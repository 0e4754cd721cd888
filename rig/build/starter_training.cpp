#include "rig/build/starter_training.h"

#include <algorithm>
#include <cmath>

namespace kpsa::engine {
namespace {

constexpr double kStill = 1e-4;       // of the diagonal: who moves no farther does not move
constexpr double kTestReach = 0.01;   // of the diagonal: how far a test clip moves its farthest point,
constexpr double kTestShare = 0.5;    // or else of the clip that moves them most
constexpr std::size_t kPoses = 2000;  // of all clips together, and
constexpr std::size_t kMostOfClip = 240, kLeastOfClip = 8;
constexpr std::size_t kMostOfCut = 2000;
constexpr std::int64_t kPeriod = 144;  // frames, about: one test and what is trained on about it
constexpr std::int64_t kMostTests = 4;
constexpr std::int64_t kGap = 12;         // frames: half a second, of short clips less
constexpr double kLeastTolerance = 1e-8;  // metres: less is not written
constexpr double kTestMotion = 0.5;       // of the motion of the whole clip
constexpr std::int64_t kSamplesBase = 300, kSamplesPerControl = 10;
constexpr std::int64_t kLeastSamples = 400, kMostSamples = 2000, kMostPoses = 4500;

std::int64_t FrameCount(const gltf::Clip& clip, double fps) {
  return static_cast<std::int64_t>(std::min(clip.duration * fps, 1e6) + 1e-6) + 1;
}

// Tests begin at `offset` eighths of each period.
std::vector<ClipPart> Layout(std::int64_t frames, std::int64_t tests, std::int64_t offset) {
  const std::int64_t gap = std::clamp<std::int64_t>(frames / (12 * tests), 1, kGap);
  std::vector<ClipPart> parts;
  const auto add = [&](std::int64_t first, std::int64_t last, bool test) {
    if (last > first) parts.push_back({first, last, test});
  };
  std::int64_t begin = 0;
  for (std::int64_t t = 0; t < tests; ++t) {
    const std::int64_t from = frames * (8 * t + offset) / (8 * tests),
                       to = frames * (8 * t + offset + 2) / (8 * tests) - 1;
    add(begin, from - gap - 1, false);
    add(from, to, true);
    begin = to + gap + 1;
  }
  add(begin, frames - 1, false);
  return parts;
}

// How the points move in the tests of a layout.
struct TestMotion {
  double motion = 0;  // RMS, about the mean of each
  double beyond = 0;  // the farthest pose from the mean of the clip, of the farthest that is trained on
};
TestMotion MotionOf(const PointPoses& poses, const std::vector<double>& distance,
                    const std::vector<ClipPart>& parts, double fps) {
  double squares = 0, weights = 0, test = 0, train = 0;
  for (const ClipPart& part : parts) {
    const auto at = [&](std::int64_t frame) {
      const double time = (static_cast<double>(frame) - 0.5) / fps;
      return static_cast<std::size_t>(std::lower_bound(poses.times.begin(), poses.times.end(), time) -
                                      poses.times.begin());
    };
    const std::size_t begin = at(part.first), end = at(part.last + 1);
    double& farthest = part.test ? test : train;
    for (std::size_t p = begin; p < end; ++p) farthest = std::max(farthest, distance[p]);
    if (!part.test) continue;
    const double motion = poses.Motion(begin, end), weight = static_cast<double>(end - begin);
    squares += weight * motion * motion;
    weights += weight;
  }
  return {std::sqrt(squares / std::max(weights, 1.0)), test / std::max(train, 1e-300)};
}

struct MeasuredClip {
  double motion = 0, largest = 0;  // in the space
  std::size_t poses = 0;
  bool moves = false, moves_in_space = false;
};

// The clip to test on, of those that move the points in the space: one that moves them well, and goes least
// beyond what all others together teach. kNoIndex: there are no two.
Index ChooseTest(const gltf::Character& character, std::vector<ClipMotion> motions,
                 const std::vector<MeasuredClip>& clips, double diagonal) {
  double largest = 0;
  std::size_t moving = 0;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    if (!clips[c].moves) motions[c].clear();  // teaches nothing
    if (clips[c].moves_in_space) ++moving, largest = std::max(largest, clips[c].largest);
  }
  if (moving < 2) return kNoIndex;
  const double wanted = std::min(kTestReach * diagonal, kTestShare * largest);
  std::vector<bool> may(clips.size());
  for (std::size_t c = 0; c < clips.size(); ++c)
    may[c] = clips[c].moves_in_space && clips[c].largest >= wanted;
  return TamestClip(character, motions, may);
}

}  // namespace

double FramesOfKeys(const std::vector<gltf::Clip>& clips) {
  constexpr double kUsual[] = {kUnsaidFps, 25, 30, 48, 50, 60}, kOff = 0.01;  // of a frame
  const auto fits = [](const gltf::Clip& clip, double fps) {
    return std::ranges::all_of(clip.channels, [&](const gltf::Channel& channel) {
      return std::ranges::all_of(
          channel.times, [&](double time) { return std::fabs(time * fps - std::round(time * fps)) <= kOff; });
    });
  };
  double best = kUnsaidFps;
  std::ptrdiff_t most = 0;
  for (const double fps : kUsual) {
    const auto fitting =
        std::ranges::count_if(clips, [&](const gltf::Clip& clip) { return fits(clip, fps); });
    if (fitting > most) most = fitting, best = fps;
  }
  return best;
}

std::vector<ClipPart> CutClip(const PointPoses& poses, std::int64_t frames, double fps) {
  if (frames < kLeastFrames) return {};
  const std::int64_t tests = std::clamp<std::int64_t>((frames + kPeriod / 2) / kPeriod, 1, kMostTests);
  const std::vector<double> distance = poses.DistancesFromMean();
  const double motion = poses.Motion();
  std::vector<ClipPart> best;
  TestMotion found;
  for (const std::int64_t offset : {3, 2, 4}) {
    std::vector<ClipPart> parts = Layout(frames, tests, offset);
    const TestMotion now = MotionOf(poses, distance, parts, fps);
    const bool enough = now.motion >= kTestMotion * motion, had_enough = found.motion >= kTestMotion * motion;
    const bool better = best.empty() || (enough && had_enough ? now.beyond < found.beyond
                                                              : now.motion > found.motion && !had_enough);
    if (better) best = std::move(parts), found = now;
  }
  return best;
}

Result<StarterTraining> ChooseTraining(Rig* rig, std::optional<NodeId> space,
                                       const std::vector<ClipMotion>& motions,
                                       const std::vector<ControlPlug>& controls) {
  StarterTraining choice;
  MotionMeter meter(rig, space);
  const gltf::Character& character = *rig->character;
  const std::size_t most =
      std::clamp(kPoses / std::max<std::size_t>(1, character.clips.size()), kLeastOfClip, kMostOfClip);
  std::vector<MeasuredClip> clips(character.clips.size());
  Index alone = kNoIndex;  // the last one that moves the points in the space, until there are two
  for (Index c = 0; c < clips.size(); ++c) {
    const std::string& id = character.clips[c].id;
    if (character.FindClip(id) != c) continue;  // another one has that name
    if (const Result<PointPoses> poses = meter.OfClip(id, rig->fps, most); poses.ok()) {
      MeasuredClip& clip = clips[c];
      clip.motion = poses->Motion();
      clip.largest = poses->Largest();
      clip.poses = poses->poses();
      clip.moves = clip.poses > 1 && poses->travel > kStill * rig->rest_diagonal;
      clip.moves_in_space = clip.moves && clip.largest > kStill * rig->rest_diagonal;
      choice.deforms = choice.deforms || poses->deforms;
      if (clip.moves_in_space) alone = c;
    }
    if (!clips[c].moves) choice.still.push_back(id);
  }
  const Index test = ChooseTest(character, motions, clips, rig->rest_diagonal);
  if (test != kNoIndex) alone = kNoIndex;
  if (alone != kNoIndex) {
    const Result<PointPoses> poses = meter.OfClip(character.clips[alone].id, rig->fps, kMostOfCut);
    if (!poses.ok()) return poses.status();
    choice.parts = CutClip(*poses, FrameCount(character.clips[alone], rig->fps), rig->fps);
    if (!choice.parts.empty()) choice.cut = character.clips[alone].id;
  }
  double squares = 0, weights = 0;
  for (Index c = 0; c < clips.size(); ++c) {
    if (!clips[c].moves) continue;
    const std::string& id = character.clips[c].id;
    if (id != choice.cut) (c == test || c == alone ? choice.test : choice.train).push_back(id);
    choice.frames +=
        c == test || (c == alone && choice.cut.empty()) ? 0 : FrameCount(character.clips[c], rig->fps);
    if (c == test || !clips[c].moves_in_space) continue;
    const double weight = static_cast<double>(clips[c].poses);
    squares += weight * clips[c].motion * clips[c].motion;
    weights += weight;
  }
  choice.motion = std::sqrt(squares / std::max(weights, 1.0));
  choice.by_clips = weights > 0;
  if (choice.by_clips && choice.deforms) return choice;
  const Result<PointPoses> poses = meter.OfControls(controls);
  if (!poses.ok()) return poses.status();
  choice.deforms = choice.deforms || poses->deforms;
  if (!choice.by_clips) choice.motion = poses->Motion();
  return choice;
}

double StarterTolerance(double diagonal, double motion) {
  double raw = kToleranceOfSize * diagonal;
  if (motion > 0) raw = std::min(raw, kToleranceOfMotion * motion);
  if (!(raw > 0)) return kToleranceOfSize;  // of a point: as of something of 1 m
  raw = std::max(raw, kLeastTolerance);
  const double power = std::pow(10.0, std::floor(std::log10(raw))), share = raw / power;
  // Boundaries are the geometric means of neighbours
  return power * (share < std::sqrt(2.0)    ? 1
                  : share < std::sqrt(10.0) ? 2
                  : share < std::sqrt(50.0) ? 5
                                            : 10);
}

int StarterSamples(std::size_t controls, std::int64_t frames) {
  const auto n = static_cast<std::int64_t>(std::min<std::size_t>(controls, 1'000'000));
  const std::int64_t wanted = std::clamp(kSamplesBase + kSamplesPerControl * n, kLeastSamples, kMostSamples);
  // Each control at its ends, and between frames, are trained on besides
  const std::int64_t room = kMostPoses - 2 * n - frames;
  return static_cast<int>(std::clamp(room, kLeastSamples, wanted));
}

}  // namespace kpsa::engine
