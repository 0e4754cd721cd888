#include "host/bench/idle.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <set>

#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostFrames = 48;  // of a clip

// A clip with a switch for every deformer, and where its final points are with all of them.
class SwitchedClip {
 public:
  Status Load(const RigOpener& opener, const RigChange& change, const Watch& watch) {
    watch_ = watch;
    Result<std::unique_ptr<OpenRig>> loaded = opener.open(change);
    if (!loaded.ok()) return loaded.status();
    open_ = std::move(*loaded);
    const Result<std::vector<double>> sampled = opener.times(*open_);
    if (!sampled.ok()) return sampled.status();
    const std::size_t count = std::min(kMostFrames, sampled->size());
    for (std::size_t f = 0; f < count; ++f)
      times_.push_back((*sampled)[count == 1 ? 0 : f * (sampled->size() - 1) / (count - 1)]);
    const Rig& rig = open_->rig;
    Request request = ShownPoints(rig);
    const std::vector<PlugRef> envelopes = Envelopes(rig);
    request.varying.insert(request.varying.end(), envelopes.begin(), envelopes.end());
    const auto plan = CompileFor(rig, &compiler_, request);
    if (!plan.ok()) return plan.status();
    if (!(*plan)->stateful_node().empty()) return Status();
    std::set<Index> ran;
    for (const Plan::StepInfo& info : (*plan)->infos()) ran.insert(info.node.index);
    for (const PlugRef& plug : envelopes) {
      const Index varying = (*plan)->FindVarying(plug);
      if (varying != kNoIndex && ran.contains(plug.node.index)) switches_.push_back({plug, varying, 1});
    }
    evaluator_ = std::make_unique<Evaluator>(*plan);
    for (Switch& each : switches_) {
      const Value* const set = rig.graph->FindValue(each.plug);
      if (set != nullptr) each.on = set->AsDouble();
    }
    return Status();
  }

  std::size_t frames() const { return times_.size(); }
  std::size_t deformers() const { return switches_.size(); }
  std::string NameOf(std::size_t d) const { return open_->rig.graph->name(switches_[d].plug.node); }
  std::string TypeOf(std::size_t d) const { return open_->rig.graph->def(switches_[d].plug.node).name; }

  // Each deformer alone: its largest difference so far.
  Status AddAlone(std::vector<IdleDeformers::Deformer>* deformers) {
    for (std::size_t f = 0; f < times_.size(); ++f) {
      KPSA_RETURN_IF_ERROR(Evaluate(f));
      points_.push_back(Points());
      for (std::size_t d = 0; d < switches_.size(); ++d) {
        Turn(d, false);
        KPSA_RETURN_IF_ERROR(Evaluate(f));
        Turn(d, true);
        double& difference = (*deformers)[d].difference;
        difference = std::max(difference, Difference(f));
      }
    }
    return Status();
  }
  void Turn(std::size_t d, bool on) { evaluator_->Set(switches_[d].varying, on ? switches_[d].on : 0.0); }
  // As the switches are, after AddAlone; no frame is looked at after one that is beyond `enough`.
  Status AddTogether(double enough, double* difference) {
    for (std::size_t f = 0; f < times_.size() && *difference <= enough; ++f) {
      KPSA_RETURN_IF_ERROR(Evaluate(f));
      *difference = std::max(*difference, Difference(f));
    }
    return Status();
  }

  // The nodes that are still evaluated where these are off for good.
  Result<std::set<std::string>> NodesWithout(const std::vector<std::size_t>& off) {
    for (const std::size_t d : off)
      KPSA_RETURN_IF_ERROR(open_->rig.graph->Set(switches_[d].plug, Value(0.0)));
    const auto plan = CompileFor(open_->rig, &compiler_, ShownPoints(open_->rig));
    if (!plan.ok()) return plan.status();
    std::set<std::string> names;
    for (Index s = 0; s < (*plan)->steps().size(); ++s) names.insert((*plan)->step_name(s));
    return names;
  }

 private:
  struct Switch {
    PlugRef plug;
    Index varying = kNoIndex;
    double on = 1;  // the rig's own value
  };

  static std::vector<PlugRef> Envelopes(const Rig& rig) {
    std::vector<PlugRef> plugs;
    for (const CharacterMesh& mesh : rig.scene.meshes) {
      for (const Stage& stage : mesh.stages) {
        const PlugRef plug{stage.node, rig.graph->def(stage.node).FindAttribute("envelope"), -1, -1};
        if (plug.attribute >= 0 && rig.graph->FindConnection(plug) == nullptr &&
            std::find(plugs.begin(), plugs.end(), plug) == plugs.end())
          plugs.push_back(plug);
      }
    }
    return plugs;
  }

