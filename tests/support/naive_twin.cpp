#include "tests/support/naive_twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "graph/builtin_steps.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

bool Overlap(const NaiveTwin::Plug& a, const NaiveTwin::Plug& b) {
  return a.node == b.node && a.attribute == b.attribute &&
         (a.element == b.element || a.element < 0 || b.element < 0) &&
         (a.component == b.component || a.component < 0 || b.component < 0);
}

double AsFloat(double v) { return static_cast<float>(v); }

double Default(const std::string& attribute) {
  if (attribute == "factor" || attribute == "step") return 1;
  return attribute == "floor" ? -1e30 : 0;
}

// Numbers become whole, or true and false, where the attribute is.
double AsAttribute(const std::string& attribute, double v) {
  if (attribute == "which" || attribute == "wanted") return v != 0 ? 1 : 0;
  return attribute == "selector" ? static_cast<double>(WholeNumber(v)) : v;
}

}  // namespace

std::string NaiveTwin::Plug::Name() const {
  std::string name = fmt::format("{}.{}", node, attribute);
  if (element >= 0) name += fmt::format("[{}]", element);
  if (component >= 0) name += fmt::format(".{}", "xyz"[component]);
  return name;
}

void NaiveTwin::Add(const std::string& name, const std::string& type) {
  types[name] = type;
  if (type == "fail" || type == "cached")
    failure_bits_[name] = std::min(static_cast<int>(failure_bits_.size()), 63);
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
  for (auto it = drivers.lower_bound({plug.node, "", -1, -1});
       it != drivers.end() && it->first.node == plug.node; ++it) {
    if ((IsOutput(plug) || Overlap(it->first, plug)) && Depends(it->second, target, seen)) return true;
  }
  return false;
}

NaiveTwin::Leaves NaiveTwin::Cone(const std::string& node, const std::vector<Plug>& leaves,
                                  std::map<Plug, Leaves>* memo) const {
  return Reached({node, "out"}, leaves, memo);
}

NaiveTwin::Leaves NaiveTwin::Reached(const Plug& plug, const std::vector<Plug>& leaves,
                                     std::map<Plug, Leaves>* memo) const {
  if (const auto it = memo->find(plug); it != memo->end()) return it->second;
  const bool all = IsOutput(plug);
  Leaves reached;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (all ? leaves[i].node == plug.node : Overlap(leaves[i], plug)) reached.set(i);
  }
  for (auto it = drivers.lower_bound({plug.node, "", -1, -1});
       it != drivers.end() && it->first.node == plug.node; ++it) {
    if (all || Overlap(it->first, plug)) reached |= Reached(it->second, leaves, memo);
  }
  return (*memo)[plug] = reached;
}

void NaiveTwin::Begin(bool eager) {
  memo_.clear();
  computed_.clear();
  failed_ = 0;
  eager_ = eager;
}

bool NaiveTwin::Failed(const std::string& node, Failures among) const {
  const auto it = failure_bits_.find(node);
  return it != failure_bits_.end() && (among >> it->second & 1) != 0;
}

NaiveTwin::Failures NaiveTwin::Fail(const std::string& node) {
  const Failures bit = Failures{1} << failure_bits_.at(node);
  failed_ |= bit;
  return bit;
}

const NaiveTwin::Plug* NaiveTwin::Driver(const Plug& plug) const {
  const auto it = drivers.find(plug);
  return it == drivers.end() ? nullptr : &it->second;
}

NaiveTwin::With<double> NaiveTwin::Number(const Plug& plug) {
  if (IsOutput(plug)) {
    if (plug.component < 0) {
      const Result& output = Output(plug);
      return {std::get<double>(output.value), output.lacks};
    }
    const With<Double3> v = Vector({plug.node, plug.attribute, plug.element, -1});
    return {v.value[plug.component], v.lacks};
  }
  With<double> number{Default(plug.attribute), 0};
  const Plug whole{plug.node, plug.attribute, plug.element, -1};
  if (const Plug* driver = Driver(plug)) {
    number = Number(*driver);
  } else if (const Plug* driver_of_whole = plug.component >= 0 ? Driver(whole) : nullptr) {
    const With<Double3> v = Vector(*driver_of_whole);
    number = {v.value[plug.component], v.lacks};
  } else if (const auto it = held.find(plug); it != held.end()) {
    number.value = std::get<double>(it->second);
  } else if (const auto set = held.find(whole); plug.component >= 0 && set != held.end()) {
    number.value = std::get<Double3>(set->second)[plug.component];
  }
  number.value = AsAttribute(plug.attribute, number.value);
  return number;
}

