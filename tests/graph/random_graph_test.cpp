// Random graphs, random edits, random sets and pulls: the engine against a naive twin, serial against
// parallel.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "base/parallel.h"
#include "tests/support/naive_twin.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

using Plug = NaiveTwin::Plug;
constexpr int kPoints = 24;

enum class Kind { kNumber, kVector, kPoints };

struct Attribute {
  const char* name;
  Kind kind;
  bool structural = false, array = false;
};
struct ToyType {
  const char* name;
  std::vector<Attribute> inputs;
  const char* output;
  Kind kind;
};
const std::vector<ToyType>& ToyTypes() {
  static const std::vector<ToyType> types = {
      {"add", {{"a", Kind::kNumber}, {"b", Kind::kNumber}}, "out", Kind::kNumber},
      {"floor", {{"input", Kind::kNumber}}, "out", Kind::kNumber},
      {"scale3", {{"input", Kind::kVector}, {"factor", Kind::kNumber}}, "out", Kind::kVector},
      {"sum", {{"input", Kind::kNumber, false, true}}, "out", Kind::kNumber},
      {"select",
       {{"which", Kind::kNumber}, {"a", Kind::kNumber}, {"b", Kind::kNumber}},
       "out",
       Kind::kNumber},
      {"select",
       {{"which", Kind::kNumber}, {"a", Kind::kNumber}, {"b", Kind::kNumber}},
       "out",
       Kind::kNumber},
      {"source", {{"count", Kind::kNumber, true}, {"step", Kind::kNumber}}, "outPoints", Kind::kPoints},
      {"move", {{"points", Kind::kPoints}, {"offset", Kind::kNumber}}, "outPoints", Kind::kPoints},
      {"move", {{"points", Kind::kPoints}, {"offset", Kind::kNumber}}, "outPoints", Kind::kPoints},
      {"move", {{"points", Kind::kPoints}, {"offset", Kind::kNumber}}, "outPoints", Kind::kPoints},
      {"smooth", {{"rings", Kind::kNumber, true}, {"points", Kind::kPoints}}, "outPoints", Kind::kPoints},
      {"measure", {{"points", Kind::kPoints}}, "out", Kind::kNumber},
      {"cached",
       {{"threshold", Kind::kNumber}, {"cuePoints", Kind::kPoints}, {"full", Kind::kPoints}},
       "outPoints",
       Kind::kPoints},
  };
  return types;
}

class RandomGraph {
 public:
  explicit RandomGraph(unsigned seed) : graph(ToyRegistry()), random_(seed) {}

  int Pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  bool Chance(int percent) { return Pick(100) < percent; }
  double Value() { return Pick(5) == 0 ? 0 : static_cast<double>(Pick(4000)) / 64 - 30; }
  Double3 Vector() { return {Value(), Value(), Value()}; }

