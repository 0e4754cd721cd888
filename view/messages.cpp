#include "view/messages.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "files/json_depth.h"
#include "report/json_text.h"
#include "report/verdict_text.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDeepest = 8;  // a request needs 2

std::string Text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

// Of a key that may be absent or null.
const Json* Find(const Json& map, const char* key) {
  const auto at = map.find(key);
  return at == map.end() || at->is_null() ? nullptr : &*at;
}

Status ReadSet(const Json& set, PoseRequest* pose) {
  if (!set.is_object()) return Status::Usage("set: expected plugs and their numbers");
  for (const auto& [plug, value] : set.items()) {
    if (value.is_boolean()) {
      pose->set.emplace_back(plug, value.get<bool>() ? 1 : 0);
      continue;
    }
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (!std::isfinite(number)) return Status::Usage("set: {}: expected a number", plug);
    pose->set.emplace_back(plug, number);
  }
  return Status();
}

Status ReadMode(const Json& mode, EvaluateMode* to) {
  if (mode == "full")
    *to = EvaluateMode::kFull;
  else if (mode == "accelerated")
    *to = EvaluateMode::kAccelerated;
  else if (mode == "both")
    *to = EvaluateMode::kBoth;
  else
    return Status::Usage("mode: expected full, accelerated or both");
  return Status();
}

Status ReadVector(const Json& drag, const char* key, Double3* to) {
  const Json* numbers = Find(drag, key);
  if (numbers == nullptr || !numbers->is_array() || numbers->size() != 3 ||
      !std::ranges::all_of(*numbers, [](const Json& number) { return number.is_number(); }))
    return Status::Usage("drag: {}: expected three numbers", key);
  for (std::size_t axis = 0; axis < 3; ++axis) (*to)[static_cast<int>(axis)] = (*numbers)[axis].get<double>();
  return Status();
}

Status ReadDrag(const Json& json, std::optional<Drag>* to) {
  if (!json.is_object()) return Status::Usage("drag: expected a handle, from and along");
  Drag drag;
  const Json* handle = Find(json, "handle");
  if (handle == nullptr || !handle->is_number_unsigned())
    return Status::Usage("drag: handle: expected its number");
  drag.handle = handle->get<std::size_t>();
  KPSA_RETURN_IF_ERROR(ReadVector(json, "from", &drag.line.from));
  KPSA_RETURN_IF_ERROR(ReadVector(json, "along", &drag.line.along));
  *to = drag;
  return Status();
}

void Put(Json* facts, const char* key, const std::optional<double>& number) {
  if (number.has_value() && std::isfinite(*number)) (*facts)[key] = *number;
}

// Each name once: not looked for among the others.
Json ByName(const std::vector<std::pair<std::string, double>>& values) {
  Json::object_t map;
  for (const auto& [name, value] : values) map.push_back({name, value});
  return map;
}

}  // namespace

Result<EvaluateRequest> ParseEvaluate(std::string_view body) {
  KPSA_RETURN_IF_ERROR(
      CheckJsonDepth({reinterpret_cast<const std::uint8_t*>(body.data()), body.size()}, kDeepest));
  const Json json = Json::parse(body, nullptr, false);
  if (json.is_discarded()) return Status::Usage("the request is no JSON");
  if (!json.is_object()) return Status::Usage("the request is no object");
  EvaluateRequest request;
  if (const Json* id = Find(json, "id"); id != nullptr && id->is_number()) request.id = Text(*id);
  if (const Json* set = Find(json, "set")) KPSA_RETURN_IF_ERROR(ReadSet(*set, &request.frame.pose));
  if (const Json* clip = Find(json, "clip")) {
    if (!clip->is_string()) return Status::Usage("clip: expected a name");
    request.frame.pose.clip = clip->get<std::string>();
  }
  if (const Json* time = Find(json, "time")) {
    if (!time->is_number()) return Status::Usage("time: expected seconds");
    request.frame.pose.seconds = time->get<double>();
  }
  if (const Json* mode = Find(json, "mode")) KPSA_RETURN_IF_ERROR(ReadMode(*mode, &request.frame.mode));
  if (const Json* handles = Find(json, "handles")) {
    if (!handles->is_boolean()) return Status::Usage("handles: expected true or false");
    request.frame.handles = handles->get<bool>();
  }
  if (const Json* drag = Find(json, "drag")) KPSA_RETURN_IF_ERROR(ReadDrag(*drag, &request.frame.drag));
  return request;
}

std::string EvaluateAnswer(const EvaluateRequest& request, const LiveFrame& frame, std::uint64_t generation) {
  Json facts = {{"generation", generation}, {"parts", Json::array()}, {"verdict", nullptr}};
  std::size_t bytes = 0;
  for (const auto& [name, points] : {std::pair{"accelerated", frame.accelerated}, {"full", frame.full}}) {
    if (points == nullptr) continue;
    facts["parts"].push_back(name);
    bytes += points->size() * sizeof(float);
  }
  if (frame.decision.has_value()) {
    facts["verdict"] = VerdictName(frame.decision->verdict());
    facts["reason"] = frame.decision->reason;
    Put(&facts, "score", frame.decision->score);
  }
  Put(&facts, "full_us", frame.full_us);
  Put(&facts, "accelerated_us", frame.accelerated_us);
  Put(&facts, "max_error", frame.max_error);
  Put(&facts, "rms_error", frame.rms_error);
  if (!frame.values.empty()) facts["values"] = ByName(frame.values);
  if (!frame.dragged.empty()) facts["dragged"] = ByName(frame.dragged);
  if (!frame.handles.empty()) {
    Json& places = facts["handles"] = Json::array();
    for (const Double3& place : frame.handles) {
      for (int axis = 0; axis < 3; ++axis) places.push_back(RoundedJson<Json>(place[axis], 6));
    }
  }
  if (!frame.problem.empty()) facts["problem"] = frame.problem;
  const std::string json = "{\"id\":" + request.id + "," + Text(facts).substr(1);

  const auto length = static_cast<std::uint32_t>(json.size());
  std::string answer(sizeof(length), '\0');
  std::memcpy(answer.data(), &length, sizeof(length));
  answer.reserve(answer.size() + json.size() + 3 + bytes);
  answer += json;
  answer.append((4 - answer.size() % 4) % 4, '\0');
  for (const std::vector<float>* points : {frame.accelerated, frame.full}) {
    if (points != nullptr)
      answer.append(reinterpret_cast<const char*>(points->data()), points->size() * sizeof(float));
  }
  return answer;
}

std::string ProblemList(const Status& status, bool warnings) {
  Json list = Json::array();
  for (const Error& error : status.errors()) {
    Json problem = {{"severity", warnings ? "warning" : "error"}};
    if (!error.where.file.empty()) problem["file"] = error.where.file;
    if (error.where.line > 0) problem["line"] = error.where.line;
    if (error.where.column > 0) problem["column"] = error.where.column;
    std::string message = error.message;
    if (!error.suggestion.empty()) {
      problem["suggestion"] = error.suggestion;
      const std::string within = " (" + error.suggestion + ")";
      if (const std::size_t at = message.find(within); at != std::string::npos)
        message.erase(at, within.size());
    }
    problem["message"] = message;
    list.push_back(std::move(problem));
  }
  return Text(list);
}

std::string ProblemsAnswer(const Status& status) { return "{\"problems\":" + ProblemList(status) + "}"; }

std::optional<std::int64_t> ParseWhole(std::string_view text, bool or_minus_one) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  if (number < (or_minus_one ? -1 : 0)) return std::nullopt;
  return number;
}

}  // namespace kpsa::engine
