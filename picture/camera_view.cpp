// Which camera, lights and meshes a picture is of (picture/camera_picture.h).
#include "picture/camera_picture.h"

namespace kpsa::engine {
namespace {

bool IsLight(const NodeDef& def) {
  return def.FindAttribute("outColor") >= 0 && def.FindAttribute("outMatrix") >= 0;
}

CameraView::Light LightOf(const Graph& graph, NodeId node) {
  const NodeDef& def = graph.def(node);
  const DiffuseLight::Kind kind = def.name == "areaLight"     ? DiffuseLight::Kind::kArea
                                  : def.name == "sunLight"    ? DiffuseLight::Kind::kSun
                                  : def.name == "sphereLight" ? DiffuseLight::Kind::kBall
                                                              : DiffuseLight::Kind::kPoint;
  return {
      kind, {node, def.FindAttribute("outMatrix"), -1, -1}, {node, def.FindAttribute("outColor"), -1, -1}};
}

const Value& StructuralValue(const Graph& graph, NodeId node, const char* name) {
  const PlugRef plug{node, graph.def(node).FindAttribute(name), -1, -1};
  const Value* set = graph.FindValue(plug);
  return set != nullptr ? *set
                        : graph.def(node).attributes[static_cast<std::size_t>(plug.attribute)].default_value;
}

Index SizeOf(const Graph& graph, NodeId node, const char* name) {
  return static_cast<Index>(StructuralValue(graph, node, name).AsInt());
}

}  // namespace

Result<CameraView> FindCamera(const Rig& rig, const std::string& name) {
  const Graph& graph = *rig.graph;
  std::vector<std::string> cameras;
  std::optional<NodeId> camera;
  std::vector<NodeId> illuminations, lights;
  for (Index n = 0; n < graph.node_capacity(); ++n) {
    const NodeId node = graph.IdAt(n);
    if (!graph.IsAlive(node)) continue;
    const NodeDef& def = graph.def(node);
    if (def.name == "camera") {
      cameras.push_back(graph.name(node));
      if (graph.name(node) == name) camera = node;
    }
    if (def.name == "indirectIllumination") illuminations.push_back(node);
    if (IsLight(def)) lights.push_back(node);
  }
  if (!camera.has_value()) {
    if (cameras.empty()) return Status::Usage("{} has no camera", rig.path);
    return Status::Usage("no such camera{}; there is {}", DidYouMean(name, cameras),
                         fmt::join(cameras, ", "));
  }
  CameraView view;
  view.world_from_screen = {*camera, graph.def(*camera).FindAttribute("worldFromScreen"), -1, -1};
  std::optional<NodeId> illumination;
  for (NodeId node : illuminations) {
    const Connection* c =
        graph.FindConnection({node, graph.def(node).FindAttribute("worldFromScreen"), -1, -1});
    if (c == nullptr || !(c->source == view.world_from_screen)) continue;
    if (illumination.has_value()) {
      return Status::Usage("both {} and {} look through it", graph.name(*illumination), graph.name(node));
    }
    illumination = node;
  }
  if (!illumination.has_value()) {
    for (NodeId node : lights) view.lights.push_back(LightOf(graph, node));
    view.meshes = ShownMeshes(rig.scene);
    return view;
  }
  const NodeDef& def = graph.def(*illumination);
  view.irradiance = PlugRef{*illumination, def.FindAttribute("irradiance"), -1, -1};
  view.width = SizeOf(graph, *illumination, "width");
  view.height = SizeOf(graph, *illumination, "height");
  for (const Connection& c : graph.Inputs(*illumination)) {
    if (c.destination.attribute == def.FindAttribute("lightMatrix"))
      view.lights.push_back(LightOf(graph, c.source.node));
    if (c.destination.attribute != def.FindAttribute("points")) continue;
    for (std::size_t m = 0; m < rig.scene.meshes.size(); ++m) {
      if (rig.scene.meshes[m].points == c.source) view.meshes.push_back(m);
    }
  }
  const auto& carried =
      StructuralValue(graph, *illumination, "carriedMeshes").get<std::vector<std::int64_t>>();
  for (std::size_t i = 0; i < carried.size(); ++i) {
    view.carried.push_back({{*illumination, def.FindAttribute("pointIrradiance"), static_cast<int>(i), -1},
                            static_cast<std::size_t>(carried[i])});
  }
  return view;
}

CameraView AcceleratedView(const CameraView& view, const Rig& rig,
                           const std::vector<AppliedSubspace>& applied) {
  CameraView fast = view;
  for (const AppliedSubspace& one : applied) {
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      if (view.irradiance.has_value() && one.entry.points[p].points == *view.irradiance)
        fast.irradiance = one.Output(*rig.graph, p);
      for (CameraView::Carried& carried : fast.carried) {
        if (one.entry.points[p].points == carried.irradiance) carried.irradiance = one.Output(*rig.graph, p);
      }
    }
  }
  return fast;
}

}  // namespace kpsa::engine