  PlugRef Ref(const Plug& plug) {
    const Result<PlugRef> found = graph.FindPlug(plug.Name());
    EXPECT_TRUE(found.ok()) << found.status().ToString();
    return *found;
  }
  void Set(const Plug& plug, const NaiveTwin::Held& value) {
    kpsa::engine::Value engine;
    if (plug.attribute == "which") {
      engine = kpsa::engine::Value(std::get<double>(value) != 0);
    } else if (plug.attribute == "count" || plug.attribute == "rings") {
      engine = kpsa::engine::Value(static_cast<std::int64_t>(std::get<double>(value)));
    } else if (const auto* number = std::get_if<double>(&value)) {
      engine = kpsa::engine::Value(*number);
    } else if (const auto* vector = std::get_if<Double3>(&value)) {
      engine = kpsa::engine::Value(*vector);
    } else {
      std::vector<float> xyz;
      for (const Double3& p : std::get<NaiveTwin::Points>(value)) {
        for (int c = 0; c < 3; ++c) xyz.push_back(static_cast<float>(p[c]));
      }
      engine = kpsa::engine::Value(
          PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(xyz))));
    }
    const Status status = graph.Set(Ref(plug), engine);
    EXPECT_TRUE(status.ok()) << status.ToString();
    twin.Set(plug, value);
  }

  void AddNode() {
    const int t = Pick(static_cast<int>(ToyTypes().size()));
    const ToyType& type = ToyTypes()[static_cast<std::size_t>(t)];
    const std::string name = (Chance(20) ? "odd.name " : "n") + std::to_string(next_++);
    ASSERT_TRUE(graph.AddNode(type.name, name).ok());
    twin.Add(name, type.name);
    nodes.emplace_back(name, t);
    if (std::string(type.name) == "cached") {
      ASSERT_TRUE(graph.Set(*graph.FindPlug(name + ".cues"), std::vector<std::int64_t>{1, 3}).ok());
    }
    for (const Attribute& a : type.inputs) {
      const Plug plug{name, a.name};
      if (a.structural) {
        Set(plug, std::string(a.name) == "count" ? double{kPoints} : double(1 + Pick(2)));
      } else if (a.kind == Kind::kPoints) {
        NaiveTwin::Points points(kPoints);
        for (Double3& p : points) p = Vector();
        Set(plug, points);
        if (Chance(30)) Set({name, a.name, Pick(kPoints), Pick(3)}, Value());
      } else if (a.kind == Kind::kVector) {
        Set(plug, Vector());
        if (Chance(30)) Set({name, a.name, -1, Pick(3)}, Value());
      } else if (Chance(50)) {
        Set({name, a.name, a.array ? Pick(4) : -1}, Value());
      }
    }
    for (int i = 0; i < 3; ++i) ConnectInto(static_cast<int>(nodes.size()) - 1, false);
  }

  // Any plug of the kind: outputs mostly, sometimes an input that is read on.
  bool PickSource(Kind kind, Plug* plug) {
    for (int attempt = 0; attempt < 30; ++attempt) {
      const auto& [name, t] = nodes[static_cast<std::size_t>(Pick(static_cast<int>(nodes.size())))];
      const ToyType& type = ToyTypes()[static_cast<std::size_t>(t)];
      *plug = {name, type.output};
      Kind found = type.kind;
      if (Chance(15)) {
        const Attribute& a =
            type.inputs[static_cast<std::size_t>(Pick(static_cast<int>(type.inputs.size())))];
        if (a.structural) continue;
        *plug = {name, a.name, a.array ? Pick(4) : -1};
        found = a.kind;
      }
      if (found == Kind::kVector && kind == Kind::kNumber) {
        plug->component = Pick(3);
        found = Kind::kNumber;
      }
      if (found == kind) return true;
    }
    return false;
  }
  bool PickInput(int node, Plug* plug, Kind* kind) {
    const auto& [name, t] = nodes[static_cast<std::size_t>(node)];
    const ToyType& type = ToyTypes()[static_cast<std::size_t>(t)];
    const Attribute& a = type.inputs[static_cast<std::size_t>(Pick(static_cast<int>(type.inputs.size())))];
    if (a.structural) return false;
    *plug = {name, a.name, a.array ? Pick(4) : -1};
    *kind = a.kind;
    if (a.kind == Kind::kPoints && Chance(25)) {
      plug->element = Pick(kPoints);
      *kind = Kind::kVector;
    }
    if (*kind == Kind::kVector && Chance(50)) {
      plug->component = Pick(3);
      *kind = Kind::kNumber;
    }
    return true;
  }

  // Both sides agree about what is refused, and about the message naming the plug.
  void ConnectInto(int node, bool replace) {
    Plug from, to;
    Kind kind;
    if (!PickInput(node, &to, &kind) || !PickSource(kind, &from)) return;
    const auto replaced = twin.drivers.find(to);
    const bool overlaps = twin.Overlaps(to, replace);
    std::optional<Plug> before;
    if (!overlaps && replaced != twin.drivers.end()) before = replaced->second;
    if (before) twin.drivers.erase(to);
    const bool cycle = !overlaps && twin.DependsOn(from, to);
    const Status status = graph.Connect(Ref(from), Ref(to), replace);
    EXPECT_EQ(status.ok(), !overlaps && !cycle)
        << from.Name() << " -> " << to.Name() << ": " << status.ToString();
    EXPECT_EQ(status.ToString().find("cycle") != std::string::npos, cycle) << status.ToString();
    if (status.ok()) {
      twin.drivers[to] = from;
    } else if (before) {
      twin.drivers[to] = *before;
    }
  }

  void Edit() {
    const int what = Pick(10), node = Pick(static_cast<int>(nodes.size()));
    if (what < 2) return AddNode();
    if (what < 3 && nodes.size() > 10) {
      const std::string name = nodes[static_cast<std::size_t>(node)].first;
      ASSERT_TRUE(graph.RemoveNode(*graph.FindNode(name)).ok());
      twin.Remove(name);
      nodes.erase(nodes.begin() + node);
    } else if (what < 5 && !twin.drivers.empty()) {
      auto it = twin.drivers.begin();
      std::advance(it, Pick(static_cast<int>(twin.drivers.size())));
      ASSERT_TRUE(graph.Disconnect(Ref(it->first)).ok());
      twin.drivers.erase(it);
    } else if (what < 8) {
      ConnectInto(node, Chance(70));
    } else {
      Plug plug;
      Kind kind;
      if (!PickInput(node, &plug, &kind) || kind == Kind::kPoints) return;
      kind == Kind::kNumber ? Set(plug, Value()) : Set(plug, Vector());
    }
  }

  Graph graph;
  NaiveTwin twin;
  std::vector<std::pair<std::string, int>> nodes;  // name, type

 private:
  std::mt19937 random_;
  int next_ = 0;
};

