#include "report/promise_text.h"

#include <fmt/format.h>

#include <cmath>

#include "base/quantity_text.h"

namespace kpsa::engine {
namespace {

std::string RateText(double share) { return fmt::format("{:.3g} %", 100 * share); }

}  // namespace

std::string PromiseText(const Promise& p, const std::string& indent) {
  if (!p.promised()) return "none: every frame is accepted, whatever its error\n";
  const std::string limit = (p.light ? "an RMS of " : "") + ErrorText(p.tolerance, p.light);
  std::string text;
  if (p.kept()) {
    text = fmt::format("kept: {} of {} beyond {} (promised {})", p.beyond, Plural(p.frames, "frame"), limit,
                       RateText(p.rate));
    if (p.hits_beyond > 0)
      text += fmt::format(", {} of {} (promised {})", p.hits_beyond, Plural(p.hits, "hit"),
                          RateText(p.hit_rate()));
  } else {
    const bool of_all = p.beyond_share() > p.rate;
    text = fmt::format("PROMISE BROKEN: {} > {} of {} beyond {} ({} of {})",
                       RateText(of_all ? p.beyond_share() : p.hits_beyond_share()),
                       RateText(of_all ? p.rate : p.hit_rate()), of_all ? "frames" : "hits", limit,
                       of_all ? p.beyond : p.hits_beyond, of_all ? p.frames : p.hits);
  }
  text += "; a rate of these clips, no estimate for others\n";
  if (p.worst_clip.empty()) return text + indent + "no frame was accepted\n";
  text += indent + fmt::format("worst accepted: frame {} of {}", p.worst_frame, p.worst_clip);
  text += p.tolerance > 0 && std::isfinite(p.worst_error)
              ? fmt::format(", {:.2f} tolerances\n", p.worst_error / p.tolerance)
              : fmt::format(", {}\n", ErrorText(p.worst_error, p.light));
  if (!p.kept())
    text += indent + "what helps: train on clips like this one, on more samples, or for a larger tolerance\n";
  return text;
}

}  // namespace kpsa::engine
