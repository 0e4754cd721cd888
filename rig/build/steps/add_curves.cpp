#include "rig/build/steps/add_curves.h"

#include "rig/file/values.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxCvs = 65536;

}  // namespace

void AddCurves(const BuildInput& in, const MadeNodes& nodes, const RestPlaces& places, RestCurves* curves,
               Graph* graph) {
  for (const MadeNode& made : nodes) {
    if (graph->def(made.id).name != "curve" || in.errors->full()) continue;
    const RigAttribute* vertices = made.Find("vertices");
    const RigAttribute* written = made.Find("places");
    const RigAttribute* mesh = made.Find("mesh");
    const RigAttribute* closed = made.Find("closed");
    if ((vertices == nullptr) == (written == nullptr)) {
      in.Fail(made.from->where,
              Status::Invalid(
                  "curve \"{}\": expected either \"vertices\" of a mesh or \"places\" [[x, y, z], ...]",
                  made.from->name));
      continue;
    }
    Places cvs;
    bool is_closed = false;
    if (closed != nullptr && !ReadBool(closed->value, "closed", &is_closed, in.errors)) continue;
    if (vertices != nullptr) {
      if (!places.VertexPlaces(vertices->value, mesh == nullptr ? nullptr : &mesh->value, &cvs)) continue;
    } else {
      bool good =
          written->value.is_sequence() || in.errors->Add(written->value, "places: expected a list of points");
      for (const YamlNode& item : written->value.items) {
        std::vector<double> p;
        good =
            ReadNumbers(item, "places", Unit::kLength, in.units(written->source), 3, &p, in.errors) && good;
        if (good) cvs.push_back({p[0], p[1], p[2]});
      }
      if (!good) continue;
    }
    const std::size_t fewest = is_closed ? 3 : 2;
    if (cvs.size() < fewest || cvs.size() > kMaxCvs) {
      in.Fail(made.from->where,
              Status::Invalid("{}curve \"{}\" has {} points; expected {} to {}", is_closed ? "closed " : "",
                              made.from->name, cvs.size(), fewest, kMaxCvs));
      continue;
    }
    GraphEditor edit(graph);
    edit.Set(made.id, "curve", std::make_shared<const Curve>(cvs, is_closed));
    in.Fail(made.from->where, edit.Take());
    (*curves)[made.id.index] = std::move(cvs);
  }
}

}  // namespace kpsa::engine
