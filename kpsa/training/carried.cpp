#include "kpsa/training/carried.h"

#include <algorithm>
#include <cmath>

#include "kpsa/training/random.h"
#include "kpsa/training/space_points.h"

namespace kpsa::engine {
namespace {

constexpr double kAllowed = 0.01;        // of the tolerance
constexpr double kRoundingShare = 4e-6;  // of the largest coordinate: a stack of float kernels
constexpr double kTurn = 0.6;            // radians about each axis, at most
constexpr std::size_t kClipTimes = 12;   // of a clip

// One transform of the chain.
struct Link {
  NodeId node;
  FreeTransform plugs;
};

class Trial {
 public:
  Trial(const TrainingRig& rig, const Matrix4& stretch, double diagonal, double tolerance)
      : rig_(rig), stretch_(stretch), diagonal_(diagonal), tolerance_(tolerance) {}

  // The rig as it is now (with or without a clip), and the poses that it is tried in: times, or the values of
  // the plugs `controls`.
  Status Start(Compiler* compiler, const std::vector<Link>& chain, std::vector<PlugRef> controls,
               std::vector<std::pair<double, std::vector<double>>> poses) {
    controls_ = std::move(controls), poses_ = std::move(poses);
    Request request = SpacePointsRequest(rig_.target);
    request.varying = controls_;
    request.varying.push_back(rig_.time);
    base_.clear();
    for (const Link& link : chain) {
      for (const auto* plugs : {&link.plugs.translate, &link.plugs.rotate, &link.plugs.scale}) {
        for (const PlugRef& plug : *plugs) {
          if (std::find(request.varying.begin(), request.varying.end(), plug) == request.varying.end())
            request.varying.push_back(plug);
          const Result<Value> rest = compiler->Rest(*rig_.graph, plug);
          if (!rest.ok()) return rest.status();
          base_.emplace_back(plug, rest->AsDouble());
        }
      }
    }
    Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig_.graph, request);
    if (!plan.ok()) return plan.status();
    evaluator_ = std::make_unique<Evaluator>(*plan);
    return Status();
  }

  // Whether no pose has a point that moves, in the space, with these links.
  Result<bool> Carries(std::span<const Link* const> links, bool scale) {
    Random random(0x9e3779b97f4a7c15ull);
    const auto unit = [&] { return 2 * random.Unit() - 1; };
    for (const auto& [time, values] : poses_) {
      SetPlug(evaluator_.get(), rig_.time, time);
      for (const auto& [plug, rest] : base_) SetPlug(evaluator_.get(), plug, rest);
      for (std::size_t c = 0; c < controls_.size(); ++c) SetPlug(evaluator_.get(), controls_[c], values[c]);
      double size = 0, moved_size = 0;
      KPSA_RETURN_IF_ERROR(evaluator_->Evaluate());
      SpacePoints(*evaluator_, rig_.target, stretch_, &still_, &size);
      const double factor = unit() < 0 ? 0.7 : 1.6;
      for (const Link* link : links) {
        for (int c = 0; c < 3; ++c) {
          const auto axis = static_cast<std::size_t>(c);
          if (scale) {
            Move(link->plugs.scale[axis], values, [&](double v) { return factor * v; });
            continue;
          }
          const double turn = kTurn * unit(), shift = 0.5 * diagonal_ * unit();
          Move(link->plugs.rotate[axis], values, [&](double v) { return v + turn; });
          Move(link->plugs.translate[axis], values, [&](double v) { return v + shift; });
        }
      }
      KPSA_RETURN_IF_ERROR(evaluator_->Evaluate());
      SpacePoints(*evaluator_, rig_.target, stretch_, &moved_, &moved_size);
      const double allowed = kAllowed * tolerance_ + kRoundingShare * std::max(size, moved_size);
      if (!(LargestDistance(still_, moved_) <= allowed)) return false;
    }
    return true;
  }

