#include "view/answers.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "report/page_fields.h"
#include "view/messages.h"
#include "view/pose_answer.h"
#include "view/vertex_answer.h"

namespace kpsa::engine {
namespace {

constexpr double kLongPoll = 20;  // seconds
constexpr const char* kBytes = "application/octet-stream";

Answer JsonAnswer(std::string text) {
  return {200, "application/json", std::make_shared<const std::string>(std::move(text))};
}

Answer BytesAnswer(std::string bytes) {
  return {200, kBytes, std::make_shared<const std::string>(std::move(bytes))};
}

Answer NotThere(const char* what, std::string_view name) {
  return Refusal(404, Status::Usage("there is no {} \"{}\"", what, name));
}

Answer Events(Session* session, std::string_view after) {
  const std::optional<std::int64_t> number = ParseWhole(after, true);
  if (!number.has_value()) return Refusal(400, Status::Usage("after: expected a whole number"));
  const Session::State state = session->WaitForChange(*number, kLongPoll);
  return JsonAnswer(fmt::format("{{\"serial\":{},\"generation\":{},\"problems\":{}}}", state.serial,
                                state.generation, ProblemList(state.problems, state.warnings)));
}

Answer Explain(const LiveRig& rig, std::string_view vertex) {
  const std::optional<std::int64_t> number = ParseWhole(vertex);
  if (!number.has_value() || static_cast<std::uint64_t>(*number) >= rig.vertices())
    return Refusal(400, Status::Usage("vertex: expected a number below {}", rig.vertices()));
  const Result<VertexAnswer> answer =
      TellOfVertex(rig.rest(), rig.latest(), static_cast<std::size_t>(*number));
  return answer.ok() ? JsonAnswer(VertexAnswerText(*answer)) : Refusal(400, answer.status());
}

Answer Field(const LiveRig& rig, std::string_view name) {
  const std::optional<std::vector<float>> field = FieldWeights(rig.rest(), name);
  if (!field.has_value()) return NotThere("field", name);
  return BytesAnswer({reinterpret_cast<const char*>(field->data()), field->size() * sizeof(float)});
}

Answer Evaluate(LiveRig* rig, std::string_view body) {
  const Result<EvaluateRequest> request = ParseEvaluate(body);
  if (!request.ok()) return Refusal(400, request.status());
  Answer answer;
  const Status status = rig->Evaluate(request->frame, [&](const LiveFrame& frame) {
    answer = BytesAnswer(EvaluateAnswer(*request, frame, rig->generation()));
  });
  return status.ok() ? answer : Refusal(400, status);
}

}  // namespace

Answer Refusal(int status, const Status& problems) {
  Answer answer = JsonAnswer(ProblemsAnswer(problems));
  answer.status = status;
  return answer;
}

Answer AnswerGet(Session* session, std::string_view path, std::string_view number) {
  constexpr std::string_view kBlob = "/blob/", kField = "/field/";
  if (path == "/events") return Events(session, number);
  const std::shared_ptr<LiveRig> rig = session->rig();
  if (path == "/meta.json") return {200, "application/json", {rig, &rig->meta()}};
  if (path == "/explain") return Explain(*rig, number);
  if (path.starts_with(kField)) return Field(*rig, path.substr(kField.size()));
  if (path.starts_with(kBlob)) {
    const PageBlob* blob = rig->page().Find(path.substr(kBlob.size()));
    if (blob == nullptr) return NotThere("blob", path.substr(kBlob.size()));
    return {200, kBytes, {rig, &blob->bytes}};
  }
  return NotThere("page", path);
}

Answer AnswerPost(Session* session, std::string_view path, std::string_view body) {
  const std::shared_ptr<LiveRig> rig = session->rig();
  if (path == "/evaluate") return Evaluate(rig.get(), body);
  if (path != "/pose-file") return NotThere("page", path);
  Result<std::string> pose = PoseAnswer(rig->rest(), body);
  return pose.ok() ? JsonAnswer(std::move(*pose)) : Refusal(400, pose.status());
}

}  // namespace kpsa::engine
