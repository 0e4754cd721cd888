#include "tests/support/naive_twin.h"

#include <fmt/format.h>

#include <cmath>

namespace kpsa::engine {
namespace {

bool Overlap(const NaiveTwin::Plug& a, const NaiveTwin::Plug& b) {
  return a.node == b.node && a.attribute == b.attribute &&
         (a.element == b.element || a.element < 0 || b.element < 0) &&
         (a.component == b.component || a.component < 0 || b.component < 0);
}

double AsFloat(double v) { return static_cast<float>(v); }

}  // namespace

std::string NaiveTwin::Plug::Name() const {
  std::string name = fmt::format("{}.{}", node, attribute);
  if (element >= 0) name += fmt::format("[{}]", element);
  if (component >= 0) name += fmt::format(".{}", "xyz"[component]);
  return name;
}

void NaiveTwin::Remove(const std::string& name) {
  types.erase(name);
  std::erase_if(held, [&](const auto& entry) { return entry.first.node == name; });
  std::erase_if(drivers,
                [&](const auto& entry) { return entry.first.node == name || entry.second.node == name; });
}

void NaiveTwin::Set(const Plug& plug, Held value) {
  std::erase_if(held, [&](const auto& entry) {
    const Plug& p = entry.first;
    return Overlap(p, plug) && (plug.element < 0 || p.element == plug.element) &&
           (plug.component < 0 || p.component == plug.component);
  });
  held[plug] = std::move(value);
}

bool NaiveTwin::Overlaps(const Plug& destination, bool replace) const {
  for (const auto& [to, from] : drivers) {
    if (Overlap(to, destination) && !(replace && to == destination)) return true;
  }
  return false;
}

bool NaiveTwin::DependsOn(const Plug& plug, const Plug& target) const {
  std::map<Plug, bool> seen;
  return Depends(plug, target, &seen);
}

bool NaiveTwin::Depends(const Plug& plug, const Plug& target, std::map<Plug, bool>* seen) const {
  if (Overlap(plug, target)) return true;
  if (!seen->emplace(plug, true).second) return false;
  if (IsOutput(plug) && plug.node == target.node && !IsOutput(target)) return true;
  for (const auto& [to, from] : drivers) {
    const bool reads = IsOutput(plug) ? to.node == plug.node : Overlap(to, plug);
    if (reads && Depends(from, target, seen)) return true;
  }
  return false;
}

const NaiveTwin::Plug* NaiveTwin::Driver(const Plug& plug) const {
  const auto it = drivers.find(plug);
  return it == drivers.end() ? nullptr : &it->second;
}

double NaiveTwin::Number(const Plug& plug) {
  if (IsOutput(plug)) {
    if (plug.component >= 0) return Vector({plug.node, plug.attribute, plug.element, -1})[plug.component];
    return std::get<double>(Output(plug));
  }
  const bool is_bool = plug.attribute == "which";
  double value = plug.attribute == "factor" || plug.attribute == "step" ? 1
                 : plug.attribute == "floor"                            ? -1e30
                                                                        : 0;
  const Plug whole{plug.node, plug.attribute, plug.element, -1};
  if (const Plug* driver = Driver(plug)) {
    value = Number(*driver);
  } else if (const Plug* driver_of_whole = plug.component >= 0 ? Driver(whole) : nullptr) {
    value = Vector(*driver_of_whole)[plug.component];
  } else if (const auto it = held.find(plug); it != held.end()) {
    value = std::get<double>(it->second);
  } else if (const auto set = held.find(whole); plug.component >= 0 && set != held.end()) {
    value = std::get<Double3>(set->second)[plug.component];
  }
  return is_bool ? (value != 0 ? 1 : 0) : value;
}

Double3 NaiveTwin::Vector(const Plug& plug) {
  if (IsOutput(plug)) return std::get<Double3>(Output(plug));
  if (const Plug* driver = Driver(plug)) return Vector(*driver);
  Double3 v;
  for (int c = 0; c < 3; ++c) v[c] = Number({plug.node, plug.attribute, plug.element, c});
  return v;
}

NaiveTwin::Points NaiveTwin::AllPoints(const Plug& plug) {
  if (IsOutput(plug)) return std::get<Points>(Output(plug));
  if (const Plug* driver = Driver(plug)) return AllPoints(*driver);
  const auto it = held.find(plug);
  Points points = it == held.end() ? Points() : std::get<Points>(it->second);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Plug point{plug.node, plug.attribute, static_cast<int>(i), -1};
    if (const auto set = held.find(point); set != held.end()) points[i] = std::get<Double3>(set->second);
    if (const Plug* driver = Driver(point)) points[i] = Vector(*driver);
    for (int c = 0; c < 3; ++c) {
      const Plug child{plug.node, plug.attribute, static_cast<int>(i), c};
      if (Driver(point) == nullptr && (held.count(child) != 0 || Driver(child) != nullptr))
        points[i][c] = Number(child);
      points[i][c] = AsFloat(points[i][c]);
    }
  }
  return points;
}

