// The clips of the face: what the trainer may see (`extreme`, `talk_train`), and `talk`, which it may not.
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/check.h"
#include "base/matrix.h"
#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::scenes {
namespace {

// A turn about one axis of a joint, degrees, as a clip uses it.
struct Turn {
  Joint joint;
  int axis;
  double low, high;
};
constexpr Turn kTurns[] = {{kJaw, 0, 0, 20},    {kJaw, 1, -5, 5},    {kHead, 0, -14, 14}, {kHead, 1, -22, 22},
                           {kHead, 2, -12, 12}, {kNeck, 0, -10, 10}, {kNeck, 1, -15, 15}, {kNeck, 2, -8, 8}};
constexpr Turn kEyeTurns[] = {{kEyeL, 0, -14, 16}, {kEyeL, 1, -24, 24}};  // both eyes look the same way

// The values of all controls at all frames.
class Track {
 public:
  Track(std::vector<std::string> expressions, int frames)
      : names_(std::move(expressions)),
        frames_(frames),
        weights_(Size(frames) * names_.size()),
        turns_(Size(frames) * kJointCount) {}

  int frames() const { return frames_; }
  int expressions() const { return static_cast<int>(names_.size()); }
  int Find(const std::string& name) const {
    const auto it = std::find(names_.begin(), names_.end(), name);
    KPSA_CHECK(it != names_.end());
    return static_cast<int>(it - names_.begin());
  }
  double& Weight(int frame, int expression) {
    return weights_[Size(frame) * names_.size() + Size(expression)];
  }
  double& Degrees(int frame, Joint joint, int axis) {
    return turns_[Size(frame) * kJointCount + Size(joint)][axis];
  }
  void Look(int frame, int axis, double degrees) {
    Degrees(frame, kEyeL, axis) += degrees;
    Degrees(frame, kEyeR, axis) += degrees;
  }

  GlbClip Finish(const std::string& name, int mesh_node) const {
    GlbClip clip = {name, frames_, {}};
    for (int joint = kNeck; joint < kJointCount; ++joint) {
      GlbChannel channel = {joint, false, {}};
      for (int f = 0; f < frames_; ++f) {
        const Double3 degrees = turns_[Size(f) * kJointCount + Size(joint)];
        const Quaternion q =
            QuaternionFromRotation(RotationFromEuler(degrees * (kPi / 180), RotateOrder::kXyz));
        for (double v : {q.x, q.y, q.z, q.w}) channel.values.push_back(static_cast<float>(v));
      }
      clip.channels.push_back(std::move(channel));
    }
    GlbChannel morph = {mesh_node, true, {}};
    for (double w : weights_) morph.values.push_back(static_cast<float>(std::clamp(w, 0.0, 1.0)));
    clip.channels.push_back(std::move(morph));
    return clip;
  }

