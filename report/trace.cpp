#include "report/trace.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "graph/plan_report.h"

namespace kpsa::engine {
namespace {

// Microseconds with all digits of the nanoseconds, so that rounding cannot make neighbours overlap.
std::string Microseconds(std::uint64_t ns) { return fmt::format("{}.{:03}", ns / 1000, ns % 1000); }

std::string Quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string TraceJson(const Plan& plan, const Profile& profile, std::span<const FrameSpan> frames,
                      std::span<const double> times) {
  std::uint64_t zero = frames.empty() ? 0 : frames.front().begin_ns;
  std::map<int, int> tracks;  // of threads, numbered from 1
  for (const ProfileEvent& e : profile.events()) {
    zero = std::min(zero, e.begin_ns);
    tracks.emplace(e.thread, static_cast<int>(tracks.size()) + 1);
  }
  std::string text = "{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n";
  text += "{\"ph\":\"M\",\"pid\":1,\"tid\":0,\"name\":\"process_name\",\"args\":{\"name\":\"kpsa\"}}";
  for (int track = 0; track <= static_cast<int>(tracks.size()); ++track) {
    text += fmt::format(
        ",\n{{\"ph\":\"M\",\"pid\":1,\"tid\":{},\"name\":\"thread_name\",\"args\":{{\"name\":\"{}\"}}}}",
        track, track == 0 ? "frames" : fmt::format("thread {}", track));
  }
  for (std::size_t f = 0; f < frames.size(); ++f) {
    text += fmt::format(
        ",\n{{\"ph\":\"X\",\"pid\":1,\"tid\":0,\"cat\":\"frame\",\"name\":\"frame "
        "{}\",\"ts\":{},\"dur\":{},\"args\":{{\"time\":{}}}}}",
        f, Microseconds(frames[f].begin_ns - zero), Microseconds(frames[f].end_ns - frames[f].begin_ns),
        times.empty() ? 0.0 : times[std::min(f, times.size() - 1)]);
  }
  for (const ProfileEvent& e : profile.events()) {
    text += fmt::format(
        ",\n{{\"ph\":\"X\",\"pid\":1,\"tid\":{},\"cat\":{},\"name\":{},\"ts\":{},\"dur\":{},\"args\":{{"
        "\"frame\":{},\"points\":{},\"cause\":{}}}}}",
        tracks[e.thread], Quoted(plan.step_type(e.step)), Quoted(StepName(plan, e.step)),
        Microseconds(e.begin_ns - zero), Microseconds(e.end_ns - e.begin_ns), e.frame,
        plan.infos()[e.step].points, Quoted(CauseName(plan, e.cause)));
  }
  return text + "\n]}\n";
}

}  // namespace kpsa::engine