NaiveTwin::With<Double3> NaiveTwin::Vector(const Plug& plug) {
  if (IsOutput(plug)) {
    const Result& output = Output(plug);
    return {std::get<Double3>(output.value), output.lacks};
  }
  if (const Plug* driver = Driver(plug)) return Vector(*driver);
  With<Double3> v;
  for (int c = 0; c < 3; ++c) {
    const With<double> number = Number({plug.node, plug.attribute, plug.element, c});
    v.value[c] = number.value;
    v.lacks |= number.lacks;
  }
  return v;
}

NaiveTwin::With<Matrix4> NaiveTwin::Matrix(const Plug& plug) {
  if (IsOutput(plug)) {
    const Result& output = Output(plug);
    return {std::get<Matrix4>(output.value), output.lacks};
  }
  if (const Plug* driver = Driver(plug)) return Matrix(*driver);
  const auto it = held.find(plug);
  return {it == held.end() ? Matrix4() : std::get<Matrix4>(it->second), 0};
}

NaiveTwin::Points NaiveTwin::AllPoints(const Plug& plug) {
  if (IsOutput(plug)) return std::get<Points>(Output(plug).value);
  if (const Plug* driver = Driver(plug)) return AllPoints(*driver);
  const auto it = held.find(plug);
  Points points = it == held.end() ? Points() : std::get<Points>(it->second);
  // Points and components that are set or driven by themselves
  std::set<int> parts;
  const Plug first{plug.node, plug.attribute, 0, -1};
  const auto is_part = [&](const Plug& p) { return p.node == plug.node && p.attribute == plug.attribute; };
  for (auto h = held.lower_bound(first); h != held.end() && is_part(h->first); ++h)
    parts.insert(h->first.element);
  for (auto d = drivers.lower_bound(first); d != drivers.end() && is_part(d->first); ++d)
    parts.insert(d->first.element);
  for (const int part : parts) {
    With<Double3>& to = points.at(static_cast<std::size_t>(part));
    const Plug point{plug.node, plug.attribute, part, -1};
    if (const auto set = held.find(point); set != held.end()) to.value = std::get<Double3>(set->second);
    if (const Plug* driver = Driver(point)) to = Vector(*driver);
    for (int c = 0; c < 3 && Driver(point) == nullptr; ++c) {
      const Plug child{plug.node, plug.attribute, part, c};
      if (held.count(child) == 0 && Driver(child) == nullptr) continue;
      const With<double> number = Number(child);
      to.value[c] = number.value;
      to.lacks |= number.lacks;
    }
    for (int c = 0; c < 3; ++c) to.value[c] = AsFloat(to.value[c]);
  }
  return points;
}

int NaiveTwin::ArraySize(const std::string& node, const char* attribute) const {
  int size = 0;
  const auto see = [&](const auto& plugs) {
    for (auto it = plugs.lower_bound({node, attribute, -1, -1});
         it != plugs.end() && it->first.node == node && it->first.attribute == attribute; ++it)
      size = std::max(size, it->first.element + 1);
  };
  see(held);
  see(drivers);
  return size;
}

const NaiveTwin::Result& NaiveTwin::Output(const Plug& plug) {
  if (const auto it = memo_.find(plug.node); it != memo_.end()) return it->second;
  computed_.insert(plug.node);
  const std::string& type = types.at(plug.node);
  Result result = plug.attribute == "outPoints" ? ComputePoints(plug.node, type) : Compute(plug.node, type);
  return memo_[plug.node] = std::move(result);
}

