// camera, pointLight, sphereLight, areaLight, sunLight: what a picture is taken with. Each hands on its frame
// and its strength.
#include "base/scalar_math.h"
#include "nodes/illumination.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

NodeBuilder AddLight(NodeRegistry& registry, const char* name, const char* doc, const char* intensity) {
  NodeBuilder b = registry.add(name, doc);
  b.category("light");
  b.in("matrix", Matrix4(), {.doc = "the light's world matrix"}).world_place();
  b.in("color", Double3{1, 1, 1}, {.min = 0, .doc = "linear red, green, blue"});
  b.in("intensity", 1.0, {.min = 0, .doc = intensity});
  return b;
}

void FinishLight(NodeBuilder& b) {
  b.out("outColor", Type::kDouble3, "color times intensity");
  b.compute_for({"outColor"}, {"color", "intensity"},
                [](Double3 color, double intensity) { return color * intensity; });
}

void PassMatrix(NodeBuilder& b) {
  b.out("outMatrix", Type::kMatrix, "the light's frame");
  b.compute_for({"outMatrix"}, {"matrix"}, [](const Matrix4& matrix) { return matrix; });
}

}  // namespace

KPSA_NODES(lights, registry) {
  NodeBuilder point = AddLight(registry, "pointLight", "Light from a point, in all directions.",
                               "radiant intensity: irradiance at 1 m");
  FinishLight(point);
  PassMatrix(point);

  NodeBuilder sphere = AddLight(registry, "sphereLight", "Light from a ball, with soft shadows.",
                                "radiant intensity: irradiance at 1 m, from afar");
  sphere.in("radius", 0.1, {.min = 0, .unit = Unit::kLength, .doc = "of the ball"});
  FinishLight(sphere);
  sphere.out("outMatrix", Type::kMatrix, "the light's frame, scaled to its size");
  sphere.compute_for({"outMatrix"}, {"matrix", "radius"}, [](const Matrix4& matrix, double radius) {
    return matrix * Scaling({radius, radius, radius});
  });

  NodeBuilder area = AddLight(registry, "areaLight", "Light from a rectangle, along its -Z.", "radiance");
  area.in("width", 1.0, {.min = 0, .unit = Unit::kLength, .doc = "along the frame's X"});
  area.in("height", 1.0, {.min = 0, .unit = Unit::kLength, .doc = "along the frame's Y"});
  FinishLight(area);
  area.out("outMatrix", Type::kMatrix, "the light's frame, scaled to its size");
  area.compute_for({"outMatrix"}, {"matrix", "width", "height"},
                   [](const Matrix4& matrix, double width, double height) {
                     return matrix * Scaling({width, height, 1});
                   });

  NodeBuilder sun = AddLight(registry, "sunLight", "Light from far away, along the frame's -Z.",
                             "irradiance of a surface that faces it");
  FinishLight(sun);
  PassMatrix(sun);

  registry.add("camera", "A perspective camera that looks along its -Z, up along its Y.")
      .category("light")
      .in("matrix", Matrix4(), {.doc = "the camera's world matrix"})
      .world_place()
      .in("verticalFieldOfView", 0.7,
          {.min = 1e-3, .max = 3.1, .unit = Unit::kAngle, .doc = "from the lower edge to the upper"})
      .in("aspectRatio", 1.0, {.min = 1e-3, .max = 1e3, .doc = "width of the picture by its height"})
      .out("worldFromScreen", Type::kMatrix,
           "takes (x, y, -1) with x and y from -1 to 1, y up, to the direction of a ray; its translation is "
           "the eye")
      .compute([](const Matrix4& matrix, double angle, double aspect) {
        double sine, cosine;
        SinCos(angle / 2, &sine, &cosine);
        return matrix * Scaling({aspect * sine / cosine, sine / cosine, 1});
      });
}

}  // namespace kpsa::engine
