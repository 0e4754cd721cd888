// Clips that are written by hand: keys of a few controls, and what shakes. Nothing of them is random, no
// trainer sees them, and nothing was chosen by them.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace kpsa::engine::scenes {

// A control is an expression, "smile" for both sides and "smile.L" for one, or a turn of a joint, "jaw.x".
struct KeyedMotion {
  std::string control;
  std::vector<std::pair<int, double>> keys;  // frame, weight or degrees; smooth in between
};
// Up and down between two frames: the amount once a period, which is 0 at its ends.
struct Shake {
  std::string control;
  int from, to;
  double amount;
  int period;
};
struct KeyedClip {
  const char* name;
  int frames;
  std::vector<KeyedMotion> motions;
  std::vector<Shake> shakes;
};

// Adds all that moves, frame by frame, to the control of that name. Right sides go a little less far.
using AddToControl = std::function<void(const std::string& control, int frame, double value)>;
void Play(const KeyedClip& clip, const std::function<bool(const std::string&)>& exists,
          const AddToControl& add);

const KeyedClip& BoyScene();     // a shy look away, a laugh, a yawn; then it chews
const KeyedClip& AnimalSniff();  // follows a scent, snarls, sneezes, shakes its head
const KeyedClip& CarRace();      // off from the lights, two bends, a jump, the flag
const KeyedClip& CarEmotions();  // as the heads': joy, anger, sadness, surprise, fear, disgust

}  // namespace kpsa::engine::scenes
