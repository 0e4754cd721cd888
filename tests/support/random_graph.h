// A random graph of toy nodes beside its naive twin: both are edited alike, and agree about what is refused.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "graph/graph.h"
#include "tests/support/choices.h"
#include "tests/support/naive_twin.h"

namespace kpsa::engine {

enum class ToyKind { kNumber, kVector, kMatrix, kPoints };

struct ToyAttribute {
  const char* name;
  ToyKind kind;
  bool structural = false, array = false;
};
struct ToyType {
  const char* name;
  std::vector<ToyAttribute> inputs;
  const char* output;
  ToyKind kind;
};
// The types of random graphs; what there are to be more of is there several times.
const std::vector<ToyType>& RandomToyTypes();
inline constexpr Index kToyPoints = 24;

class RandomGraph {
 public:
  using Plug = NaiveTwin::Plug;
  // `disguises`: types that are another one in the engine than in the twin, for showing that it is noticed.
  explicit RandomGraph(const NodeRegistry& registry, Choices choices,
                       std::map<std::string, std::string> disguises = {})
      : graph(registry), choices(choices), disguises_(std::move(disguises)) {}

  void AddNode();
  void Edit();  // adds, removes, connects, disconnects or sets something
  // On both sides.
  void Set(const Plug& plug, const NaiveTwin::Held& value);
  PlugRef Ref(const Plug& plug);
  const ToyType& TypeOf(std::size_t node) const { return RandomToyTypes()[nodes[node].second]; }

  double RandomNumber();
  Double3 RandomVector();
  Matrix4 RandomMatrix();
  NaiveTwin::Points RandomPoints();
  // Of an attribute of that kind.
  NaiveTwin::Held RandomValue(const std::string& attribute, ToyKind kind);

  // The first thing that both sides do not agree about; "" while there is none.
  const std::string& fault() const { return fault_; }
  void Report(std::string text) {
    if (fault_.empty()) fault_ = std::move(text);
  }

  Graph graph;
  NaiveTwin twin;
  std::vector<std::pair<std::string, std::size_t>> nodes;  // name, type
  Choices choices;

 private:
  void Connect(std::size_t node, bool replace);
  bool PickSource(ToyKind kind, Plug* plug);
  bool PickInput(std::size_t node, Plug* plug, ToyKind* kind);
  std::size_t AnyNode() { return static_cast<std::size_t>(choices.Pick(static_cast<int>(nodes.size()))); }
  const ToyAttribute& AnyInput(const ToyType& type) {
    return type.inputs[static_cast<std::size_t>(choices.Pick(static_cast<int>(type.inputs.size())))];
  }
  void Check(const Status& status, const std::string& what) {
    if (!status.ok()) Report(what + ": " + status.ToString());
  }

  std::map<std::string, std::string> disguises_;
  int next_ = 0, failing_ = 0;
  std::string fault_;
};

}  // namespace kpsa::engine
