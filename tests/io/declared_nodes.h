// The node types of rigs, declared with all attributes that the rig reader sees, for tests that only build graphs.
#pragma once

#include "graph/node_registry.h"

namespace kpsa {

inline void AddDeclaredDeformer(NodeRegistry* registry, const char* name, const std::function<void(NodeBuilder&)>& more) {
  NodeBuilder b = registry->add(name, "declared for tests");
  b.points_in("points").per_geometry();
  b.in("envelope", 1.0, {.min = 0, .max = 1});
  b.structural("weights", Type::kAsset).per_geometry();
  b.structural("mesh", Type::kMesh).per_geometry();
  b.in("parentMatrix", Matrix4());
  b.structural("geometryMatrix", Matrix4());
  b.enumeration("space", {"world", "mesh"}, true);
  more(b);
  b.out("outPoints", Type::kPoints).per_geometry();
  b.compute([](ComputeContext&) {});
}

inline void AddDeclaredNodes(NodeRegistry* r) {
  const auto nothing = [](ComputeContext&) {};
  r->add("time", "t").in("time", 0.0, {.unit = Unit::kTime});
  r->add("transform", "t")
      .in("translate", Double3(), {.unit = Unit::kLength})
      .in("rotate", Double3(), {.unit = Unit::kAngle})
      .in("scale", Double3{1, 1, 1})
      .enumeration("rotateOrder", {"xyz", "yzx", "zxy", "xzy", "yxz", "zyx"}, true)
      .in("offsetParentMatrix", Matrix4())
      .in("parentMatrix", Matrix4())
      .structural("restMatrix", Matrix4())
      .out("matrix", Type::kMatrix)
      .out("worldMatrix", Type::kMatrix)
      .out("worldInverseMatrix", Type::kMatrix)
      .out("poseRotate", Type::kDouble3)
      .out("poseTranslate", Type::kDouble3)
      .out("swing", Type::kDouble3)
      .out("twist", Type::kDouble)
      .compute(nothing);
  NodeDef* transform = const_cast<NodeDef*>(r->Find("transform"));
  transform->attributes[static_cast<std::size_t>(transform->FindAttribute("poseRotate"))].unit = Unit::kAngle;
  r->add("clipTransform", "t").animation().in("time", 0.0, {.unit = Unit::kTime}).structural("keys", Type::kAsset).out("matrix", Type::kMatrix).compute(nothing);
  r->add("clipWeights", "t").animation().in("time", 0.0, {.unit = Unit::kTime}).structural("keys", Type::kAsset).out("output", Type::kDouble).array().compute(nothing);
  r->add("mesh", "t").structural("mesh", Type::kMesh).out("points", Type::kPoints).compute(nothing);
  AddDeclaredDeformer(r, "blendShape", [](NodeBuilder& b) {
    b.structural("targets", Type::kAsset).per_geometry();
    b.in("weight", 0.0).array();
  });
  AddDeclaredDeformer(r, "skinCluster", [](NodeBuilder& b) {
    b.structural("influences", Type::kAsset).per_geometry();
    b.in("matrix", Matrix4()).array();
    b.structural("bindPreMatrix", Matrix4()).array();
  });
  AddDeclaredDeformer(r, "transformGeometry", [](NodeBuilder& b) { b.in("matrix", Matrix4()); });
  AddDeclaredDeformer(r, "lattice", [](NodeBuilder& b) {
    b.structural("divisions", Value(std::vector<std::int64_t>{2, 5, 2}));
    b.enumeration("interpolation", {"linear", "bspline", "bernstein"}, true);
    b.structural("boxMin", Double3(), {.unit = Unit::kLength});
    b.structural("boxMax", Double3(), {.unit = Unit::kLength});
  });
  // A lattice's `points` are its cage; what it deforms has the common name, so the cage comes under another
  AddDeclaredDeformer(r, "cluster", [](NodeBuilder& b) {
    b.in("matrix", Matrix4());
    b.in("bindPreMatrix", Matrix4());
  });
  AddDeclaredDeformer(r, "softMod", [](NodeBuilder& b) {
    b.in("matrix", Matrix4());
    b.structural("falloffCenter", Double3(), {.unit = Unit::kLength});
    b.structural("falloffRadius", 0.05, {.min = 0, .unit = Unit::kLength});
    b.enumeration("falloffCurve", {"smooth", "linear", "none"}, true);
  });
  AddDeclaredDeformer(r, "deltaMush", [](NodeBuilder& b) {
    b.structural("iterations", 10, {.min = 0, .max = 200});
    b.structural("smoothingStep", 0.5, {.min = 0, .max = 1});
    b.structural("pinBorderVertices", Type::kBool);
  });
}

}  // namespace kpsa
