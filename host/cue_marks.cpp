#include "host/cue_marks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>

#include "base/quantity_text.h"
#include "host/clip_record.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/signals.h"

namespace kpsa::engine {
namespace {

using Kind = CueMark::Kind;

// In words: the axes and the position of a matrix are its entries 0 to 8 and 9 to 11.
std::string EntriesText(std::vector<std::size_t> entries) {
  std::sort(entries.begin(), entries.end());
  const auto turns = std::ranges::count_if(entries, [](std::size_t entry) { return entry < 9; });
  const auto moves = static_cast<std::ptrdiff_t>(entries.size()) - turns;
  std::string text = Plural(entries.size(), "number");
  if (turns > 0) text += fmt::format(", {} of its axes", turns);
  if (moves > 0) text += fmt::format(", {} of its place", moves);
  return text + fmt::format(" (entries {})", fmt::join(entries, ", "));
}

// What of the rig a subspace's names mean.
class Marker {
 public:
  Marker(const Rig& rig, std::span<const float> vertices) : rig_(rig), vertices_(vertices) {
    std::size_t first = 0;
    for (const std::size_t m : ShownMeshes(rig.scene)) {
      first_[m] = first;
      first += rig.scene.meshes[m].vertex_count;
    }
  }

  void Add(const AppliedSubspace& one) {
    const RigWithin within = MakeTarget(rig_, one.entry).within;
    for (now_.cue = 0; now_.cue < one.subspace->cues.size(); ++now_.cue) {
      const CueDescription& cue = one.subspace->cues[now_.cue];
      if (cue.kind == CueDescription::Kind::kPoint) {
        AddPoint(one, cue, within);
      } else if (cue.kind == CueDescription::Kind::kProduct) {
        others_.push_back(
            {CueName(*one.subspace, cue), Kind::kProduct, {}, {}, {}, ProductText(cue), {now_}});
      } else if (const SignalEntry entry = SplitEntryName(cue.plug); entry.entry.has_value()) {
        AddEntry(within.prefix + entry.signal, *entry.entry);
      } else {
        others_.push_back({within.prefix + cue.plug, Kind::kScalar, {}, {}, {}, "its value", {now_}});
      }
    }
    ++now_.subspace;
  }

  // After all were added. Matrices are evaluated at rest.
  Result<std::vector<CueMark>> Finish() {
    std::vector<CueMark> marks = std::move(points_);
    Request request;
    std::vector<std::size_t> asked;  // marks, one an output
    for (const std::string& name : order_) {
      marks.push_back({name, Kind::kMatrix, {}, {}, {}, EntriesText(matrices_[name]), cues_of_[name]});
      const Result<PlugRef> plug = rig_.graph->FindPlug(name);
      if (!plug.ok()) continue;
      const int world = rig_.graph->def(plug->node).FindAttribute("worldMatrix");
      if (world < 0) continue;
      request.outputs.push_back({{plug->node, world, -1, -1}, {}});
      asked.push_back(marks.size() - 1);
    }
    if (!asked.empty()) {
      Compiler compiler;
      const auto plan = CompileFor(rig_, &compiler, request);
      if (!plan.ok()) return plan.status();
      Evaluator evaluator(*plan);
      KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
      for (std::size_t i = 0; i < asked.size(); ++i) {
        const Matrix4& world = evaluator.Get<Matrix4>(static_cast<Index>(i));
        marks[asked[i]].position = {world(0, 3), world(1, 3), world(2, 3)};
        marks[asked[i]].vertex = Nearest(*marks[asked[i]].position);
      }
    }
    std::stable_sort(others_.begin(), others_.end(),
                     [](const CueMark& a, const CueMark& b) { return a.kind < b.kind; });
    marks.insert(marks.end(), others_.begin(), others_.end());
    return marks;
  }

 private:
  void AddPoint(const AppliedSubspace& one, const CueDescription& cue, const RigWithin& within) {
    CueMark mark{CueName(*one.subspace, cue), Kind::kPoint, cue.stage, {}, {}, "its position, x y z", {now_}};
    if (!cue.joint.empty()) mark.sees += " in the space of " + within.prefix + cue.joint;
    const AcceleratedPoints& points = one.entry.points[cue.mesh];
    if (points.colors) {
      mark.name += fmt::format("[{}]", cue.point), mark.sees = "its colour";
      points_.push_back(std::move(mark));
      return;
    }
    const std::vector<Index>& to_point = rig_.scene.meshes[points.mesh].mesh().data().vertex_to_point;
    const auto vertex = static_cast<std::size_t>(std::ranges::find(to_point, cue.point) - to_point.begin());
    mark.name += fmt::format("[{}]", vertex);
    if (const auto first = first_.find(points.mesh); first != first_.end() && vertex < to_point.size()) {
      mark.vertex = first->second + vertex;
      mark.position = PlaceOf(*mark.vertex);
    }
    points_.push_back(std::move(mark));
  }

  void AddEntry(const std::string& matrix, std::size_t entry) {
    if (!matrices_.contains(matrix)) order_.push_back(matrix);
    matrices_[matrix].push_back(entry);
    cues_of_[matrix].push_back(now_);
  }

  static std::string ProductText(const CueDescription& cue) {
    std::vector<std::string> factors;
    for (const CueDescription::Factor& factor : cue.factors)
      factors.push_back(factor.curve.hinge ? fmt::format("{} beyond {:.3g}", factor.plug, factor.curve.centre)
                                           : factor.plug);
    return fmt::format("{}", fmt::join(factors, " times "));
  }

  std::array<double, 3> PlaceOf(std::size_t vertex) const {
    const float* p = vertices_.data() + 3 * vertex;
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }

  std::optional<std::size_t> Nearest(const std::array<double, 3>& place) const {
    std::optional<std::size_t> nearest;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; 3 * v < vertices_.size(); ++v) {
      const std::array<double, 3> at = PlaceOf(v);
      const double x = at[0] - place[0], y = at[1] - place[1], z = at[2] - place[2];
      if (x * x + y * y + z * z < least) least = x * x + y * y + z * z, nearest = v;
    }
    return nearest;
  }

  const Rig& rig_;
  std::span<const float> vertices_;
  std::map<std::size_t, std::size_t> first_;  // of shown meshes, the first of their vertices
  std::vector<CueMark> points_, others_;
  std::map<std::string, std::vector<std::size_t>> matrices_;  // entries that are measured
  std::map<std::string, std::vector<CueMark::Cue>> cues_of_;  // likewise
  std::vector<std::string> order_;                            // of the matrices
  CueMark::Cue now_;                                          // the one that is marked
};

}  // namespace

const char* KindName(CueMark::Kind kind) {
  constexpr const char* kNames[] = {"point", "matrix", "scalar", "product"};
  return kNames[static_cast<int>(kind)];
}

Result<std::vector<CueMark>> MarkCues(const Rig& rig, const std::vector<AppliedSubspace>& applied,
                                      std::span<const float> vertices) {
  Marker marker(rig, vertices);
  for (const AppliedSubspace& one : applied) marker.Add(one);
  return marker.Finish();
}

}  // namespace kpsa::engine