NaiveTwin::Held NaiveTwin::Output(const Plug& plug) {
  if (const auto it = memo_.find(plug); it != memo_.end()) return it->second;
  const auto in = [&](const char* attribute, int element = -1) {
    return Plug{plug.node, attribute, element, -1};
  };
  const std::string& type = types.at(plug.node);
  Held result = 0.0;
  if (type == "add") {
    result = Number(in("a")) + Number(in("b"));
  } else if (type == "floor") {
    result = std::floor(Number(in("input")));
  } else if (type == "scale3") {
    result = Vector(in("input")) * Number(in("factor"));
  } else if (type == "sum") {
    int size = 0;
    for (const auto& [p, value] : held) size = p.node == plug.node ? std::max(size, p.element + 1) : size;
    for (const auto& [p, value] : drivers) size = p.node == plug.node ? std::max(size, p.element + 1) : size;
    double sum = 0;
    for (int e = 0; e < size; ++e) sum += Number(in("input", e));
    result = sum;
  } else if (type == "select") {
    result = Number(in(Number(in("which")) != 0 ? "b" : "a"));
  } else if (type == "source") {
    Points points(static_cast<std::size_t>(Number(in("count"))));
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i].x = AsFloat(static_cast<double>(i) * Number(in("step")));
    result = points;
  } else if (type == "move") {
    Points points = AllPoints(in("points"));
    const auto offset = static_cast<float>(Number(in("offset")));
    for (Double3& p : points) p.x = static_cast<float>(p.x) + offset;
    result = points;
  } else if (type == "smooth") {
    const Points points = AllPoints(in("points"));
    const int n = static_cast<int>(points.size()), rings = static_cast<int>(Number(in("rings")));
    Points means(points.size());
    for (int i = 0; i < n; ++i) {
      float x = 0;
      for (int d = -rings; d <= rings; ++d)
        x += static_cast<float>(points[static_cast<std::size_t>(((i + d) % n + n) % n)].x);
      means[static_cast<std::size_t>(i)].x = x / static_cast<float>(2 * rings + 1);
    }
    result = means;
  } else if (type == "measure") {
    double sum = 0;
    for (const Double3& p : AllPoints(in("points"))) sum += p.x;
    result = sum;
  } else if (type == "cached") {  // its cues are the points 1 and 3
    const Points cues = AllPoints(in("cuePoints"));
    const double sum = 0.0 + cues[1].x + cues[3].x;  // -0 becomes 0
    const double mean = AsFloat(sum / 2);
    Points points(cues.size(), Double3{mean, 0, 0});
    if (sum >= Number(in("threshold"))) {
      points = AllPoints(in("full"));
      for (Double3& p : points) p.y = p.z = 0;
    }
    result = points;
  }
  memo_[plug] = result;
  return result;
}

}  // namespace kpsa::engine
