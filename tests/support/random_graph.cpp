#include "tests/support/random_graph.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "base/matrix.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

constexpr int kMostFailing = 60;  // of all nodes that may fail: the twin has a bit for each

bool MayFail(const ToyType& type) {
  return std::string_view(type.name) == "fail" || std::string_view(type.name) == "cached";
}

}  // namespace

const std::vector<ToyType>& RandomToyTypes() {
  constexpr ToyKind kNumber = ToyKind::kNumber, kVector = ToyKind::kVector, kMatrix = ToyKind::kMatrix,
                    kPoints = ToyKind::kPoints;
  static const std::vector<ToyType> types = [] {
    const ToyType select{"select", {{"which", kNumber}, {"a", kNumber}, {"b", kNumber}}, "out", kNumber};
    const ToyType move{"move", {{"points", kPoints}, {"offset", kNumber}}, "outPoints", kPoints};
    const ToyType raise{
        "raise", {{"first", kNumber, true}, {"points", kPoints}, {"by", kNumber}}, "outPoints", kPoints};
    return std::vector<ToyType>{
        {"add", {{"a", kNumber}, {"b", kNumber}}, "out", kNumber},
        {"floor", {{"input", kNumber}}, "out", kNumber},
        {"scale3", {{"input", kVector}, {"factor", kNumber}}, "out", kVector},
        {"sum", {{"input", kNumber, false, true}}, "out", kNumber},
        select,
        select,
        {"choice", {{"selector", kNumber}, {"input", kNumber, false, true}}, "out", kNumber},
        {"together",
         {{"wanted", kNumber}, {"input", kNumber, false, true}, {"other", kNumber}},
         "out",
         kNumber},
        {"fail", {{"input", kNumber}}, "out", kNumber},
        {"shift", {{"offset", kVector}}, "out", kMatrix},
        {"chain", {{"matrix", kMatrix, false, true}}, "out", kMatrix},
        {"carry", {{"matrix", kMatrix}, {"point", kVector}}, "out", kVector},
        {"carryPoints", {{"points", kPoints}, {"matrix", kMatrix}}, "outPoints", kPoints},
        {"source", {{"count", kNumber, true}, {"step", kNumber}}, "outPoints", kPoints},
        move,
        move,
        raise,
        raise,
        {"smooth", {{"rings", kNumber, true}, {"points", kPoints}}, "outPoints", kPoints},
        {"measure", {{"points", kPoints}}, "out", kNumber},
        {"cached",
         {{"threshold", kNumber}, {"floor", kNumber}, {"cuePoints", kPoints}, {"full", kPoints}},
         "outPoints",
         kPoints}};
  }();
  return types;
}

double RandomGraph::RandomNumber() {
  return choices.Pick(5) == 0 ? 0 : static_cast<double>(choices.Pick(4000)) / 64 - 30;
}
Double3 RandomGraph::RandomVector() { return {RandomNumber(), RandomNumber(), RandomNumber()}; }
Matrix4 RandomGraph::RandomMatrix() {
  const double scale = choices.Chance(30) ? 0.5 : 1;
  return Translation(RandomVector()) * Scaling({scale, 1, -scale});
}
NaiveTwin::Points RandomGraph::RandomPoints() {
  NaiveTwin::Points points(kToyPoints);
  for (auto& p : points) p.value = RandomVector();
  return points;
}

NaiveTwin::Held RandomGraph::RandomValue(const std::string& attribute, ToyKind kind) {
  if (kind == ToyKind::kPoints) return RandomPoints();
  if (kind == ToyKind::kMatrix) return RandomMatrix();
  if (kind == ToyKind::kVector) return RandomVector();
  if (attribute == "selector") return static_cast<double>(choices.Pick(6) - 1);
  double number = RandomNumber();
  if (attribute == "by" && choices.Chance(40)) return 0.0;
  if (attribute == "input" && number < 0 && choices.Chance(2))
    return kThrows;  // a sum, or a node that throws
  // Most nodes that may fail do not
  if (attribute == "floor" && !choices.Chance(20)) number -= 1e6;
  return number;
}

PlugRef RandomGraph::Ref(const Plug& plug) {
  const kpsa::engine::Result<PlugRef> found = graph.FindPlug(plug.Name());
  Check(found.status(), plug.Name());
  return found.ok() ? *found : PlugRef();
}

void RandomGraph::Set(const Plug& plug, const NaiveTwin::Held& value) {
  Value engine;
  if (const auto* number = std::get_if<double>(&value)) {
    engine = Value(*number);
    if (plug.attribute == "which" || plug.attribute == "wanted") engine = Value(*number != 0);
    if (plug.attribute == "count" || plug.attribute == "rings" || plug.attribute == "selector" ||
        plug.attribute == "first")
      engine = Value(static_cast<std::int64_t>(*number));
  } else if (const auto* vector = std::get_if<Double3>(&value)) {
    engine = Value(*vector);
  } else if (const auto* matrix = std::get_if<Matrix4>(&value)) {
    engine = Value(*matrix);
  } else {
    std::vector<Double3> places;
    for (const auto& p : std::get<NaiveTwin::Points>(value)) places.push_back(p.value);
    engine = Value(PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromPlaces(places))));
  }
  Check(graph.Set(Ref(plug), engine), plug.Name());
  twin.Set(plug, value);
}