std::string Bytes(const double& v) { return std::string(reinterpret_cast<const char*>(&v), sizeof(v)); }

// The evaluators of one plan, set and pulled alike.
class Rounds {
 public:
  Rounds(RandomGraph& g, const std::shared_ptr<const Plan>& plan, const Request& request,
         const std::vector<Plug>& outputs)
      : g_(g), plan_(plan), request_(request), outputs_(outputs), profile_(*plan) {
    for (bool parallel : {false, true}) {
      EvaluatorOptions options;
      options.parallel = parallel;
      evaluators_.push_back(std::make_unique<Evaluator>(plan, options));
    }
    evaluators_[0]->Record(&profile_);
  }

  void SetSome() {
    for (std::size_t v = 0; v < plan_->varying().size(); ++v) {
      if (!g_.Chance(40)) continue;
      const Plan::Varying& varying = plan_->varying()[v];
      const Result<PlugRef> ref = g_.graph.FindPlug(varying.name);
      ASSERT_TRUE(ref.ok());
      Plug plug{g_.graph.name(ref->node),
                g_.graph.def(ref->node).attributes[static_cast<std::size_t>(ref->attribute)].name,
                ref->element};
      const auto index = static_cast<Index>(v);
      if (varying.type == Type::kDouble3) {
        const Double3 value = g_.Vector();
        for (auto& e : evaluators_) e->Set(index, value);
        g_.twin.Set(plug, value);
      } else if (varying.type == Type::kPoints) {
        PointBuffer buffer(kPoints);
        NaiveTwin::Points points(kPoints);
        for (std::size_t i = 0; i < kPoints; ++i) {
          points[i] = g_.Vector();
          buffer.view().x[i] = static_cast<float>(points[i].x);
          buffer.view().y[i] = static_cast<float>(points[i].y);
          buffer.view().z[i] = static_cast<float>(points[i].z);
        }
        for (auto& e : evaluators_) e->SetPoints(index, buffer.view());
        g_.twin.Set(plug, points);
      } else {
        const double value = g_.Value();
        for (auto& e : evaluators_)
          varying.type == Type::kBool ? e->SetInt(index, value != 0) : e->Set(index, value);
        g_.twin.Set(plug, value);
      }
    }
  }

  void Check(Index output) {
    const Plug& plug = outputs_[output];
    std::string expected;
    g_.twin.Begin();
    if (plan_->outputs()[output].type == Type::kPoints) {
      const NaiveTwin::Points all = g_.twin.AllPoints(plug);
      PointSet set = request_.outputs[output].points;
      if (set.total() == 0) set = PointSet::All(kPoints);
      for (Index i = 0; i < set.size(); ++i) {
        for (int c = 0; c < 3; ++c) expected += Bytes(all[set[i]][c]);
      }
    } else if (plan_->outputs()[output].type == Type::kDouble3) {
      const Double3 v = g_.twin.Vector(plug);
      for (int c = 0; c < 3; ++c) expected += Bytes(v[c]);
    } else {
      expected = Bytes(g_.twin.Number(plug));
    }
    for (const auto& e : evaluators_) {
      std::string got;
      if (plan_->outputs()[output].type == Type::kPoints) {
        const ConstPointsView view = e->Points(output);
        for (std::size_t i = 0; i < view.count; ++i)
          got += Bytes(view.x[i]) + Bytes(view.y[i]) + Bytes(view.z[i]);
      } else if (plan_->outputs()[output].type == Type::kDouble3) {
        for (int c = 0; c < 3; ++c) got += Bytes(e->Get<Double3>(output)[c]);
      } else {
        got = Bytes(e->Get<double>(output));
      }
      ASSERT_EQ(got, expected) << plug.Name() << " parallel " << (&e - evaluators_.data());
    }
  }

