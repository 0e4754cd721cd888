#include "kpsa/poses.h"

#include <algorithm>

namespace kpsa {
namespace {

// SplitMix64 (Steele, Lea, Flood 2014): the same everywhere, unlike the standard's distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1p-53; }
  std::size_t Below(std::size_t n) { return static_cast<std::size_t>(Next() % n); }

 private:
  std::uint64_t state_;
};

}  // namespace

std::vector<SampledPose> SamplePoses(const std::vector<ControlRange>& controls, std::size_t clips, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<SampledPose> poses(count);
  const std::size_t n = controls.size();
  const std::size_t singles = count / 4;
  for (std::size_t p = 0; p < count; ++p) {
    SampledPose& pose = poses[p];
    for (const ControlRange& control : controls) pose.values.push_back(control.rest);
    if (p >= singles && clips > 0 && p % 2 == 0) {
      pose.clip = static_cast<int>(random.Below(clips));
      pose.phase = random.Unit();
    }
    if (n == 0) continue;
    const auto move = [&](std::size_t i, double amount) {
      const ControlRange& c = controls[i];
      const double end = random.Unit() < (c.max - c.rest) / std::max(c.max - c.min, 1e-300) ? c.max : c.min;
      pose.values[i] = c.rest + (end - c.rest) * amount;
    };
    if (p < singles) {
      move(p % n, 0.6 + 0.4 * random.Unit());
      if (random.Unit() < 0.5) move(random.Below(n), random.Unit());
      continue;
    }
    // Few controls or many: real poses are both. Many at once stay smaller, and so does what is laid over a clip, whose
    // own motion is there already.
    const double share = random.Unit();
    const std::size_t most = pose.clip >= 0 ? 4 : std::max<std::size_t>(4, n / 5);
    const std::size_t active = 1 + static_cast<std::size_t>(share * share * static_cast<double>(most));
    const double reach = pose.clip >= 0 ? 0.35 : active > 8 ? 0.6 : 1.0;
    for (std::size_t k = 0; k < active; ++k) move(random.Below(n), reach * random.Unit());
    if (random.Unit() < 0.5) continue;
    for (std::size_t i = 0; i < n; ++i) {
      if (controls[i].often) move(i, random.Unit());
    }
  }
  return poses;
}

}  // namespace kpsa
