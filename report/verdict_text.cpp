#include "report/verdict_text.h"

#include <fmt/format.h>

#include <cmath>

#include "base/quantity_text.h"

namespace kpsa::engine {

const char* VerdictName(FrameVerdict verdict) {
  return verdict == FrameVerdict::kHit ? "hit" : verdict == FrameVerdict::kBlend ? "blend" : "miss";
}

std::string CountsText(std::size_t hits, std::size_t blends, std::size_t misses) {
  return fmt::format("{}, {}, {}", Plural(hits, "hit"), Plural(blends, "blend"), Plural(misses, "miss"));
}

std::string VerdictsText(const Verdicts& verdicts) {
  return CountsText(verdicts.hits(), verdicts.count(FrameVerdict::kBlend),
                    verdicts.count(FrameVerdict::kMiss)) +
         fmt::format(" of {}", Plural(verdicts.frames(), "frame")) +
         (std::isnan(verdicts.worst_score()) ? ""
                                             : fmt::format("; worst score {:.3g} at frame {}",
                                                           verdicts.worst_score(), verdicts.worst_frame()));
}

}  // namespace kpsa::engine
