// transformGeometry: takes a mesh that no skin moves to world space.
#include "base/matrix.h"
#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

void ComputeTransformGeometry(DeformerContext<In<"matrix", Matrix4>> c) {
  const Matrix4& m = c.get<"matrix">();
  const ConstPointsView& in = c.get<"inPoints">();
  const PointsView& out = c.out<"outPoints">();
  c.For(in.count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 p = TransformPoint(m, {in.x[i], in.y[i], in.z[i]});
      out.x[i] = static_cast<float>(p.x);
      out.y[i] = static_cast<float>(p.y);
      out.z[i] = static_cast<float>(p.z);
    }
  });
}

void DeclareMatrix(NodeBuilder& b) { b.in("matrix", Matrix4(), {.doc = "the mesh node's world matrix"}); }

}  // namespace

KPSA_NODES(transform_geometry, registry) {
  AddDeformer<ComputeTransformGeometry>(registry,
                                        {.name = "transformGeometry",
                                         .doc = "Takes the points of a mesh without a skin to world space.",
                                         .own = DeclareMatrix})
      .cost(20, 2)
      .touches("inPoints", nullptr);  // to another space goes every point
}

}  // namespace kpsa::engine
