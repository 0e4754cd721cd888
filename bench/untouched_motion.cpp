#include "bench/untouched_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine::untouched {
namespace {

constexpr double kInEvent = 0.6;        // odds of a group,
constexpr double kMotionInEvent = 0.5;  // and of each of its motions
constexpr double kMorphInPose = 0.3;    // odds of a morph
constexpr double kLag = 0.035;          // seconds by which each bone of a chain follows
constexpr double kOvershoot = 0.07;     // of a move

double Smooth(double t) {  // minimum jerk (Flash, Hogan 1985)
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

class Maker {
 public:
  Maker(const Design& design, const ClipDesign& clip, std::uint64_t seed)
      : design_(design),
        clip_(clip),
        random_(seed),
        frames_(static_cast<std::size_t>(Count(random_, 90, 180))),
        curves_(design.motions.size()) {}

  Curves Make() {
    switch (clip_.formula) {
      case Formula::kCycles:
        Cycles();
        break;
      case Formula::kSines:
        Sines();
        break;
      case Formula::kEvents:
        Events();
        break;
      case Formula::kMoves:
        Moves();
        return std::move(curves_);
    }
    for (std::size_t m = 0; m < curves_.size(); ++m) Fit(m);
    return std::move(curves_);
  }

 private:
  const MotionRange& motion(std::size_t m) const { return design_.motions[m]; }
  double ShareOf(std::size_t m) const { return clip_.shares[motion(m).group]; }
  bool Rests(std::size_t m) const { return !(ShareOf(m) > 0); }
  static double Seconds(std::size_t frame) { return static_cast<double>(frame) / kClipFps; }
  double Phase() { return Between(random_, 0, 2 * kPi); }

  void Cycles() {
    const double base = 2 * kPi * Between(random_, 0.7, 1.2);
    std::vector<double> of_group;
    for (std::size_t g = 0; g < design_.groups.size(); ++g) of_group.push_back(Phase());
    for (std::size_t m = 0; m < curves_.size(); ++m) {
      const double own = Between(random_, -0.6, 0.6), second = Between(random_, 0.1, 0.45),
                   second_phase = Phase(), third = Between(random_, 0, 0.15), third_phase = Phase();
      if (Rests(m)) continue;
      const double phase =
          of_group[motion(m).group] + own - design_.groups[motion(m).group].lag * motion(m).depth;
      for (std::size_t f = 0; f < frames_; ++f) {
        const double angle = base * Seconds(f) + phase;
        curves_[m].push_back(Sin(angle) + second * Sin(2 * angle + second_phase) +
                             third * Sin(3 * angle + third_phase));
      }
    }
  }

  void Sines() {
    for (std::size_t m = 0; m < curves_.size(); ++m) {
      std::array<double, 9> wave{};
      for (std::size_t k = 0; k < 3; ++k) {
        wave[3 * k] = 2 * kPi * Between(random_, 0.2, 1.6);
        wave[3 * k + 1] = Phase();
        wave[3 * k + 2] = Between(random_, 0.4, 1) / (1 + 0.1 * wave[3 * k]);
      }
      if (Rests(m)) continue;
      for (std::size_t f = 0; f < frames_; ++f) {
        double value = 0;
        for (std::size_t k = 0; k < 3; ++k)
          value += wave[3 * k + 2] * Sin(wave[3 * k] * Seconds(f) + wave[3 * k + 1]);
        // Shapes rest most of the time
        if (motion(m).kind == MotionKind::kMorph) value = value > 0 ? value * value : 0;
        curves_[m].push_back(value);
      }
    }
  }

  void Events() {
    const double length = Seconds(frames_ - 1);
    const int events = Count(random_, 7, 11);
    for (std::size_t m = 0; m < curves_.size(); ++m) {
      if (!Rests(m)) curves_[m].assign(frames_, 0);
    }
    for (int e = 0; e < events; ++e) {
      const double rise = Between(random_, 0.25, 0.6), stay = Between(random_, 0, 0.4);
      const double begin = Between(random_, 0, std::max(0.1, length - 2 * rise - stay));
      std::vector<bool> takes_part;
      for (std::size_t g = 0; g < design_.groups.size(); ++g) takes_part.push_back(random_.Unit() < kInEvent);
      for (std::size_t m = 0; m < curves_.size(); ++m) {
        const bool chosen = random_.Unit() < kMotionInEvent;
        double size = Between(random_, 0.3, 1);
        if (random_.Unit() < 0.5) size = -size;
        // Each motion goes to either side once at least
        const std::size_t turn = (m + static_cast<std::size_t>(e)) % static_cast<std::size_t>(events);
        if (turn < 2) size = turn == 0 ? 1 : -1;
        if (Rests(m) || !((takes_part[motion(m).group] && chosen) || turn < 2)) continue;
        const double amount = motion(m).low < 0 && motion(m).high > 0 ? size : std::fabs(size);
        for (std::size_t f = 0; f < frames_; ++f) {
          const double t = Seconds(f) - begin;
          const double weight = Smooth(t / rise) - Smooth((t - rise - stay) / rise);
          curves_[m][f] += amount * weight;
        }
      }
    }
  }

  // The curve's ends become those of its range. A curve that rests at 0 stays there.
  void Fit(std::size_t m) {
    std::vector<double>& curve = curves_[m];
    if (curve.empty()) return;
    // The leader of a motion goes to its ends, the others to a part of what they may
    const double part = ShareOf(m) == 1 ? 1 : Between(random_, 0.6, 1);
    const double low = motion(m).low * ShareOf(m) * part, high = motion(m).high * ShareOf(m) * part;
    const auto [least, most] = std::minmax_element(curve.begin(), curve.end());
    const double a = *least, b = *most;
    if (!(b - a > 1e-9)) return;
    const bool from_rest = clip_.formula == Formula::kEvents || motion(m).kind == MotionKind::kMorph;
    for (double& value : curve) {
      if (!from_rest) {
        value = low + (high - low) * (value - a) / (b - a);
      } else if (motion(m).low < 0 && motion(m).high > 0) {
        value = value < 0 ? low * value / a : b > 0 ? high * value / b : 0;
      } else {
        value = (motion(m).high > 0 ? high : low) * value / b;
      }
    }
  }

  // Of each motion within its range.
  std::vector<double> RandomPose() {
    std::vector<double> common, pose;
    for (std::size_t g = 0; g < design_.groups.size(); ++g) common.push_back(Between(random_, -1, 1));
    for (std::size_t m = 0; m < curves_.size(); ++m) {
      const double coherence = design_.groups[motion(m).group].coherence, own = Between(random_, -1, 1),
                   chance = random_.Unit();
      double where = coherence * common[motion(m).group] + (1 - coherence) * own;
      if (motion(m).kind == MotionKind::kMorph) where = chance < kMorphInPose ? std::fabs(own) : 0;
      const double low = motion(m).low * ShareOf(m), high = motion(m).high * ShareOf(m);
      pose.push_back(low < 0 && high > 0 ? (where < 0 ? -where * low : where * high)
                                         : std::fabs(where) * (high > 0 ? high : low));
    }
    return pose;
  }

  void Moves() {
    struct Move {
      double begin, length;
      std::vector<double> to;
    };
    std::vector<Move> moves;
    for (double t = Between(random_, 0, 0.2); t < Seconds(frames_);) {
      Move move{t, Between(random_, 0.4, 0.9), RandomPose()};
      t += move.length + Between(random_, 0, 0.3);
      moves.push_back(std::move(move));
    }
    const std::vector<double> first = RandomPose();
    const double swing = 2 * kPi * Between(random_, 2, 3.5);
    for (std::size_t m = 0; m < curves_.size(); ++m) {
      if (Rests(m)) continue;
      const bool follows = motion(m).kind == MotionKind::kTurn;
      for (std::size_t f = 0; f < frames_; ++f) {
        const double now = Seconds(f) - (follows ? kLag * motion(m).depth : 0);
        double value = first[m], from = first[m];
        for (const Move& move : moves) {
          const double step = move.to[m] - from, after = now - move.begin - move.length;
          value += step * Smooth((now - move.begin) / move.length);
          if (follows && after > 0) value += kOvershoot * step * Exp(-after / 0.15) * Sin(swing * after);
          from = move.to[m];
        }
        curves_[m].push_back(value);
      }
    }
  }

  const Design& design_;
  const ClipDesign& clip_;
  Random random_;
  std::size_t frames_;
  Curves curves_;
};

}  // namespace

Curves MakeCurves(const Design& design, const ClipDesign& clip, std::uint64_t seed) {
  return Maker(design, clip, seed).Make();
}

}  // namespace kpsa::engine::untouched
