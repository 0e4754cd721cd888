// A graph of toy nodes evaluated in the most naive way: by name, from the wanted plug backward, recursively,
// without caches between evaluations, without plans or point sets. What the engine has to agree with, bit by
// bit.
//
// A node that fails has no value, nor has what reads it. The twin goes on with 0 and remembers who failed: every
// value comes with the nodes that it lacks, of points each point.
#pragma once

#include <bitset>
#include <cstdint>
#include <map>
#include <set>
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
  using Failures = std::uint64_t;  // a bit for each node that failed
  template <typename T>
  struct With {
    T value{};
    Failures lacks = 0;
    friend bool operator==(const With&, const With&) = default;
  };
  using Points = std::vector<With<Double3>>;  // floats, as double
  using Held = std::variant<double, Double3, Matrix4, Points>;
  static constexpr std::size_t kMostLeaves = 256;
  using Leaves = std::bitset<kMostLeaves>;  // of the list of plugs that Cone was given

  void Add(const std::string& name, const std::string& type);
  void Remove(const std::string& name);
  void Set(const Plug& plug, Held value);
  // Whether the engine has to refuse: the destination or a part of it is driven (by anything but itself if
  // `replace`).
  bool Overlaps(const Plug& destination, bool replace) const;
  // Whether the value of `plug` depends on `target`.
  bool DependsOn(const Plug& plug, const Plug& target) const;
  // Which of `leaves` a node's outputs depend on, whatever is chosen.
  Leaves Cone(const std::string& node, const std::vector<Plug>& leaves, std::map<Plug, Leaves>* memo) const;

  // Begins an evaluation: values are shared within it. An eager one reads all lazy inputs, as what is evaluated
  // while compiling.
  void Begin(bool eager = false);
  With<double> Number(const Plug& plug);
  With<Double3> Vector(const Plug& plug);
  With<Matrix4> Matrix(const Plug& plug);
  Points AllPoints(const Plug& plug);
  // Of this evaluation: nodes that were computed, and those of them that failed.
  const std::set<std::string>& computed() const { return computed_; }
  Failures failed() const { return failed_; }
  bool Failed(const std::string& node, Failures among) const;

  std::map<std::string, std::string> types;  // by node
  std::map<Plug, Held> held;
  std::map<Plug, Plug> drivers;  // by destination
  double hidden = 0;             // what "peek" reads without saying so

 private:
  struct Result {
    Held value;
    Failures lacks = 0;  // of points: of all of them, beside what each lacks
  };
  const Plug* Driver(const Plug& plug) const;
  const Result& Output(const Plug& plug);
  Result Compute(const std::string& node, const std::string& type);
  Result ComputePoints(const std::string& node, const std::string& type);
  Failures Fail(const std::string& node);
  int ArraySize(const std::string& node, const char* attribute) const;
  static bool IsOutput(const Plug& plug) { return plug.attribute.rfind("out", 0) == 0; }
  bool Depends(const Plug& plug, const Plug& target, std::map<Plug, bool>* seen) const;
  Leaves Reached(const Plug& plug, const std::vector<Plug>& leaves, std::map<Plug, Leaves>* memo) const;

  std::map<std::string, int> failure_bits_;
  std::map<std::string, Result> memo_;  // by node: each has one output
  std::set<std::string> computed_;
  Failures failed_ = 0;
  bool eager_ = false;
};

}  // namespace kpsa::engine
