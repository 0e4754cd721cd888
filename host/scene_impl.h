// What a Scene holds.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "graph/evaluator.h"
#include "host/decisions.h"
#include "host/face_impl.h"
#include "host/run_up.h"
#include "kpsa/scene.h"

namespace kpsa {

struct Scene::Impl {
  struct Held {  // what somebody set
    engine::PlugRef plug;
    engine::Value value;
  };
  // What evaluates the shown meshes with all that is set: a copy, which later changes of the scene leave alone.
  struct Snapshot {
    std::shared_ptr<engine::Playing> playing;
    std::shared_ptr<const engine::Plan> plan;
    std::vector<Held> held;
    void Apply(engine::Evaluator* to) const { ApplyHeld(held, to); }
  };

  kpsa::Rig rig;
  std::optional<std::string> clip;
  std::shared_ptr<engine::Playing> playing;  // null until something asks; a failure is told to whoever asks
  engine::Request request;                   // of playing, and what was asked for besides
  std::shared_ptr<const engine::Plan> plan;  // null where the request is another by now
  std::unique_ptr<engine::Evaluator> evaluator;
  std::optional<engine::RunUp> run_up;  // of the evaluator
  std::function<bool()> on_the_way;     // of WatchRunUp
  double time = 0;
  std::vector<Held> held;
  std::vector<engine::Setting> settings;   // plugs that are set in the graph, of an accelerated rig
  std::vector<std::vector<float>> points;  // by output
  // What each subspace said when something was pulled last, where it was asked at all
  std::vector<std::optional<engine::DecisionNumbers>> decided;
  std::shared_ptr<engine::Playing> decided_by;  // whose subspaces these are
  kpsa::Verdict verdict;

  explicit Impl(const kpsa::Rig& of) : rig(of) {}
  const Rig::Impl& shared() const { return *rig.impl_; }

  // Everything that is set; equal values cost nothing.
  static void ApplyHeld(const std::vector<Held>& held, engine::Evaluator* to);
  void Forget();
  engine::Status EnsurePlaying();
  engine::Status Ensure();
  void Restart();
  void Vary(const engine::PlugRef& plug);
  // The number of an output; a new one changes the plan.
  engine::Result<engine::Index> OutputOf(const engine::PlugRef& plug);
  engine::Status Set(std::string_view name, double number);
  // An output at the scene's time, and what subspaces said on the way.
  engine::Status Pull(engine::Index output);
  engine::Result<Snapshot> Take();
};

// An edited graph may give a mesh other points than it has vertices for.
engine::Status CheckCount(const engine::Playing& playing, const engine::CharacterMesh& mesh,
                          const engine::PlugRef& points, std::size_t count);

}  // namespace kpsa
