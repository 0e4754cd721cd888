// The clips of the car: what the trainer may see (`extreme`, `talk_train`), and what it may not: `talk`, and
// `emotions` and `race`, which are written by hand (keyed_clips.h).
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/check.h"
#include "base/matrix.h"
#include "base/scalar_math.h"
#include "scenes/car_model.h"
#include "scenes/keyed_clips.h"

namespace kpsa::engine::scenes::car {
namespace {

// Turns about an axis of one joint, or of two that go together: degrees.
struct Turn {
  std::array<CarJoint, 2> joints;
  int axis;
  double low, high;
};
constexpr Turn kTurns[] = {
    {{kJaw, kJaw}, 0, -2, 12},        {{kJaw, kJaw}, 1, -3, 3},          {{kChassis, kChassis}, 0, -3, 3},
    {{kChassis, kChassis}, 2, -3, 3}, {{kBody, kBody}, 0, -3, 3},        {{kBody, kBody}, 1, -3, 3},
    {{kBody, kBody}, 2, -3, 3},       {{kHood, kHood}, 0, -3, 0.5},      {{kHood, kHood}, 2, -0.7, 0.7},
    {{kRoof, kRoof}, 0, -1.5, 1.5},   {{kRoof, kRoof}, 2, -1.5, 1.5},    {{kLidUpL, kLidUpL}, 0, -8, 16},
    {{kLidUpR, kLidUpR}, 0, -8, 16},  {{kLidLowL, kLidLowL}, 0, -10, 4}, {{kLidLowR, kLidLowR}, 0, -10, 4},
    {{kEyeL, kEyeR}, 0, -12, 16},     {{kEyeL, kEyeR}, 1, -22, 22}};
constexpr int kTurnCount = static_cast<int>(std::size(kTurns));

// The values of all controls at all frames: weights of the body, of the muscles, turns.
class Track {
 public:
  Track(std::vector<std::string> names, std::size_t bodys, int frames)
      : names_(std::move(names)),
        bodys_(bodys),
        frames_(frames),
        weights_(Size(frames) * names_.size()),
        turns_(Size(frames) * Size(kTurnCount)) {}

  int frames() const { return frames_; }
  int weights() const { return static_cast<int>(names_.size()); }
  int controls() const { return weights() + kTurnCount; }
  int Find(const std::string& name) const {
    const auto it = std::find(names_.begin(), names_.end(), name);
    KPSA_CHECK(it != names_.end());
    return static_cast<int>(it - names_.begin());
  }
  // Adds a share of a control's range: 0 .. 1, turns -1 .. 1. Frames outside the clip are left out.
  void Add(int frame, int control, double share) {
    if (frame < 0 || frame >= frames_) return;
    if (control < weights()) {
      weights_[Size(frame) * names_.size() + Size(control)] += std::fabs(share);
    } else {
      const int turn = control - weights();
      turns_[Size(frame * kTurnCount + turn)] +=
          share >= 0 ? share * kTurns[turn].high : -share * kTurns[turn].low;
    }
  }

  // The control of a keyed clip: an expression, or "joint.axis", where eyes go together; -1: none.
  int FindKeyed(const std::string& control) const {
    const auto it = std::find(names_.begin(), names_.end(), control);
    if (it != names_.end()) return static_cast<int>(it - names_.begin());
    for (int t = 0; t < kTurnCount; ++t) {
      const Turn& turn = kTurns[t];
      const std::string joint =
          turn.joints[0] == turn.joints[1] ? CarJoints()[Size(turn.joints[0])].name : "eyes";
      if (control == joint + "." + static_cast<char>('x' + turn.axis)) return weights() + t;
    }
    return -1;
  }
  // Weights are shares already, turns degrees.
  void Play(const KeyedClip& clip) {
    const auto share = [&](int control, double value) {
      if (control < weights()) return value;
      const Turn& turn = kTurns[control - weights()];
      return value >= 0 ? value / turn.high : value / -turn.low;
    };
    scenes::Play(
        clip, [&](const std::string& control) { return FindKeyed(control) >= 0; },
        [&](const std::string& name, int frame, double value) {
          const int control = FindKeyed(name);
          KPSA_CHECK(control >= 0);
          Add(frame, control, share(control, value));
        });
  }