NaiveTwin::Result NaiveTwin::Compute(const std::string& node, const std::string& type) {
  Failures lacks = 0;
  const auto number = [&](const char* attribute, int element = -1) {
    const With<double> n = Number({node, attribute, element, -1});
    lacks |= n.lacks;
    return n.value;
  };
  const auto sum = [&](const char* attribute, int only = -1) {
    double all = 0;
    const int size = ArraySize(node, attribute);
    for (int e = 0; e < size; ++e) {
      if (only < 0 || only == e || eager_) {
        const double n = number(attribute, e);
        if (only < 0) {
          all += n;
        } else if (only == e) {
          all = n;
        }
      }
    }
    return all;
  };
  Held value = 0.0;
  if (type == "add") {
    value = number("a") + number("b");
  } else if (type == "floor") {
    value = std::floor(number("input"));
  } else if (type == "peek") {
    value = number("input") + hidden;
  } else if (type == "scale3") {
    const With<Double3> input = Vector({node, "input"});
    lacks |= input.lacks;
    value = input.value * number("factor");
  } else if (type == "sum") {
    value = sum("input");
  } else if (type == "select") {
    const bool second = number("which") != 0;
    value = number(second ? "b" : "a");
    if (eager_) number(second ? "a" : "b");
  } else if (type == "choice") {
    const double selector = number("selector");
    const bool chooses = selector >= 0 && selector <= kMostChoices;
    value = chooses || eager_ ? sum("input", chooses ? static_cast<int>(selector) : kMostChoices + 1) : 0.0;
  } else if (type == "together") {
    const bool wanted = number("wanted") != 0;
    value = wanted ? sum("input") : number("other");
    if (eager_ && wanted) number("other");
    if (eager_ && !wanted) sum("input");
  } else if (type == "fail") {
    const double input = number("input");
    value = input;
    if (lacks == 0 && input < 0) lacks |= Fail(node);
  } else if (type == "measure") {
    double all = 0;
    for (const With<Double3>& p : AllPoints({node, "points"})) {
      all += p.value.x;
      lacks |= p.lacks;
    }
    value = all;
  } else if (type == "shift") {
    const With<Double3> offset = Vector({node, "offset"});
    lacks |= offset.lacks;
    value = Translation(offset.value);
  } else if (type == "chain") {
    Matrix4 all;
    const int size = ArraySize(node, "matrix");
    for (int e = 0; e < size; ++e) {
      const With<Matrix4> m = Matrix({node, "matrix", e, -1});
      lacks |= m.lacks;
      all = all * m.value;
    }
    value = all;
  } else if (type == "carry") {
    const With<Matrix4> m = Matrix({node, "matrix"});
    const With<Double3> point = Vector({node, "point"});
    lacks |= m.lacks | point.lacks;
    value = TransformPoint(m.value, point.value);
  }
  return {value, lacks};
}

NaiveTwin::Result NaiveTwin::ComputePoints(const std::string& node, const std::string& type) {
  const auto number = [&](const char* attribute) { return Number({node, attribute, -1, -1}); };
  Points points;
  if (type != "source" && type != "cached") points = AllPoints({node, "points"});
  if (type == "source") {
    points.resize(static_cast<std::size_t>(number("count").value));
    const With<double> step = number("step");
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = {{AsFloat(static_cast<double>(i) * step.value), 0, 0}, step.lacks};
  } else if (type == "move") {
    const With<double> offset = number("offset");
    for (With<Double3>& p : points) {
      p.value.x = static_cast<float>(p.value.x) + static_cast<float>(offset.value);
      p.lacks |= offset.lacks;
    }
  } else if (type == "raise") {
    const With<double> by = number("by");
    for (auto i = static_cast<std::size_t>(number("first").value); i < points.size(); ++i) {
      if (by.value != 0)
        points[i].value.y = static_cast<float>(points[i].value.y) + static_cast<float>(by.value);
      points[i].lacks |= by.lacks;
    }
  } else if (type == "carryPoints") {
    const With<Matrix4> m = Matrix({node, "matrix"});
    for (With<Double3>& p : points) {
      p.value = TransformPoint(m.value, p.value);
      for (int c = 0; c < 3; ++c) p.value[c] = AsFloat(p.value[c]);
      p.lacks |= m.lacks;
    }
  } else if (type == "smooth") {
    const Points from = points;
    const int n = static_cast<int>(from.size()), rings = static_cast<int>(number("rings").value);
    for (int i = 0; i < n; ++i) {
      With<Double3>& mean = points[static_cast<std::size_t>(i)];
      float x = 0;
      for (int d = -rings; d <= rings; ++d) {
        const With<Double3>& p = from[static_cast<std::size_t>(((i + d) % n + n) % n)];
        x += static_cast<float>(p.value.x);
        mean.lacks |= p.lacks;
      }
      mean.value = {x / static_cast<float>(2 * rings + 1), 0, 0};
    }
  } else {  // "cached": its cues are the points 1 and 3
    const Points cues = AllPoints({node, "cuePoints"});
    const With<double> threshold = number("threshold"), floor = number("floor");
    const double sum = 0.0 + cues[1].value.x + cues[3].value.x;  // -0 becomes 0
    const bool miss = !(sum < threshold.value);
    Failures lacks = cues[1].lacks | cues[3].lacks | threshold.lacks | floor.lacks;
    points.assign(cues.size(), {Double3{AsFloat(sum / 2), 0, 0}, 0});
    if (miss || eager_) {
      const Points full = AllPoints({node, "full"});
      for (std::size_t i = 0; i < points.size(); ++i) {
        points[i].lacks |= full[i].lacks;
        if (miss) points[i].value = {full[i].value.x, 0, 0};
      }
    }
    if (lacks == 0 && sum / 2 < floor.value) lacks |= Fail(node);
    for (With<Double3>& p : points) p.lacks |= lacks;
  }
  return {std::move(points), 0};
}

}  // namespace kpsa::engine