void RandomGraph::AddNode() {
  auto t = static_cast<std::size_t>(choices.Pick(static_cast<int>(RandomToyTypes().size())));
  if (MayFail(RandomToyTypes()[t]) && ++failing_ > kMostFailing) t = 0;
  const ToyType& type = RandomToyTypes()[t];
  const std::string name = (choices.Chance(20) ? "odd.name " : "n") + std::to_string(next_++);
  const auto disguise = disguises_.find(type.name);
  Check(graph.AddNode(disguise == disguises_.end() ? type.name : disguise->second, name).status(), name);
  twin.Add(name, disguise != disguises_.end() && disguise->second == "peek" ? "peek" : type.name);
  nodes.emplace_back(name, t);
  if (std::string_view(type.name) == "cached")
    Check(graph.Set(*graph.FindPlug(name + ".cues"), std::vector<std::int64_t>{1, 3}), name);
  if (std::string_view(type.name) == "fail") Set({name, "input"}, choices.Chance(10) ? -1.0 : 3.0);
  for (const ToyAttribute& a : type.inputs) {
    const Plug plug{name, a.name};
    const std::string_view attribute = a.name;
    if (attribute == "count") {
      Set(plug, double{kToyPoints});
    } else if (attribute == "rings") {
      Set(plug, double(1 + choices.Pick(2)));
    } else if (attribute == "first") {
      Set(plug, double(choices.Pick(kToyPoints + 2)));
    } else if (a.kind == ToyKind::kPoints) {
      Set(plug, RandomPoints());
      if (choices.Chance(30)) {
        const double number =
            RandomNumber();  // first: compilers order what an argument list draws as they like
        Set({name, a.name, choices.Pick(kToyPoints), choices.Pick(3)}, number);
      }
    } else if (a.kind == ToyKind::kVector) {
      Set(plug, RandomVector());
      if (choices.Chance(30)) {
        const double number = RandomNumber();
        Set({name, a.name, -1, choices.Pick(3)}, number);
      }
    } else if (choices.Chance(50) && !(attribute == "input" && MayFail(type))) {
      const NaiveTwin::Held value = RandomValue(a.name, a.kind);
      Set({name, a.name, a.array ? choices.Pick(4) : -1}, value);
    }
  }
  for (int i = 0; i < 5; ++i) Connect(nodes.size() - 1, false);
}

// Any plug of the kind: outputs mostly, sometimes an input that is read on.
bool RandomGraph::PickSource(ToyKind kind, Plug* plug) {
  for (int attempt = 0; attempt < 30 && !choices.over(); ++attempt) {
    const std::size_t node = AnyNode();
    const std::string& name = nodes[node].first;
    const ToyType& type = TypeOf(node);
    *plug = {name, type.output};
    ToyKind found = type.kind;
    if (choices.Chance(15)) {
      const ToyAttribute& a = AnyInput(type);
      if (a.structural) continue;
      *plug = {name, a.name, a.array ? choices.Pick(4) : -1};
      found = a.kind;
    }
    if (found == ToyKind::kVector && kind == ToyKind::kNumber) {
      plug->component = choices.Pick(3);
      found = ToyKind::kNumber;
    }
    if (found == kind) return true;
  }
  return false;
}

bool RandomGraph::PickInput(std::size_t node, Plug* plug, ToyKind* kind) {
  const ToyAttribute& a = AnyInput(TypeOf(node));
  if (a.structural) return false;
  *plug = {nodes[node].first, a.name, a.array ? choices.Pick(4) : -1};
  *kind = a.kind;
  if (a.kind == ToyKind::kPoints && choices.Chance(25)) {
    plug->element = choices.Pick(kToyPoints);
    *kind = ToyKind::kVector;
  }
  if (*kind == ToyKind::kVector && choices.Chance(50)) {
    plug->component = choices.Pick(3);
    *kind = ToyKind::kNumber;
  }
  return true;
}

// Both sides agree about what is refused, and about why.
void RandomGraph::Connect(std::size_t node, bool replace) {
  Plug from, to;
  ToyKind kind;
  if (!PickInput(node, &to, &kind) || !PickSource(kind, &from)) return;
  const auto replaced = twin.drivers.find(to);
  const bool overlaps = twin.Overlaps(to, replace);
  std::optional<Plug> before;
  if (!overlaps && replaced != twin.drivers.end()) before = replaced->second;
  if (before) twin.drivers.erase(to);
  const bool cycle = !overlaps && twin.DependsOn(from, to);
  const Status status = graph.Connect(Ref(from), Ref(to), replace);
  const bool names_cycle = status.ToString().find("cycle") != std::string::npos;
  if (status.ok() != (!overlaps && !cycle) || names_cycle != cycle)
    Report(fmt::format("{} -> {}: {}; expected {}", from.Name(), to.Name(), status.ToString(),
                       cycle      ? "a cycle"
                       : overlaps ? "two drivers of one plug"
                                  : "a connection"));
  if (status.ok()) {
    twin.drivers[to] = from;
  } else if (before) {
    twin.drivers[to] = *before;
  }
}

void RandomGraph::Edit() {
  const int what = choices.Pick(10);
  const std::size_t node = AnyNode();
  if (what < 2) return AddNode();
  if (what < 3 && nodes.size() > 10) {
    const std::string name = nodes[node].first;
    Check(graph.RemoveNode(*graph.FindNode(name)), name);
    twin.Remove(name);
    nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(node));
  } else if (what < 5 && !twin.drivers.empty()) {
    auto it = twin.drivers.begin();
    std::advance(it, choices.Pick(static_cast<int>(twin.drivers.size())));
    Check(graph.Disconnect(Ref(it->first)), it->first.Name());
    twin.drivers.erase(it);
  } else if (what < 8) {
    Connect(node, choices.Chance(70));
  } else {
    Plug plug;
    ToyKind kind;
    if (PickInput(node, &plug, &kind) && kind != ToyKind::kPoints)
      Set(plug, RandomValue(plug.attribute, kind));
  }
}

}  // namespace kpsa::engine
