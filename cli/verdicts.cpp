#include "cli/verdicts.h"

#include <algorithm>
#include <cmath>

#include "kpsa/kpsa_node.h"

namespace kpsa {
namespace {

constexpr const char* kOutputs[] = {"fullWeight", "score", "missReason", "offender"};
constexpr Index kOutputCount = 4;

}  // namespace

const char* VerdictName(FrameVerdict verdict) {
  return verdict == FrameVerdict::kHit ? "hit" : verdict == FrameVerdict::kBlend ? "blend" : "miss";
}

std::string PictureTitle(const FrameDecision& decision) {
  switch (decision.verdict()) {
    case FrameVerdict::kHit:
      return "accelerated";
    case FrameVerdict::kBlend:
      // Never 0 or 100: these are the other two
      return fmt::format("blend: {:.0f} % full", std::clamp(100 * decision.full_weight, 1.0, 99.0));
    case FrameVerdict::kMiss:
      break;
  }
  return "miss: fully evaluated";
}

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
  first_output_ = static_cast<Index>(request->outputs.size());
  for (const AppliedSubspace& one : *applied_) {
    const NodeDef& def = rig.graph->def(one.node);
    for (const char* name : kOutputs)
      request->outputs.push_back({{one.node, def.FindAttribute(name), -1, -1}, {}});
  }
}

void Verdicts::Add(std::int64_t frame, const Evaluator& evaluator) {
  last_.clear();
  FrameRecord record{frame, {}};
  for (Index n = 0; n < applied_->size(); ++n) {
    const AppliedSubspace& one = (*applied_)[n];
    const Index output = first_output_ + kOutputCount * n;
    FrameDecision decision;
    decision.entry = one.name;
    decision.full_weight = evaluator.Get<double>(output);
    decision.score = evaluator.Get<double>(output + 1);
    const std::int64_t offender = evaluator.Get<std::int64_t>(output + 3);
    decision.reason = MissText(*one.config, static_cast<MissReason>(evaluator.Get<std::int64_t>(output + 2)),
                               offender < 0 ? kNoIndex : static_cast<Index>(offender));
    if (std::isfinite(decision.score) && !(decision.score <= worst_score_))
      worst_score_ = decision.score, worst_frame_ = frame;
    const FrameDecision& worst = record.decision;
    if (n == 0 || decision.full_weight > worst.full_weight ||
        (decision.full_weight == worst.full_weight && decision.score > worst.score))
      record.decision = decision;
    last_.push_back(std::move(decision));
  }
  ++counts_[static_cast<std::size_t>(record.decision.verdict())];
  if (!record.decision.hit()) {
    const std::string entry = applied_->size() > 1 ? record.decision.entry + ": " : "";
    reasons_.Add(entry + record.decision.reason, fmt::format("frame {}", frame));
  }
  records_.push_back(std::move(record));
}

std::string Verdicts::Text() const {
  return CountsText(hits(), count(FrameVerdict::kBlend), count(FrameVerdict::kMiss)) +
         fmt::format(" of {}", Plural(frames(), "frame")) +
         (std::isnan(worst_score_)
              ? ""
              : fmt::format("; worst score {:.3g} at frame {}", worst_score_, worst_frame_));
}

std::string CountsText(std::size_t hits, std::size_t blends, std::size_t misses) {
  return fmt::format("{}, {}, {}", Plural(hits, "hit"), Plural(blends, "blend"), Plural(misses, "miss"));
}

}  // namespace kpsa