 private:
  template <typename F>
  void Move(const PlugRef& plug, const std::vector<double>& values, F f) {
    double value = 0;
    for (const auto& [known, rest] : base_) {
      if (known == plug) value = rest;
    }
    for (std::size_t c = 0; c < controls_.size(); ++c) {
      if (controls_[c] == plug) value = values[c];
    }
    SetPlug(evaluator_.get(), plug, f(value));
  }

  const TrainingRig& rig_;
  const Matrix4& stretch_;
  const double diagonal_, tolerance_;
  std::vector<PlugRef> controls_;
  std::vector<std::pair<double, std::vector<double>>> poses_;
  std::vector<std::pair<PlugRef, double>> base_;
  std::unique_ptr<Evaluator> evaluator_;
  std::vector<double> still_, moved_;
};

}  // namespace

Result<Carried> FindCarried(const TrainingRig& rig, Compiler* compiler,
                            const std::vector<TrainingClip>& clips, const std::vector<SampledPose>& poses,
                            const Matrix4& inverse_rest_stretch, double diagonal, double tolerance) {
  Carried carried;
  if (rig.target.space.empty() || rig.target.colors) return carried;
  const Graph& graph = *rig.graph;
  std::vector<Link> chain;
  for (const NodeId node : ParentsFrom(graph, rig.target.space[0].node)) {
    Link link{node, FreePlugs(graph, node)};
    if (!link.plugs.translate.empty() && !link.plugs.rotate.empty()) chain.push_back(std::move(link));
  }
  std::vector<char> rigid(chain.size(), 1);
  bool scales = !chain.empty() && !chain.back().plugs.scale.empty();
  Trial trial(rig, inverse_rest_stretch, diagonal, tolerance);
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    std::vector<PlugRef> controls;
    std::vector<std::pair<double, std::vector<double>>> tried;
    if (clip < 0) {
      KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
      std::vector<double> rest;
      for (const ControlRange& control : rig.controls)
        controls.push_back(control.plug), rest.push_back(control.rest);
      tried.emplace_back(0, rest);
      for (const SampledPose& pose : poses) {
        if (pose.clip < 0) tried.emplace_back(0, pose.values);
      }
    } else {
      const TrainingClip& playing = clips[static_cast<std::size_t>(clip)];
      KPSA_RETURN_IF_ERROR(rig.set_clip(playing.name));
      for (std::size_t i = 0; i < std::min(kClipTimes, playing.times.size()); ++i)
        tried.emplace_back(
            playing.times[i * playing.times.size() / std::min(kClipTimes, playing.times.size())],
            std::vector<double>());
    }
    KPSA_RETURN_IF_ERROR(trial.Start(compiler, chain, std::move(controls), std::move(tried)));
    // All at once, as most chains carry everything; else one by one
    std::vector<const Link*> links;
    for (std::size_t l = 0; l < chain.size(); ++l) {
      if (rigid[l]) links.push_back(&chain[l]);
    }
    Result<bool> all = trial.Carries(links, false);
    if (!all.ok()) return all.status();
    for (std::size_t l = 0; l < chain.size() && !*all; ++l) {
      if (!rigid[l]) continue;
      const Link* const one = &chain[l];
      const Result<bool> carries = trial.Carries({&one, 1}, false);
      if (!carries.ok()) return carries.status();
      rigid[l] = *carries;
    }
    if (scales && rigid.back()) {
      const Link* const top = &chain.back();
      const Result<bool> carries = trial.Carries({&top, 1}, true);
      if (!carries.ok()) return carries.status();
      scales = *carries;
    }
  }
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  for (std::size_t l = 0; l < chain.size(); ++l) {
    if (rigid[l]) carried.rigid.push_back(graph.name(chain[l].node));
  }
  carried.scales = scales && !chain.empty() && rigid.back();
  return carried;
}

}  // namespace kpsa::engine
