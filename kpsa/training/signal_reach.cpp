#include "kpsa/training/signal_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kpsa/training/space_points.h"

namespace kpsa::engine {
namespace {

constexpr double kTriedTurn = 0.02;  // radians, about (1, 1, 1)
constexpr double kShift = 1e-3;      // of the diagonal, along (1, 1, 1)
constexpr double kRaise = 0.01;      // of a value
constexpr double kSafety = 1.7;      // a point on the tried axis moves less than about another one
constexpr double kLeast = 1e-6;      // metres a unit: what moves nothing at rest may move something elsewhere
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Prober {
 public:
  Prober(const TrainingRig& rig, Compiler* compiler, const Matrix4& inverse_rest_stretch)
      : rig_(rig), compiler_(compiler), stretch_(inverse_rest_stretch) {}

  Status Start(std::vector<PlugRef> plugs) {
    Request request = SpacePointsRequest(rig_.target);
    request.varying = plugs;
    Result<std::shared_ptr<const Plan>> plan = compiler_->Compile(*rig_.graph, request);
    if (!plan.ok()) return plan.status();
    evaluator_ = std::make_unique<Evaluator>(*plan);
    for (const PlugRef& plug : plugs) {
      Result<Value> rest = compiler_->Rest(*rig_.graph, plug);
      if (!rest.ok()) return rest.status();
      rest_.emplace_back(plug, rest->AsDouble());
    }
    return Measure(&at_rest_);
  }
  // Metres that the farthest point moves where each of the plugs is `step` above its rest value.
  Result<double> Move(std::span<const PlugRef> plugs, double step) {
    const auto set = [&](double by) {
      for (const PlugRef& plug : plugs) {
        const auto rest =
            std::find_if(rest_.begin(), rest_.end(), [&](const auto& r) { return r.first == plug; });
        SetPlug(evaluator_.get(), plug, rest->second + by);
      }
    };
    set(step);
    KPSA_RETURN_IF_ERROR(Measure(&moved_));
    set(0);
    return LargestDistance(at_rest_, moved_);
  }

 private:
  Status Measure(std::vector<double>* points) {
    KPSA_RETURN_IF_ERROR(evaluator_->Evaluate());
    SpacePoints(*evaluator_, rig_.target, stretch_, points);
    return Status();
  }
  const TrainingRig& rig_;
  Compiler* compiler_;
  const Matrix4& stretch_;
  std::unique_ptr<Evaluator> evaluator_;
  std::vector<std::pair<PlugRef, double>> rest_;
  std::vector<double> at_rest_, moved_;
};

}  // namespace

Result<std::vector<double>> FindReach(const TrainingRig& rig, Compiler* compiler,
                                      const std::vector<Signal>& signals, const Matrix4& inverse_rest_stretch,
                                      double diagonal) {
  std::vector<PlugRef> plugs;
  std::vector<FreeTransform> free(signals.size());
  for (std::size_t s = 0; s < signals.size(); ++s) {
    const Signal& signal = signals[s];
    PlugRef whole = signal.plug;
    whole.component = -1;
    const Type type = rig.graph->PlugType(signal.plug);
    if (signal.matrix) {
      free[s] = FreePlugs(*rig.graph, signal.plug.node);
      plugs.insert(plugs.end(), free[s].translate.begin(), free[s].translate.end());
      plugs.insert(plugs.end(), free[s].rotate.begin(), free[s].rotate.end());
    } else if (type == Type::kDouble && rig.graph->FindConnection(signal.plug) == nullptr &&
               rig.graph->FindConnection(whole) == nullptr &&
               !rig.graph->def(signal.plug.node)
                    .attributes[static_cast<std::size_t>(signal.plug.attribute)]
                    .output) {
      free[s].scale = {signal.plug};
      plugs.push_back(signal.plug);
    }
  }
  Prober prober(rig, compiler, inverse_rest_stretch);
  KPSA_RETURN_IF_ERROR(prober.Start(std::move(plugs)));
  std::vector<double> reach;
  const double shift = kShift * diagonal / std::sqrt(3.0);
  const auto tried = [&](std::span<const PlugRef> moved, double step, double unit) -> Result<double> {
    const Result<double> distance = prober.Move(moved, step);
    if (!distance.ok()) return distance;
    return std::max(kLeast, kSafety * *distance / unit);
  };
  for (std::size_t s = 0; s < signals.size(); ++s) {
    if (!signals[s].matrix) {
      Result<double> value = kInfinity;
      if (!free[s].scale.empty()) value = tried(free[s].scale, kRaise, kRaise);
      if (!value.ok()) return value.status();
      reach.push_back(*value);
      continue;
    }
    Result<double> turn = diagonal, move = kSafety;
    if (!free[s].rotate.empty()) turn = tried(free[s].rotate, kTriedTurn / std::sqrt(3.0), kTriedTurn);
    if (!free[s].translate.empty()) move = tried(free[s].translate, shift, kShift * diagonal);
    if (!turn.ok()) return turn.status();
    if (!move.ok()) return move.status();
    for (std::size_t e = 0; e < signals[s].entries(); ++e) reach.push_back(e < 9 ? *turn : *move);
  }
  return reach;
}

}  // namespace kpsa::engine
