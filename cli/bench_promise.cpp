#include "cli/bench_promise.h"

#include <algorithm>
#include <cmath>

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

double Share(std::size_t part, std::size_t all) {
  return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
}

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

}  // namespace

void Promise::Make(const std::vector<AppliedSubspace>& applied) {
  tolerance = rate = 0;
  for (const AppliedSubspace& one : applied) {
    light = one.subspace->of_light();
    tolerance = std::max(tolerance, one.tolerance);
    rate = std::min(1.0, rate + CalibrationInForce(one).attainable_alpha);
  }
}

void Promise::Add(const std::string& clip, std::int64_t frame, bool hit, bool accepted, double error) {
  ++frames;
  hits += hit;
  if (!accepted) return;
  const bool is_beyond = !(error <= tolerance);
  beyond += is_beyond;
  hits_beyond += is_beyond && hit;
  if (worst_clip.empty() || error > worst_error) worst_clip = clip, worst_frame = frame, worst_error = error;
}

bool Promise::promised() const { return tolerance < kAnyError; }

bool Promise::kept() const {
  return !promised() || (Share(beyond, frames) <= rate && Share(hits_beyond, hits) <= hit_rate());
}

std::string Promise::Text(const std::string& indent) const {
  if (!promised()) return "none: every frame is accepted, whatever its error\n";
  const std::string limit = (light ? "an RMS of " : "") + ErrorText(tolerance, light);
  std::string text;
  if (kept()) {
    text = fmt::format("kept: {} of {} beyond {} (promised {})", beyond, Plural(frames, "frame"), limit,
                       Percent(rate));
    if (hits_beyond > 0)
      text += fmt::format(", {} of {} (promised {})", hits_beyond, Plural(hits, "hit"), Percent(hit_rate()));
  } else {
    const bool of_all = Share(beyond, frames) > rate;
    text = fmt::format("PROMISE BROKEN: {} > {} of {} beyond {} ({} of {})",
                       Percent(of_all ? Share(beyond, frames) : Share(hits_beyond, hits)),
                       Percent(of_all ? rate : hit_rate()), of_all ? "frames" : "hits", limit,
                       of_all ? beyond : hits_beyond, of_all ? frames : hits);
  }
  text += "; a rate of these clips, no estimate for others\n";
  if (worst_clip.empty()) return text + indent + "no frame was accepted\n";
  text += indent + fmt::format("worst accepted: frame {} of {}", worst_frame, worst_clip);
  text += tolerance > 0 && std::isfinite(worst_error)
              ? fmt::format(", {:.2f} tolerances\n", worst_error / tolerance)
              : fmt::format(", {}\n", ErrorText(worst_error, light));
  if (!kept())
    text += indent + "what helps: train on clips like this one, on more samples, or for a larger tolerance\n";
  return text;
}

}  // namespace kpsa::engine
