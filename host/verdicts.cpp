#include "host/verdicts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/quantity_text.h"

namespace kpsa::engine {

void Reasons::Add(const std::string& text, const std::string& frame) {
  auto reason =
      std::find_if(reasons_.begin(), reasons_.end(), [&](const Reason& r) { return r.text == text; });
  if (reason == reasons_.end()) reason = reasons_.insert(reasons_.end(), Reason{text, frame, 0});
  ++reason->count;
}

std::string Reasons::MostFrequent() const {
  const auto most = std::max_element(reasons_.begin(), reasons_.end(),
                                     [](const Reason& a, const Reason& b) { return a.count < b.count; });
  if (most == reasons_.end()) return "";
  return fmt::format("most frequent reason ({}, first at {}): {}", Plural(most->count, "frame"),
                     most->first_frame, most->text);
}

void Verdicts::Ask(const Rig& rig, Request* request) {
  first_output_ = AskForDecisions(*applied_, *rig.graph, request);
}

void Verdicts::Add(std::int64_t frame, const Evaluator& evaluator) {
  last_.clear();
  FrameRecord record{frame, {}};
  for (Index n = 0; n < applied_->size(); ++n) {
    FrameDecision decision = DecisionOf((*applied_)[n], evaluator, first_output_ + kDecisionOutputs * n);
    if (std::isfinite(decision.score) && !(decision.score <= worst_score_))
      worst_score_ = decision.score, worst_frame_ = frame;
    if (n == 0 || IsWorse(decision, record.decision)) record.decision = decision;
    last_.push_back(std::move(decision));
  }
  ++counts_[static_cast<std::size_t>(record.decision.verdict())];
  if (!record.decision.hit()) {
    const std::string entry = applied_->size() > 1 ? record.decision.entry + ": " : "";
    reasons_.Add(entry + record.decision.reason, fmt::format("frame {}", frame));
  }
  records_.push_back(std::move(record));
}

}  // namespace kpsa::engine