  // Shapes that have no control of their own rest: their columns are 0.
  GlbClip Finish(const std::string& name, std::size_t body_shapes, int body_node, int muscle_node) const {
    GlbClip clip = {name, frames_, {}};
    for (int joint = kChassis; joint <= kEyeR; ++joint) {
      GlbChannel channel = {joint, false, {}};
      for (int f = 0; f < frames_; ++f) {
        Double3 degrees;
        for (int t = 0; t < kTurnCount; ++t) {
          const Turn& turn = kTurns[t];
          if (turn.joints[0] != joint && turn.joints[1] != joint) continue;
          degrees[turn.axis] += std::clamp(turns_[Size(f * kTurnCount + t)], turn.low, turn.high);
        }
        const Quaternion q =
            QuaternionFromRotation(RotationFromEuler(degrees * (kPi / 180), RotateOrder::kXyz));
        for (double v : {q.x, q.y, q.z, q.w}) channel.values.push_back(static_cast<float>(v));
      }
      clip.channels.push_back(std::move(channel));
    }
    GlbChannel body = {body_node, true, {}}, muscles = {muscle_node, true, {}};
    for (int f = 0; f < frames_; ++f) {
      for (std::size_t w = 0; w < names_.size(); ++w) {
        const double value = std::clamp(weights_[Size(f) * names_.size() + w], 0.0, 1.0);
        (w < bodys_ ? body : muscles).values.push_back(static_cast<float>(value));
        if (w + 1 == bodys_) body.values.insert(body.values.end(), body_shapes - bodys_, 0.0f);
      }
    }
    clip.channels.push_back(std::move(body));
    clip.channels.push_back(std::move(muscles));
    return clip;
  }

