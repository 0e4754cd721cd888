// The clips of a head: what the trainer may see (`extreme`, `talk_train`), and what it may not: `talk`,
// `emotions`, and one of its own that is written by hand (keyed_clips.h).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "base/check.h"
#include "base/matrix.h"
#include "base/scalar_math.h"
#include "scenes/face_model.h"
#include "scenes/keyed_clips.h"

namespace kpsa::engine::scenes {
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
constexpr Turn kEarTurns[] = {
    {kEarL, 0, -20, 25}, {kEarL, 2, -18, 14}, {kEarR, 0, -20, 25}, {kEarR, 2, -14, 18}};

// The values of all controls at all frames.
class Track {
 public:
  Track(const HeadDesign& design, std::vector<std::string> expressions, int frames)
      : names_(std::move(expressions)),
        joints_(static_cast<int>(design.joints.size())),
        frames_(frames),
        weights_(Size(frames) * names_.size()),
        turns_(Size(frames) * kJointCount) {}

  int frames() const { return frames_; }
  bool ears() const { return joints_ > kEarL; }
  // Those that move by themselves, which come first.
  int expressions() const {
    return static_cast<int>(std::find_if(names_.begin(), names_.end(), IsCorrective) - names_.begin());
  }
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
    for (int joint = kNeck; joint < joints_; ++joint) {
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
  int joints_, frames_;
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
  const auto add = [&](const Turn& turn) {
    controls.push_back([turn](Track& t, int f, double share) {
      t.Degrees(f, turn.joint, turn.axis) += share >= 0 ? share * turn.high : -share * turn.low;
    });
  };
  for (const Turn& turn : kTurns) add(turn);
  for (const Turn& turn : kEyeTurns) {
    controls.push_back([turn](Track& t, int f, double share) {
      t.Look(f, turn.axis, share >= 0 ? share * turn.high : -share * turn.low);
    });
  }
  if (track.ears()) {
    for (const Turn& turn : kEarTurns) add(turn);
  }
  return controls;
}

// Up to full and back in 8 frames: 0 at both ends.
constexpr int kSweep = 8;
double SweepShare(int k) { return 1 - std::fabs(k - kSweep / 2.0) / (kSweep / 2.0); }

GlbClip Extreme(const HeadDesign& design, const std::vector<std::string>& names, int mesh_node) {
  constexpr int kPairs = 48;
  const std::vector<Control> controls = AllControls(Track(design, names, 1));
  const int weights = Track(design, names, 1).expressions(),
            turns = static_cast<int>(controls.size()) - weights;
  const int sweeps = weights + 2 * turns + kPairs;
  Track track(design, names, sweeps * kSweep + 1);
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

GlbClip TalkTrain(const HeadDesign& design, const std::vector<std::string>& names, int mesh_node) {
  Track track(design, names, 36 * 24 + 1);
  const std::vector<Control> controls = AllControls(track);
  Random random(23);
  for (std::size_t c = 0; c < controls.size(); ++c) {
    const bool turn = static_cast<int>(c) >= track.expressions();
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

GlbClip Talk(const HeadDesign& design, const std::vector<std::string>& names, int mesh_node) {
  Track track(design, names, 10 * 24 + 1);
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
    const int after = static_cast<int>(c) - track.expressions();
    const bool turn = after >= 0, jaw = turn && after < 2;
    Wander(track, controls[c], random, turn ? 12 : 7, turn ? 30 : 20, turn ? 0.2 : 0.6,
           jaw    ? 0.12
           : turn ? 0.4
                  : 0.7,
           turn && after != 0);
  }
  for (int f = 0; f < track.frames(); ++f) {
    track.Degrees(f, kJaw, 0) = std::clamp(track.Degrees(f, kJaw, 0), -2.0, 20.0);
  }
  return track.Finish("talk", mesh_node);
}

struct Part {
  const char* name;  // an expression, or one of both sides
  double weight;
};
struct Emotion {
  std::vector<Part> parts;
  double jaw, nod, turn, tilt;  // degrees
};
const std::vector<Emotion>& AllEmotions() {
  static const std::vector<Emotion> emotions = {
      {{{"smile", 0.95},
        {"cheekRaise", 0.7},
        {"squint", 0.3},
        {"mouthOpen", 0.4},
        {"lipUpperUp", 0.3},
        {"browOuterUp", 0.25},
        {"dimple", 0.3}},
       6,
       -6,
       0,
       3},  // joy
      {{{"browDown", 1},
        {"squint", 0.45},
        {"sneer", 0.55},
        {"lipPress", 0.6},
        {"jawForward", 0.4},
        {"nostrilFlare", 0.8},
        {"frown", 0.35},
        {"neckTense", 0.4}},
       0,
       7,
       0,
       0},  // anger
      {{{"browInnerUp", 1},
        {"frown", 0.8},
        {"chinUp", 0.6},
        {"squint", 0.2},
        {"blink", 0.25},
        {"lipLowerRoll", 0.3}},
       0,
       10,
       -6,
       5},  // sadness
      {{{"browInnerUp", 0.9}, {"browOuterUp", 1}, {"eyeWide", 1}, {"mouthOpen", 0.8}, {"funnel", 0.2}},
       13,
       -6,
       0,
       0},  // surprise
      {{{"browInnerUp", 1},
        {"browDown", 0.35},
        {"eyeWide", 0.9},
        {"stretch", 0.9},
        {"neckTense", 0.8},
        {"lipLowerDown", 0.5}},
       5,
       -4,
       8,
       0},  // fear
      {{{"sneer", 1},
        {"browDown", 0.5},
        {"lipUpperUp", 0.8},
        {"squint", 0.5},
        {"chinUp", 0.4},
        {"frown", 0.3},
        {"mouthLeft", 0.3}},
       0,
       3,
       10,
       -4}};  // disgust
  return emotions;
}

// One after the other from neutral and back, a little less on the right, and never quite still.
GlbClip Emotions(const HeadDesign& design, const std::vector<std::string>& names, int mesh_node) {
  constexpr int kLength = 48, kRise = 12, kFall = 34, kEnd = 46;
  const std::vector<Emotion>& emotions = AllEmotions();
  Track track(design, names, static_cast<int>(emotions.size()) * kLength + 1);
  const auto has = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (std::size_t e = 0; e < emotions.size(); ++e) {
    for (int k = 0; k < kLength; ++k) {
      const int frame = static_cast<int>(e) * kLength + k;
      const double level = Smooth(0, kRise, k) * Smooth(kEnd, kFall, k);
      const double now = level * (1 - 0.08 * (0.5 - 0.5 * Cos(2 * kPi * k / 16.0)));
      for (const Part& part : emotions[e].parts) {
        const std::string name = part.name;
        if (has(name)) {
          track.Weight(frame, track.Find(name)) += part.weight * now;
        } else {
          track.Weight(frame, track.Find(name + ".L")) += part.weight * now;
          track.Weight(frame, track.Find(name + ".R")) += part.weight * 0.92 * now;
        }
      }
      track.Degrees(frame, kJaw, 0) += emotions[e].jaw * now;
      track.Degrees(frame, kHead, 0) += emotions[e].nod * level;
      track.Degrees(frame, kHead, 1) += emotions[e].turn * level;
      track.Degrees(frame, kHead, 2) += emotions[e].tilt * level;
    }
  }
  return track.Finish("emotions", mesh_node);
}

GlbClip Keyed(const KeyedClip& clip, const HeadDesign& design, const std::vector<std::string>& names,
              int mesh_node) {
  constexpr std::pair<const char*, Joint> kJoints[] = {{"neck.", kNeck}, {"head.", kHead}, {"jaw.", kJaw},
                                                       {"eyes.", kEyeL}, {"earL.", kEarL}, {"earR.", kEarR}};
  const auto joint_of = [&](const std::string& control) {
    for (const auto& [begin, joint] : kJoints) {
      if (control.starts_with(begin) && control.size() == std::strlen(begin) + 1) return joint;
    }
    return kRoot;
  };
  Track track(design, names, clip.frames);
  Play(
      clip,
      [&](const std::string& control) {
        return joint_of(control) != kRoot || std::find(names.begin(), names.end(), control) != names.end();
      },
      [&](const std::string& control, int frame, double value) {
        const Joint joint = joint_of(control);
        const int axis = control.back() - 'x';
        if (joint == kRoot) {
          track.Weight(frame, track.Find(control)) += value;
        } else if (joint == kEyeL) {
          track.Look(frame, axis, value);
        } else {
          track.Degrees(frame, joint, axis) += value;
        }
      });
  return track.Finish(clip.name, mesh_node);
}

}  // namespace

std::vector<GlbClip> FaceClips(const HeadDesign& design, const std::vector<std::string>& expressions,
                               int mesh_node) {
  std::vector<GlbClip> clips = {
      Extreme(design, expressions, mesh_node), TalkTrain(design, expressions, mesh_node),
      Talk(design, expressions, mesh_node), Emotions(design, expressions, mesh_node)};
  if (design.production)
    clips.push_back(Keyed(Track(design, expressions, 1).ears() ? AnimalSniff() : BoyScene(), design,
                          expressions, mesh_node));
  return clips;
}

}  // namespace kpsa::engine::scenes