 private:
  static std::size_t Size(int i) { return static_cast<std::size_t>(i); }
  std::vector<std::string> names_;
  int frames_;
  std::vector<double> weights_;
  std::vector<Double3> turns_;
};

// A control of a clip: adds a share (0 .. 1 of its range, turns -1 .. 1) at a frame.
using Control = std::function<void(Track&, int frame, double share)>;

std::vector<Control> AllControls(const Track& track) {
  std::vector<Control> controls;
  for (int e = 0; e < track.expressions(); ++e) {
    controls.push_back([e](Track& t, int f, double share) { t.Weight(f, e) += std::fabs(share); });
  }
  for (const Turn& turn : kTurns) {
    controls.push_back([turn](Track& t, int f, double share) {
      t.Degrees(f, turn.joint, turn.axis) += share >= 0 ? share * turn.high : -share * turn.low;
    });
  }
  for (const Turn& turn : kEyeTurns) {
    controls.push_back([turn](Track& t, int f, double share) {
      t.Look(f, turn.axis, share >= 0 ? share * turn.high : -share * turn.low);
    });
  }
  return controls;
}

// Up to full and back in 8 frames: 0 at both ends.
constexpr int kSweep = 8;
double SweepShare(int k) { return 1 - std::fabs(k - kSweep / 2.0) / (kSweep / 2.0); }

GlbClip Extreme(const std::vector<std::string>& names, int mesh_node) {
  constexpr int kPairs = 48;
  const int weights = static_cast<int>(names.size()),
            turns = static_cast<int>(std::size(kTurns) + std::size(kEyeTurns));
  const int sweeps = weights + 2 * turns + kPairs;
  Track track(names, sweeps * kSweep + 1);
  const std::vector<Control> controls = AllControls(track);
  int frame = 0;
  const auto sweep = [&](const std::vector<std::pair<int, double>>& moved) {
    for (int k = 0; k < kSweep; ++k, ++frame) {
      for (const auto& [control, share] : moved)
        controls[static_cast<std::size_t>(control)](track, frame, share * SweepShare(k));
    }
  };
  for (int c = 0; c < weights; ++c) sweep({{c, 1.0}});
  for (int c = weights; c < weights + turns; ++c) {
    sweep({{c, 1.0}});
    sweep({{c, -1.0}});
  }
  Random random(11);
  for (int p = 0; p < kPairs; ++p) {
    const int all = weights + turns, a = random.Below(all), b = (a + 1 + random.Below(all - 1)) % all;
    const auto sign = [&](int c) { return c >= weights && random.Uniform() < 0.5 ? -1.0 : 1.0; };
    const double first = sign(a), second = sign(b);
    sweep({{a, first}, {b, second}});
  }
  return track.Finish("extreme", mesh_node);
}

// Smoothly changing values: between random keys, `calm` of which rest at 0.
void Wander(Track& track, const Control& control, Random& random, int shortest, int longest, double calm,
            double largest, bool both_ways) {
  double from = 0;
  int frame = 0;
  while (frame < track.frames()) {
    const int length = shortest + random.Below(longest - shortest + 1);
    const bool rests = random.Uniform() < calm;
    const double u = random.Uniform(), sign = both_ways && random.Uniform() < 0.5 ? -1 : 1;
    const double to = rests ? 0 : sign * largest * (0.15 + 0.85 * u);
    for (int k = 0; k < length && frame < track.frames(); ++k, ++frame) {
      control(track, frame, from + (to - from) * Smooth(0, length, k));
    }
    from = to;
  }
}

GlbClip TalkTrain(const std::vector<std::string>& names, int mesh_node) {
  Track track(names, 36 * 24 + 1);
  const std::vector<Control> controls = AllControls(track);
  Random random(23);
  for (std::size_t c = 0; c < controls.size(); ++c) {
    const bool turn = c >= names.size();
    Wander(track, controls[c], random, 5, 14, turn ? 0.25 : 0.55, turn ? 0.8 : 0.9, turn);
  }
  return track.Finish("talk_train", mesh_node);
}

// Syllables: the jaw opens and closes four to six times a second in phrases, with a shape of the lips each.
void Speak(Track& track, Random& random) {
  const int open = track.Find("mouthOpen");
  const int shapes[] = {track.Find("pucker"),       track.Find("funnel"),       track.Find("lipPress"),
                        track.Find("stretch.L"),    track.Find("lipUpperUp.L"), track.Find("lipLowerDown.L"),
                        track.Find("lipLowerRoll"), track.Find("lipUpperRoll"), track.Find("dimple.L"),
                        track.Find("chinUp"),       track.Find("smile.L")};
  int frame = 4;
  while (frame + 12 < track.frames()) {
    const int syllables = 5 + random.Below(7);
    for (int s = 0; s < syllables && frame + 8 < track.frames(); ++s) {
      const int length = 4 + random.Below(3);
      const double jaw = random.Uniform(1, 8), lips = random.Uniform(0.0, 0.3);
      const int shape = shapes[random.Below(static_cast<int>(std::size(shapes)))];
      const double amount = random.Uniform(0.2, 0.8);
      const bool paired = shape + 1 < track.expressions() &&
                          (shape == shapes[3] || shape == shapes[4] || shape == shapes[5] ||
                           shape == shapes[8] || shape == shapes[10]);
      for (int k = -2; k < length + 2; ++k) {
        const double arc = Bump(k - length / 2.0, length / 2.0 + 2);
        track.Degrees(frame + k, kJaw, 0) += jaw * arc;
        track.Weight(frame + k, open) += lips * arc;
        track.Weight(frame + k, shape) += amount * arc;
        if (paired) track.Weight(frame + k, shape + 1) += amount * 0.85 * arc;
      }
      frame += length;
    }
    frame += 4 + random.Below(10);
  }
}

GlbClip Talk(const std::vector<std::string>& names, int mesh_node) {
  Track track(names, 10 * 24 + 1);
  const std::vector<Control> controls = AllControls(track);
  Random random(101);
  Speak(track, random);
  const int left_blink = track.Find("blink.L"), right_blink = track.Find("blink.R");
  for (int frame = 10 + random.Below(20); frame + 8 < track.frames(); frame += 30 + random.Below(50)) {
    constexpr double kBlink[] = {0.35, 0.85, 1.0, 0.75, 0.4, 0.15};
    for (int k = 0; k < 6; ++k) {
      track.Weight(frame + k, left_blink) += kBlink[k];
      track.Weight(frame + k, right_blink) += kBlink[k];
    }
  }
  // Everything else stirs, now and then
  for (std::size_t c = 0; c < controls.size(); ++c) {
    if (static_cast<int>(c) == left_blink || static_cast<int>(c) == right_blink) continue;
    const bool turn = c >= names.size();
    const bool jaw = turn && c - names.size() < 2;
    Wander(track, controls[c], random, turn ? 12 : 7, turn ? 30 : 20, turn ? 0.2 : 0.6,
           jaw    ? 0.12
           : turn ? 0.4
                  : 0.7,
           turn && !(jaw && c == names.size()));
  }
  for (int f = 0; f < track.frames(); ++f) {
    track.Degrees(f, kJaw, 0) = std::clamp(track.Degrees(f, kJaw, 0), -2.0, 20.0);
  }
  return track.Finish("talk", mesh_node);
}

}  // namespace

std::vector<GlbClip> FaceClips(const std::vector<std::string>& expressions, int mesh_node) {
  return {Extreme(expressions, mesh_node), TalkTrain(expressions, mesh_node), Talk(expressions, mesh_node)};
}

}  // namespace kpsa::scenes