  Status Evaluate(std::size_t frame) {
    if (watch_.cancelled()) return CancelledStatus();
    const Index time = evaluator_->plan().FindVarying(open_->rig.scene.time);
    if (time != kNoIndex) evaluator_->Set(time, times_[frame]);
    return evaluator_->Evaluate().At({open_->rig.path});
  }
  std::vector<float> Points() const {
    std::vector<float> all;
    for (Index o = 0; o < evaluator_->plan().outputs().size(); ++o) {
      const ConstPointsView p = evaluator_->Points(o);
      for (const float* row : {p.x, p.y, p.z}) all.insert(all.end(), row, row + p.count);
    }
    return all;
  }
  // Of the present points from those of the frame with all deformers.
  double Difference(std::size_t frame) const {
    const float* at = points_[frame].data();
    double worst = 0;
    for (Index o = 0; o < evaluator_->plan().outputs().size(); ++o) {
      const ConstPointsView p = evaluator_->Points(o);
      const float *x = at, *y = x + p.count, *z = y + p.count;
      for (std::size_t i = 0; i < p.count; ++i) {
        const double dx = double{p.x[i]} - x[i], dy = double{p.y[i]} - y[i], dz = double{p.z[i]} - z[i];
        const double square = dx * dx + dy * dy + dz * dz;
        worst = std::max(worst, std::isfinite(square) ? square : std::numeric_limits<double>::infinity());
      }
      at = z + p.count;
    }
    return std::sqrt(worst);
  }

  Watch watch_;
  std::unique_ptr<OpenRig> open_;
  Compiler compiler_;
  std::unique_ptr<Evaluator> evaluator_;
  std::vector<double> times_;
  std::vector<Switch> switches_;
  std::vector<std::vector<float>> points_;  // by frame
};

// Tries them in this order.
Status TurnOffTogether(std::deque<SwitchedClip>* clips, const std::vector<std::size_t>& order,
                       IdleDeformers* idle) {
  for (const std::size_t d : order) {
    if (idle->deformers[d].difference > idle->tolerance) break;
    double together = 0;
    for (SwitchedClip& clip : *clips) {
      clip.Turn(d, false);
      KPSA_RETURN_IF_ERROR(clip.AddTogether(idle->tolerance, &together));
    }
    if (together <= idle->tolerance) {
      idle->deformers[d].off = true;
      idle->difference = together;
    } else {
      for (SwitchedClip& clip : *clips) clip.Turn(d, true);
    }
  }
  return Status();
}

}  // namespace

std::vector<std::string> IdleDeformers::Off() const {
  std::vector<std::string> names;
  for (const Deformer& each : deformers) {
    if (each.off) names.push_back(each.name);
  }
  return names;
}

Result<IdleDeformers> MeasureIdle(const RigOpener& opener, const std::vector<std::string>& clips,
                                  double tolerance, const std::map<std::string, double>& full_ms,
                                  const Watch& watch) {
  IdleDeformers idle;
  idle.tolerance = tolerance;
  std::deque<SwitchedClip> loaded;
  for (const std::string& name : clips) {
    RigChange change;
    if (!name.empty()) change.clip = name;
    SwitchedClip& clip = loaded.emplace_back();
    KPSA_RETURN_IF_ERROR(clip.Load(opener, change, watch));
    // Clips reach the same deformers, unless they drive an envelope themselves
    if (clip.deformers() != loaded.front().deformers() || clip.deformers() == 0) return IdleDeformers();
    for (std::size_t d = 0; d < clip.deformers(); ++d) {
      if (clip.NameOf(d) != loaded.front().NameOf(d)) return IdleDeformers();
    }
  }
  for (std::size_t d = 0; !loaded.empty() && d < loaded.front().deformers(); ++d)
    idle.deformers.push_back({loaded.front().NameOf(d), loaded.front().TypeOf(d)});
  if (!idle.measured()) return idle;
  for (SwitchedClip& clip : loaded) {
    idle.frames += clip.frames();
    KPSA_RETURN_IF_ERROR(clip.AddAlone(&idle.deformers));
  }
  std::vector<std::size_t> order(idle.deformers.size()), off;
  for (std::size_t d = 0; d < order.size(); ++d) order[d] = d;
  const auto less = [&](std::size_t a, std::size_t b) {
    return idle.deformers[a].difference < idle.deformers[b].difference;
  };
  std::stable_sort(order.begin(), order.end(), less);
  KPSA_RETURN_IF_ERROR(TurnOffTogether(&loaded, order, &idle));

  for (std::size_t d = 0; d < order.size(); ++d) {
    if (idle.deformers[d].off) off.push_back(d);
  }
  const Result<std::set<std::string>> kept = loaded.front().NodesWithout(off);
  if (!kept.ok()) return kept.status();
  double all = 0;
  for (const auto& [name, ms] : full_ms) {
    all += ms;
    if (!off.empty() && !kept->contains(name)) idle.ms_per_frame += ms;
  }
  idle.share = all > 0 ? idle.ms_per_frame / all : 0;
  std::vector<IdleDeformers::Deformer> sorted;
  for (const std::size_t d : order) sorted.push_back(idle.deformers[d]);
  idle.deformers = std::move(sorted);
  return idle;
}

}  // namespace kpsa::engine
