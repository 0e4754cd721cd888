// A graph of toy nodes evaluated in the most naive way: by name, from the wanted plug backward, recursively,
// without caches between evaluations, without plans or point sets. What the engine has to agree with, bit by
// bit.
#pragma once

#include <map>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

class NaiveTwin {
 public:
  struct Plug {
    std::string node, attribute;
    int element = -1, component = -1;
    friend auto operator<=>(const Plug& a, const Plug& b) {
      return std::tie(a.node, a.attribute, a.element, a.component) <=>
             std::tie(b.node, b.attribute, b.element, b.component);
    }
    friend bool operator==(const Plug& a, const Plug& b) { return (a <=> b) == 0; }
    std::string Name() const;
  };
  using Points = std::vector<Double3>;  // floats, as double
  using Held = std::variant<double, Double3, Points>;

  void Add(const std::string& name, const std::string& type) { types[name] = type; }
  void Remove(const std::string& name);
  void Set(const Plug& plug, Held value);
  // Whether the engine has to refuse: the destination or a part of it is driven (by anything but itself if
  // `replace`).
  bool Overlaps(const Plug& destination, bool replace) const;
  // Whether the value of `plug` depends on `target`.
  bool DependsOn(const Plug& plug, const Plug& target) const;

  void Begin() { memo_.clear(); }  // values of one evaluation are shared within it
  double Number(const Plug& plug);
  Double3 Vector(const Plug& plug);
  Points AllPoints(const Plug& plug);

  std::map<std::string, std::string> types;  // by node
  std::map<Plug, Held> held;
  std::map<Plug, Plug> drivers;  // by destination

 private:
  const Plug* Driver(const Plug& plug) const;
  Held Output(const Plug& plug);
  bool IsOutput(const Plug& plug) const { return plug.attribute.rfind("out", 0) == 0; }
  bool Depends(const Plug& plug, const Plug& target, std::map<Plug, bool>* seen) const;

  std::map<Plug, Held> memo_;
};

}  // namespace kpsa::engine
