#include "rig/build/steps/set_targets.h"

#include "rig/build/shape_points.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

using Target = MorphTargets::Target;

// Of one blend shape.
class TargetSetter {
 public:
  TargetSetter(const BuildInput& in, const MadeNode& made, std::vector<std::string>* notes)
      : in_(in), made_(made), notes_(notes) {}

  // The targets of each geometry; none after an error.
  std::optional<std::vector<std::vector<Target>>> Make(const std::vector<NamedTarget>& from) {
    std::vector<std::vector<Target>> targets(made_.geometries.size());
    bool good = true;
    for (const NamedTarget& target : from) {
      for (std::vector<Target>& of : targets) of.push_back({target.name, {}, {}});
      filled_.assign(targets.size(), false);
      for (const TargetSource& source : target.sources) {
        good = (source.shape == nullptr ? TakeMorphs(*source.at, target.name, &targets)
                                        : TakeShape(source, &targets)) &&
               good;
      }
    }
    if (!good) return std::nullopt;
    return targets;
  }

 private:
  const MorphTargets* MorphsOf(std::size_t geometry) const {
    return in_.rig.scene.meshes[*made_.geometries[geometry].mesh].geometry.targets.get();
  }

  // Of every mesh that has one of that name.
  bool TakeMorphs(const YamlNode& at, const std::string& name, std::vector<std::vector<Target>>* targets) {
    bool found = false;
    std::vector<std::string> known;
    for (std::size_t g = 0; g < targets->size(); ++g) {
      const MorphTargets* from = MorphsOf(g);
      for (std::size_t k = 0; from != nullptr && k < from->targets().size(); ++k) {
        known.push_back(from->targets()[k].name);
        if (known.back() != name || filled_[g]) continue;
        (*targets)[g].back() = from->targets()[k];
        found = filled_[g] = true;
      }
    }
    return found || in_.errors->Add(at, "targets: \"{}\" is no target of {}{}", name,
                                    made_.geometries.front().name, DidYouMean(name, known));
  }

  bool TakeShape(const TargetSource& source, std::vector<std::vector<Target>>* targets) {
    const std::optional<std::size_t> g = GeometryOf(source);
    if (!g.has_value()) return false;
    Target& target = (*targets)[*g].back();
    if (filled_[*g]) {
      return in_.errors->Add(*source.at, "targets: \"{}\" has two shapes for {}", target.name,
                             made_.geometries[*g].name);
    }
    filled_[*g] = true;
    const CharacterMesh& mesh = in_.rig.scene.meshes[*made_.geometries[*g].mesh];
    Result<PointShape> shape = ShapeOfPoints(source, mesh);
    if (!shape.ok()) return in_.errors->Add(*source.at, shape.status());
    target.points = std::move(shape->points);
    target.deltas = std::move(shape->deltas);
    for (const std::string& note : shape->notes)
      notes_->push_back(fmt::format("{}: {}", source.at->where().ToString(), note));
    return true;
  }

  std::optional<std::size_t> GeometryOf(const TargetSource& source) const {
    std::vector<std::string> names;
    for (const DeformedGeometry& of : made_.geometries) names.push_back(of.name);
    if (!source.mesh.has_value()) {
      if (names.size() == 1) return 0;
      in_.errors->Add(*source.at, "targets: \"{}\" deforms {}: say whose shapes these are, mesh: {}",
                      made_.from->name, fmt::join(names, ", "), names.front());
      return std::nullopt;
    }
    const std::optional<std::size_t> mesh = in_.names.FindMesh(*source.mesh, source.at->where());
    if (!mesh.has_value()) return std::nullopt;
    for (std::size_t g = 0; g < names.size(); ++g) {
      if (made_.geometries[g].mesh == mesh) return g;
    }
    in_.errors->Add(*source.at, "targets: \"{}\" does not deform {}; it deforms {}", made_.from->name,
                    *source.mesh, fmt::join(names, ", "));
    return std::nullopt;
  }

  const BuildInput& in_;
  const MadeNode& made_;
  std::vector<std::string>* notes_;
  std::vector<bool> filled_;  // by geometry: whether the target is there
};

void SetTargetsOf(const BuildInput& in, const MadeNode& made, const TargetShapes& shapes, Graph* graph,
                  std::vector<std::string>* notes) {
  const std::vector<NamedTarget>* from = shapes.Find(made.id);
  if (from == nullptr || made.geometries.empty()) return;
  for (const DeformedGeometry& of : made.geometries) {
    if (!of.mesh.has_value()) {
      in.errors->Add(made.Find("targets")->value, "targets: {} is no mesh", of.name);
      return;
    }
  }
  std::optional<std::vector<std::vector<Target>>> targets = TargetSetter(in, made, notes).Make(*from);
  if (!targets.has_value()) return;
  GraphEditor edit(graph);
  for (std::size_t g = 0; g < targets->size(); ++g) {
    const auto points = static_cast<Index>(made.geometries[g].count);
    edit.Set(made.id, "targets", static_cast<int>(g),
             std::make_shared<const MorphTargets>(std::move((*targets)[g]), points));
  }
  in.Fail(made.from->where, edit.Take());
}

}  // namespace

void SetTargets(const BuildInput& in, const MadeNodes& nodes, const TargetShapes& shapes, Graph* graph,
                std::vector<std::string>* notes) {
  for (const MadeNode& made : nodes) SetTargetsOf(in, made, shapes, graph, notes);
}

}  // namespace kpsa::engine
