#include "host/playing.h"

#include <algorithm>

#include "host/decisions.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostPlans = 16;  // that are kept

bool Same(const Request& a, const Request& b) {
  return a.varying == b.varying && std::ranges::equal(a.outputs, b.outputs, [](const auto& x, const auto& y) {
           return x.plug == y.plug;  // always all points
         });
}

}  // namespace

Result<std::shared_ptr<Playing>> Playing::Make(const Rig& rest, const std::optional<std::string>& clip,
                                               std::span<const Setting> settings,
                                               const std::optional<AccelerationChoice>& acceleration) {
  std::shared_ptr<Playing> playing(new Playing(rest));
  Rig& rig = playing->rig_;
  if (clip.has_value()) KPSA_RETURN_IF_ERROR(SetClip(&rig, *clip).At({rig.path}));
  for (const Setting& setting : settings) KPSA_RETURN_IF_ERROR(ApplySetting(&rig, setting));
  if (acceleration.has_value()) {
    Result<std::vector<AppliedSubspace>> applied =
        ApplyAcceleration(&rig, &playing->compiler_, *acceleration);
    if (!applied.ok()) return applied.status();
    playing->applied_ = std::move(*applied);
  }
  Request& request = playing->request_;
  for (const std::size_t m : ShownMeshes(rig.scene))
    request.outputs.push_back({rig.scene.meshes[m].points, {}});
  request.varying = VaryingPlugs(rig);
  playing->first_decision_ = AskForDecisions(playing->applied_, *rig.graph, &request);
  return playing;
}

Status Playing::Located(const Status& status) const {
  Status located;
  for (const Error& error : status.errors()) located.Append(Status(error).At(PlaceOf(rig_, error)));
  return located;
}

Result<std::shared_ptr<const Plan>> Playing::PlanFor(const Request& request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [known, plan] : plans_) {
    if (Same(known, request)) return plan;
  }
  Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig_.graph, request);
  if (!plan.ok()) return Located(plan.status());
  if (plans_.size() == kMostPlans) plans_.erase(plans_.begin());
  plans_.emplace_back(request, *plan);
  return plan;
}

}  // namespace kpsa::engine