  void Run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      if (round > 0) SetSome();
      const std::vector<std::uint64_t> before = profile_.counts();
      if (g_.Chance(50)) {
        const auto output = static_cast<Index>(g_.Pick(static_cast<int>(outputs_.size())));
        for (auto& e : evaluators_) ASSERT_TRUE(e->Pull(output).ok());
        Check(output);
      } else {
        for (auto& e : evaluators_) ASSERT_TRUE(e->Evaluate().ok());
        for (Index output = 0; output < outputs_.size(); ++output) Check(output);
        const std::vector<std::uint64_t> done = profile_.counts();
        ASSERT_TRUE(evaluators_[0]->Evaluate().ok());
        EXPECT_EQ(profile_.counts(), done) << "nothing changed, something ran";
      }
      for (std::size_t s = 0; s < before.size(); ++s) EXPECT_LE(profile_.counts()[s], before[s] + 1);
    }
  }

 private:
  RandomGraph& g_;
  std::shared_ptr<const Plan> plan_;
  const Request& request_;
  const std::vector<Plug>& outputs_;
  Profile profile_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;
};

// Some outputs, some of their points, and some inputs that vary.
Request MakeRequest(RandomGraph& g, std::vector<Plug>* outputs) {
  Request request;
  outputs->clear();
  for (int i = 1 + g.Pick(4); i > 0; --i) {
    const auto& [name, t] = g.nodes[static_cast<std::size_t>(g.Pick(static_cast<int>(g.nodes.size())))];
    const ToyType& type = ToyTypes()[static_cast<std::size_t>(t)];
    outputs->push_back({name, type.output});
    PointSet set;
    if (type.kind == Kind::kPoints && g.Chance(60)) {
      std::vector<Index> some;
      for (int k = 1 + g.Pick(5); k > 0; --k) some.push_back(static_cast<Index>(g.Pick(kPoints)));
      set = PointSet::Of(some, kPoints);
    }
    request.outputs.push_back({g.Ref(outputs->back()), set});
  }
  for (const auto& [name, t] : g.nodes) {
    for (const Attribute& a : ToyTypes()[static_cast<std::size_t>(t)].inputs) {
      Plug plug{name, a.name, a.array ? 0 : -1};
      if (a.structural || !g.Chance(40) || g.twin.Overlaps(plug, false)) continue;
      if (a.kind == Kind::kVector && g.Chance(30)) plug.component = 1;
      request.varying.push_back(g.Ref(plug));
      if (a.array && g.twin.held.count(plug) == 0)
        g.Set(plug, 0.0);  // now it is an element for the twin, too
    }
  }
  return request;
}

class RandomGraphTest : public testing::TestWithParam<int> {};

TEST_P(RandomGraphTest, AgreesWithTheNaiveTwin) {
  const int threads = GetParam();
  ThreadLimit limit(threads);
  int steps = 0, units = 0, lazy = 0, gathers = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    RandomGraph g(seed * 3 + static_cast<unsigned>(threads));
    Compiler compiler;
    for (int i = 0; i < 30; ++i) g.AddNode();
    for (int edition = 0; edition < 6; ++edition) {
      std::vector<Plug> outputs;
      const Request request = MakeRequest(g, &outputs);
      const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(g.graph, request);
      ASSERT_TRUE(plan.ok()) << plan.status().ToString();
      Rounds(g, *plan, request, outputs).Run(6);
      if (HasFatalFailure() || HasNonfatalFailure()) return;
      steps += static_cast<int>((*plan)->steps().size());
      for (const Plan::Step& step : (*plan)->steps()) units += step.unit_size > 1;
      lazy += static_cast<int>((*plan)->segments().size()) - 1;
      for (Index s = 0; s < (*plan)->steps().size(); ++s)
        gathers += std::string((*plan)->step_label(s)) == "gather";
      // A varying plug keeps its last value in the twin: so it does in the graph
      for (const auto& [plug, value] : std::map<Plug, NaiveTwin::Held>(g.twin.held)) g.Set(plug, value);
      for (int i = 0; i < 12; ++i) g.Edit();
    }
  }
  // What the graphs were to contain
  EXPECT_GT(steps, 1500);
  EXPECT_GT(units, 50);
  EXPECT_GT(lazy, 150);
  EXPECT_GT(gathers, 50);
}

INSTANTIATE_TEST_SUITE_P(Threads, RandomGraphTest, testing::Values(1, 2, 4));

}  // namespace
}  // namespace kpsa::engine
