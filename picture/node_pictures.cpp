#include "picture/node_pictures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

#include "base/scalar_math.h"
#include "files/file.h"
#include "files/png.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "picture/image.h"
#include "picture/node_examples.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr int kSide = 160, kSamples = 3;  // of one half: pixels, and samples along a pixel's edge
constexpr double kMargin = 0.06;          // of a half

struct DrawnShape {
  const ExampleShape* shape = nullptr;
  std::vector<Double3> points;
  Double3 light, dark;  // the colours of its squares, sRGB 0 .. 1
};
using DrawnHalf = std::vector<DrawnShape>;

// From the right and above: x to the right, y up, z towards the eye.
Double3 Seen(Double3 p) {
  const double turn = 0.5, tilt = 0.42;
  const Double3 q{Cos(turn) * p.x - Sin(turn) * p.z, p.y, Sin(turn) * p.x + Cos(turn) * p.z};
  return {q.x, Cos(tilt) * q.y - Sin(tilt) * q.z, Sin(tilt) * q.y + Cos(tilt) * q.z};
}

// Where the picture is: pixels = (x - left) * scale.
struct PictureFrame {
  double middle_x = 0, middle_y = 0, scale = 1;
};

PictureFrame FrameAround(const DrawnHalf& before, const DrawnHalf& after) {
  const double inf = std::numeric_limits<double>::infinity();
  double low[2] = {inf, inf}, high[2] = {-inf, -inf};
  for (const DrawnHalf* half : {&before, &after}) {
    for (const DrawnShape& surface : *half) {
      for (const Double3& p : surface.points) {
        const Double3 seen = Seen(p);
        for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], seen[i]), high[i] = std::max(high[i], seen[i]);
      }
    }
  }
  const double size = std::max({high[0] - low[0], high[1] - low[1], 1e-6});
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, kSide * kSamples * (1 - 2 * kMargin) / size};
}

// A renderer of its own: picture/picture.h's rays (Embree) differ between processors, and a test compares bytes.
class Canvas {
 public:
  Canvas() : depth_(kCells * kCells, -1e30), color_(kCells * kCells, Double3{1, 1, 1}) {}

  // A flat triangle, lit from the upper left in front, from both sides.
  void Draw(const Double3 world[3], const PictureFrame& frame, Double3 color) {
    Double3 at[3];
    for (int k = 0; k < 3; ++k) {
      const Double3 seen = Seen(world[k]);
      at[k] = {kCells / 2.0 + (seen.x - frame.middle_x) * frame.scale,
               kCells / 2.0 - (seen.y - frame.middle_y) * frame.scale, seen.z};
    }
    const Double3 normal = Cross(Seen(world[1] - world[0]), Seen(world[2] - world[0]));
    const double size = Length(normal);
    const double area = (at[1].x - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (at[1].y - at[0].y);
    if (!(size > 0) || !(std::fabs(area) > 1e-9)) return;
    const Double3 light{-0.42, 0.56, 0.71};
    const double shade = 0.45 + 0.55 * std::fabs(Dot(normal, light)) / size;
    const auto range = [&](int axis) {
      const double low = std::min({at[0][axis], at[1][axis], at[2][axis]});
      const double high = std::max({at[0][axis], at[1][axis], at[2][axis]});
      return std::pair(static_cast<int>(std::clamp(low, 0.0, double{kCells})),
                       static_cast<int>(std::clamp(high + 1, 0.0, double{kCells})));
    };
    const auto [left, right] = range(0);
    const auto [top, bottom] = range(1);
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double v = ((px - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (py - at[0].y)) / area;
        const double w = ((at[1].x - at[0].x) * (py - at[0].y) - (px - at[0].x) * (at[1].y - at[0].y)) / area;
        if (v < 0 || w < 0 || v + w > 1) continue;
        const double z = at[0].z + v * (at[1].z - at[0].z) + w * (at[2].z - at[0].z);
        const std::size_t cell = static_cast<std::size_t>(y) * kCells + static_cast<std::size_t>(x);
        if (z <= depth_[cell]) continue;
        depth_[cell] = z;
        color_[cell] = color * shade;
      }
    }
  }
  void CopyTo(Image* image, int left) const {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        Double3 sum;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const int sx = x * kSamples + s % kSamples, sy = y * kSamples + s / kSamples;
          sum = sum + color_[static_cast<std::size_t>(sy) * kCells + static_cast<std::size_t>(sx)];
        }
        Rgb rgb;
        for (int i = 0; i < 3; ++i) {
          // Few shades: the pictures are small files
          const double level = sum[i] / (kSamples * kSamples) * 51;
          rgb[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(5 * static_cast<int>(level + 0.5));
        }
        image->Set(left + x, y, rgb);
      }
    }
  }

 private:
  static constexpr int kCells = kSide * kSamples;
  std::vector<double> depth_;
  std::vector<Double3> color_;
};

void DrawHalf(const DrawnHalf& half, const PictureFrame& frame, Image* image, int left) {
  Canvas canvas;
  for (const DrawnShape& surface : half) {
    const std::vector<Index>& triangles = surface.shape->mesh->data().triangles;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      const Double3 corners[3] = {surface.points[triangles[t]], surface.points[triangles[t + 1]],
                                  surface.points[triangles[t + 2]]};
      canvas.Draw(corners, frame, surface.shape->dark[t / 3] ? surface.dark : surface.light);
    }
  }
  canvas.CopyTo(image, left);
}

