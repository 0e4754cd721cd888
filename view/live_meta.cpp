#include "view/live_meta.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/rig_frames.h"
#include "kpsa/kpsa_node.h"
#include "report/json_text.h"

namespace kpsa::engine {

void PutTolerance(const std::vector<AppliedSubspace>& applied, PageData* page) {
  double tolerance = kAnyError;
  for (const AppliedSubspace& one : applied) tolerance = std::min(tolerance, one.tolerance);
  if (tolerance < kAnyError) page->Put("tolerance", nlohmann::json(tolerance).dump());
}

Status PutClipTimes(const Rig& rest, const std::optional<std::string>& first, PageData* page) {
  using Json = nlohmann::ordered_json;
  Json clips = Json::array();
  bool known = !first.has_value();
  for (const CharacterClip& clip : rest.scene.clips) {
    known = known || clip.id == *first;
    const Result<std::vector<double>> times = ClipTimes(clip, rest.fps);
    if (!times.ok()) return times.status();
    if (times->empty()) continue;
    Json told = {{"name", clip.id}, {"frames", times->size()}, {"fps", rest.fps}, {"begin", times->front()}};
    if (clip.id == first)
      clips.insert(clips.begin(), std::move(told));
    else
      clips.push_back(std::move(told));
  }
  if (!known) return Status::Usage("{}", NoSuchClip(rest.scene, *first).errors().front().message);
  if (!clips.empty()) page->Put("clips", clips.dump(-1, ' ', false, Json::error_handler_t::replace));
  return Status();
}

void PutHandles(const Rig& rest, const std::vector<Handle>& handles, const std::vector<Double3>& places,
                PageData* page) {
  using Json = nlohmann::ordered_json;
  Json told = Json::array();
  for (std::size_t h = 0; h < handles.size(); ++h) {
    Json controls = Json::array(), place = controls;
    for (const std::size_t c : handles[h].controls) controls.push_back(rest.controls[c].name);
    for (int axis = 0; axis < 3; ++axis) place.push_back(RoundedJson<Json>(places[h][axis], 6));
    told.push_back({{"name", handles[h].name},
                    {"kind", handles[h].turns ? "turn" : "move"},
                    {"controls", std::move(controls)},
                    {"position", std::move(place)}});
  }
  if (!told.empty()) page->Put("handles", CompactJson(told));
}

}  // namespace kpsa::engine
