#include "host/bench/frame_times.h"

#include <algorithm>
#include <ctime>
#include <map>
#include <numeric>

#include "graph/profile.h"

namespace kpsa::engine {

std::uint64_t ThreadCpuClock() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(now.tv_nsec);
}

double ClockCost() {
  static const double cost = [] {
    std::vector<double> differences;
    for (int i = 0; i < 201; ++i) {
      const std::uint64_t begin = ProfileClock();
      differences.push_back(static_cast<double>(ProfileClock() - begin));
    }
    return Median(std::move(differences));
  }();
  return cost;
}

void TakeOff(double excess, std::span<const double> floors, std::span<double> times) {
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return times[a] - floors[a] > times[b] - floors[b]; });
  for (const std::size_t i : order) {
    const double off = std::min(excess, times[i] - floors[i]);
    if (!(off > 0)) break;
    times[i] -= off, excess -= off;
  }
}

void FrameTimes::BeginTurn(std::size_t first_frame) {
  next_ = first_frame;
  turns_.push_back({first_frame, first_frame, ns_[first_frame].size(), 0});
  // The clocks' own time counts as work: rather a turn too long than one too short
  if (cpu_) begin_cpu_ = ThreadCpuClock();
  begin_wall_ = ProfileClock();
}

void FrameTimes::Add(std::uint64_t ns) {
  ns_[next_++].push_back(std::max(1.0, static_cast<double>(ns) - ClockCost()));
}

void FrameTimes::EndTurn() {
  const auto wall = static_cast<double>(ProfileClock() - begin_wall_);
  const std::uint64_t cpu_end = cpu_ ? ThreadCpuClock() : 0;
  turns_.back().end = next_;
  wall_ns_ += wall;
  if (!cpu_) return;
  const auto cpu = static_cast<double>(cpu_end - begin_cpu_);
  cpu_ns_ += cpu;
  turns_.back().excess = std::max(0.0, wall - cpu);
}

const std::vector<std::vector<double>>& FrameTimes::Finish(std::span<const int> kinds) {
  std::vector<double> shortest;
  for (const std::vector<double>& runs : ns_)
    shortest.push_back(runs.empty() ? 0 : *std::min_element(runs.begin(), runs.end()));
  for (const Turn& turn : turns_) {
    std::vector<double> times, floors(shortest.begin() + static_cast<std::ptrdiff_t>(turn.first),
                                      shortest.begin() + static_cast<std::ptrdiff_t>(turn.end));
    for (std::size_t f = turn.first; f < turn.end; ++f) times.push_back(ns_[f][turn.run]);
    // Of a single run the other frames of the turn tell how long one should be
    if (ns_[turn.first].size() == 1) {
      std::map<int, std::vector<double>> alike;
      const auto kind = [&](std::size_t i) { return kinds.empty() ? 0 : kinds[turn.first + i]; };
      for (std::size_t i = 0; i < times.size(); ++i) alike[kind(i)].push_back(times[i]);
      for (std::size_t i = 0; i < times.size(); ++i) floors[i] = std::min(floors[i], Median(alike[kind(i)]));
    }
    TakeOff(turn.excess, floors, times);
    for (std::size_t f = turn.first; f < turn.end; ++f) ns_[f][turn.run] = times[f - turn.first];
  }
  turns_.clear();
  return ns_;
}

}  // namespace kpsa::engine