// The example's graph at rest and in its pose.
Status EvaluateExample(const NodeRegistry& registry, const NodeExample& example, DrawnHalf* before,
                       DrawnHalf* after) {
  Graph graph(registry);
  GraphEditor edit(&graph);
  const NodeId mesh = edit.Add("mesh", "m"), node = edit.Add(example.type, "d");
  edit.Set(mesh, "mesh", example.shape.mesh);
  edit.Set(node, "mesh", 0, example.shape.mesh);
  for (const NodeExample::Node& other : example.nodes) edit.Add(other.type, other.name);
  const auto plug = [&](const std::string& name) {
    const Result<PlugRef> found = graph.FindPlug(name);
    edit.Check(found.status());
    return found.ok() ? *found : PlugRef();
  };
  for (const auto& [name, value] : example.settings) {
    const PlugRef to = plug(name);
    if (edit.ok()) edit.Check(graph.Set(to, value));
  }
  for (const auto& [from, to] : example.connections) {
    const PlugRef source = plug(from), destination = plug(to);
    edit.Connect(source, destination);
  }
  edit.Connect(plug(example.input), plug("d.inPoints[0]"));
  Request request;
  request.outputs.push_back({plug(example.input), {}});
  request.outputs.push_back({plug("d.outPoints[0]"), {}});
  if (!example.driver_points.empty()) request.outputs.push_back({plug(example.driver_points), {}});
  for (const auto& [name, value] : example.pose) request.varying.push_back(plug(name));
  KPSA_RETURN_IF_ERROR(edit.Take());
  Compiler compiler;
  const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(graph, request);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  const auto surface = [&](Index output, const ExampleShape& shape, Double3 light, Double3 dark) {
    const ConstPointsView view = evaluator.Points(output);
    DrawnShape made{&shape, {}, light, dark};
    for (std::size_t i = 0; i < view.count; ++i) made.points.push_back({view.x[i], view.y[i], view.z[i]});
    return made;
  };
  const Double3 warm{1, 0.84, 0.62}, brown{0.93, 0.55, 0.3}, cool{0.82, 0.9, 0.98}, blue{0.58, 0.72, 0.9};
  if (request.outputs.size() > 2) before->push_back(surface(2, example.driver, cool, blue));
  for (std::size_t i = 0; i < example.pose.size(); ++i) {
    const Result<PlugHandle> handle = evaluator.FindVarying(graph, request.varying[i]);
    if (!handle.ok()) return handle.status();
    KPSA_RETURN_IF_ERROR(evaluator.Set(*handle, example.pose[i].second));
  }
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  if (request.outputs.size() > 2) after->push_back(surface(2, example.driver, cool, blue));
  before->push_back(surface(0, example.shape, warm, brown));
  after->push_back(surface(1, example.shape, warm, brown));
  return {};
}

Result<NodePicture> DrawExample(const NodeRegistry& registry, const NodeExample& example) {
  DrawnHalf before, after;
  const Status status = EvaluateExample(registry, example, &before, &after);
  if (!status.ok()) return Status::Evaluation("the picture of {}: {}", example.type, status.ToString());
  const PictureFrame frame = FrameAround(before, after);
  Image image(2 * kSide, kSide, {255, 255, 255});
  DrawHalf(before, frame, &image, 0);
  DrawHalf(after, frame, &image, kSide);
  image.Fill(kSide, 8, 1, kSide - 16, {220, 220, 220});
  DrawText(image, 5, 5, 1, {90, 90, 90}, "before");
  DrawText(image, kSide + 6, 5, 1, {90, 90, 90}, "after");
  Result<std::vector<std::uint8_t>> png = EncodePng(image.width, image.height, image.rgb);
  if (!png.ok()) return png.status();
  return NodePicture{example.type, std::move(*png)};
}

}  // namespace

bool HasNodePicture(const std::string& type) {
  static const std::vector<NodeExample>* examples = new std::vector<NodeExample>(NodeExamples());
  return std::any_of(examples->begin(), examples->end(),
                     [&](const NodeExample& example) { return example.type == type; });
}

Result<std::vector<NodePicture>> DrawNodePictures(const NodeRegistry& registry) {
  std::vector<NodePicture> pictures;
  for (const NodeExample& example : NodeExamples()) {
    Result<NodePicture> picture = DrawExample(registry, example);
    if (!picture.ok()) return picture.status();
    pictures.push_back(std::move(*picture));
  }
  return pictures;
}

Status WriteNodePictures(const NodeRegistry& registry, const std::string& folder, bool force) {
  const Result<std::vector<NodePicture>> pictures = DrawNodePictures(registry);
  if (!pictures.ok()) return pictures.status();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Status::Invalid("the folder {} cannot be made: {}", folder, error.message());
  const auto path = [&](const NodePicture& picture) { return folder + "/" + picture.type + ".png"; };
  for (const NodePicture& picture : *pictures)
    KPSA_RETURN_IF_ERROR(OutputFile::Create(path(picture), force).status());
  for (const NodePicture& picture : *pictures)
    KPSA_RETURN_IF_ERROR(WriteFileAtomically(path(picture), force, picture.png));
  return {};
}

}  // namespace kpsa::engine