 private:
  static std::size_t Size(int i) { return static_cast<std::size_t>(i); }
  std::vector<std::string> names_;
  std::size_t bodys_;
  int frames_;
  std::vector<double> weights_, turns_;
};

// Every control to its end and back, 0 at both ends of a sweep; then pairs of them.
void Sweep(Track* track) {
  constexpr int kSweep = 6;
  int frame = 0;
  const auto sweep = [&](int a, double first, int b, double second) {
    for (int k = 0; k < kSweep; ++k, ++frame) {
      const double share = 1 - std::fabs(k - kSweep / 2.0) / (kSweep / 2.0);
      track->Add(frame, a, first * share);
      if (b >= 0) track->Add(frame, b, second * share);
    }
  };
  for (int c = 0; c < track->controls(); ++c) {
    sweep(c, 1, -1, 0);
    if (c >= track->weights()) sweep(c, -1, -1, 0);
  }
  Random random(31);
  while (frame + kSweep < track->frames()) {
    const int all = track->controls(), a = random.Below(all), b = (a + 1 + random.Below(all - 1)) % all;
    const double first = a >= track->weights() && random.Uniform() < 0.5 ? -1 : 1;
    sweep(a, first, b, b >= track->weights() && random.Uniform() < 0.5 ? -1 : 1);
  }
}

// Smooth motion between random keys, `calm` of which rest at 0.
void Wander(Track* track, int control, Random* random, int shortest, int longest, double calm,
            double largest) {
  double from = 0;
  for (int frame = 0; frame < track->frames();) {
    const int length = shortest + random->Below(longest - shortest + 1);
    const bool rests = random->Uniform() < calm;
    const double u = random->Uniform(),
                 sign = control >= track->weights() && random->Uniform() < 0.5 ? -1 : 1;
    const double to = rests ? 0 : sign * largest * (0.15 + 0.85 * u);
    for (int k = 0; k < length; ++k, ++frame)
      track->Add(frame, control, from + (to - from) * Smooth(0, length, k));
    from = to;
  }
}

// Syllables in phrases: the jaw opens and closes with a shape of the lips each; and blinks.
void Speak(Track* track, Random* random) {
  const int open = track->Find("mouthOpen"), jaw = track->weights();
  const int shapes[] = {track->Find("pucker"),        track->Find("funnel"),    track->Find("lipPress"),
                        track->Find("lipUpperUp"),    track->Find("stretch.L"), track->Find("smile.L"),
                        track->Find("lipLowerDown.L")};
  for (int frame = 4; frame + 12 < track->frames(); frame += 4 + random->Below(10)) {
    for (int syllables = 5 + random->Below(7); syllables > 0; --syllables) {
      const int length = 4 + random->Below(3), which = random->Below(static_cast<int>(std::size(shapes)));
      const double wide = random->Uniform(0.1, 0.65), lips = random->Uniform(0, 0.3),
                   amount = random->Uniform(0.2, 0.8);
      for (int k = -2; k < length + 2; ++k) {
        const double arc = Bump(k - length / 2.0, length / 2.0 + 2);
        track->Add(frame + k, jaw, wide * arc);
        track->Add(frame + k, open, lips * arc);
        track->Add(frame + k, shapes[which], amount * arc);
        if (which >= 4) track->Add(frame + k, shapes[which] + 1, 0.85 * amount * arc);
      }
      frame += length;
    }
  }
  const int left = track->Find("blink.L");
  for (int frame = 10 + random->Below(20); frame + 8 < track->frames(); frame += 30 + random->Below(50)) {
    constexpr double kBlink[] = {0.35, 0.85, 1.0, 0.75, 0.4, 0.15};
    for (int k = 0; k < 6; ++k) {
      track->Add(frame + k, left, kBlink[k]);
      track->Add(frame + k, left + 1, kBlink[k]);
    }
  }
}

}  // namespace

std::vector<GlbClip> CarClips(const std::vector<std::string>& expressions, int body_node,
                              const std::vector<std::string>& muscles, int muscle_node) {
  // Half shapes and combinations follow the controls
  const auto first = std::find(expressions.begin(), expressions.end(), "blinkHalf.L");
  std::vector<std::string> names(expressions.begin(), first);
  const std::size_t bodys = names.size();
  names.insert(names.end(), muscles.begin(), muscles.end());
  const auto track = [&](int frames) { return Track(names, bodys, frames); };
  const auto finish = [&](const Track& t, const char* name) {
    return t.Finish(name, expressions.size(), body_node, muscle_node);
  };
  Track extreme = track(24 * 24 + 1), train = track(30 * 24 + 1), talk = track(10 * 24 + 1);
  Sweep(&extreme);
  Random random(57);
  for (int c = 0; c < train.controls(); ++c) {
    const bool turn = c >= train.weights();
    Wander(&train, c, &random, 5, 14, turn ? 0.25 : 0.55, turn ? 0.8 : 0.9);
  }
  Random other(113);
  Speak(&talk, &other);
  const int blink = talk.Find("blink.L"), jaw = talk.weights();
  for (int c = 0; c < talk.controls(); ++c) {
    if (c == blink || c == blink + 1 || c == jaw) continue;
    const bool turn = c > jaw;
    Wander(&talk, c, &other, turn ? 12 : 7, turn ? 30 : 20, turn ? 0.2 : 0.6, turn ? 0.4 : 0.7);
  }
  std::vector<GlbClip> clips = {finish(extreme, "extreme"), finish(train, "talk_train"),
                                finish(talk, "talk")};
  for (const KeyedClip* keyed : {&CarEmotions(), &CarRace()}) {
    Track own = track(keyed->frames);
    own.Play(*keyed);
    clips.push_back(finish(own, keyed->name));
  }
  return clips;
}

}  // namespace kpsa::engine::scenes::car
