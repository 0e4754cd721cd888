// Skin weights and weight maps of the face.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::engine::scenes {
namespace {

// Share of the jaw in a point of the skin outside the mouth: by its angle about the jaw's axis, from the
// mouth's line down to the chin, ending at the throat.
double JawField(Double3 p) {
  const double degrees = Atan2(p.y - kReferenceJaw.y, p.z - kReferenceJaw.z) * 180 / kPi;
  return Smooth(-10, -40, degrees) * Smooth(-82, -58, degrees) * Smooth(-1.0, 2.5, p.z);
}

}  // namespace

std::vector<std::array<double, kJointCount>> FaceWeights(const HeadDesign& design, const HeadShape& shape) {
  const std::size_t count = shape.points.size();
  std::vector<double> jaw(count), eye(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    jaw[i] = JawField(design.regions[kJawRegion].ToReference(shape.points[i]));
  }
  // The mouth's rings lead from that field to the lips, which follow one side alone
  const int n = static_cast<int>(shape.mouth_rings[0].size()), half = n / 2;
  for (std::size_t ring = 1; ring < shape.mouth_rings.size(); ++ring) {
    const double inner = std::min(1.0, static_cast<double>(ring) / shape.border_ring);
    for (int k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(shape.mouth_rings[ring][static_cast<std::size_t>(k)]);
      const int from_corner = std::min(std::min(k % half, half - k % half), 8);
      const double side = shape.lip[i] * Smooth(-1, 8, from_corner);
      jaw[i] +=
          (0.46 - 0.54 * std::min(side, 0.0) - 0.46 * std::max(side, 0.0) - jaw[i]) * Smooth(0, 1, inner);
    }
  }
  // Lids follow the eyeball a little
  for (std::size_t ring = 3; ring < shape.eye_rings.size(); ++ring) {
    const int m = static_cast<int>(shape.eye_rings[ring].size());
    for (int k = 0; k < m; ++k) {
      const double middle = Sin(kPi * (k % (m / 2)) / (m / 2.0));
      const double share =
          (k <= m / 2 ? 0.16 : 0.08) * middle * std::min(1.0, (static_cast<double>(ring) - 2) / 3);
      const auto i = static_cast<std::size_t>(shape.eye_rings[ring][static_cast<std::size_t>(k)]);
      eye[i] = share;
      eye[static_cast<std::size_t>(shape.mirror[i])] = share;
    }
  }
  std::vector<std::array<double, kJointCount>> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = design.regions[kThroatRegion].ToReference(shape.points[i]);
    const double above_base = Smooth(0, 4.2, shape.points[i].y);
    const double head = Smooth(3.2, 11.2, p.y + 0.27 * p.z) * above_base;
    const double on_head = std::max(head, jaw[i]);  // the chin belongs to the head, low as it is
    std::array<double, kJointCount>& w = out[i];
    w[kRoot] = (1 - above_base) * (1 - jaw[i]);
    w[kNeck] = std::max(0.0, 1 - on_head - w[kRoot]);
    w[kJaw] = jaw[i] * on_head;
    w[p.x >= 0 ? kEyeL : kEyeR] = eye[i] * on_head;
    w[kHead] = std::max(0.0, on_head - w[kJaw] - eye[i] * on_head);
    if (design.joints.size() > kEarL) {
      const double ear = Smooth(0.2, 1.0, shape.ear[i]) * w[kHead];
      w[kHead] -= ear;
      w[p.x >= 0 ? kEarL : kEarR] = ear;
    }
  }
  return out;
}

std::map<std::string, std::vector<double>> FaceWeightMaps(const HeadDesign& design, const HeadShape& shape) {
  const std::size_t count = shape.points.size();
  std::map<std::string, std::vector<double>> maps;
  for (const char* name : {"upperLip", "lowerLip", "brow.L", "brow.R", "mush", "jawCage", "skullCage"}) {
    maps[name].assign(count, 0.0);
  }
  const auto in = [&](RegionName region, std::size_t i) {
    return design.regions[region].ToReference(shape.points[i]);
  };
  std::vector<double> upper(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 mouth = in(kMouthRegion, i), brow = in(kBrowRegion, i), skull = in(kSkullRegion, i);
    upper[i] = Smooth(kReferenceMouth.y - 0.5, kReferenceMouth.y + 0.5, mouth.y);
    const double face = Smooth(2.0, 5.0, brow.z), ear = shape.ear[i];
    maps["brow.L"][i] = Smooth(-0.4, 0.6, brow.x) * Smooth(19.3, 20.2, brow.y) * face;
    maps["brow.R"][i] = Smooth(-0.4, 0.6, -brow.x) * Smooth(19.3, 20.2, brow.y) * face;
    maps["mush"][i] = 1 - 0.6 * ear;
    const Double3 jaw = in(kJawRegion, i);
    maps["jawCage"][i] =
        Smooth(16.5, 14.0, jaw.y) * Smooth(4.0, 7.0, jaw.y) * Smooth(-3.0, 1.0, jaw.z) * (1 - ear);
    maps["skullCage"][i] = Smooth(19.5, 22.5, skull.y) * (1 - ear);
  }
  for (std::size_t ring = 1; ring < shape.mouth_rings.size(); ++ring) {
    for (int point : shape.mouth_rings[ring]) {
      const auto i = static_cast<std::size_t>(point);
      upper[i] = 0.5 + 0.5 * shape.lip[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = in(kMouthRegion, i);
    const double near = Bump(p.x, 5.0) * Bump(p.y - kReferenceMouth.y, 4.0) * Smooth(4.0, 6.5, p.z);
    maps["upperLip"][i] = upper[i] * near;
    maps["lowerLip"][i] = (1 - upper[i]) * near;
  }
  const auto eye_ring = [&](std::size_t ring, const auto& change) {
    for (int i : shape.eye_rings[ring]) {
      for (int j : {i, shape.mirror[static_cast<std::size_t>(i)]}) change(static_cast<std::size_t>(j));
    }
  };
  // Thin edges keep their shape: less smoothing at the lids' edges and inside the lips
  const auto edge = static_cast<std::size_t>(shape.lid_ring),
             contact = static_cast<std::size_t>(shape.contact_ring);
  for (std::size_t ring = edge - 1; ring < shape.eye_rings.size(); ++ring)
    eye_ring(ring, [&](std::size_t i) { maps["mush"][i] = 0.35; });
  for (std::size_t ring = contact; ring < shape.mouth_rings.size(); ++ring) {
    for (int i : shape.mouth_rings[ring]) maps["mush"][static_cast<std::size_t>(i)] = 0.5;
  }
  if (!design.production) return maps;
  // What slides over the muscles: not the neck's edge, ears, lids and the inside of the mouth
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = in(kThroatRegion, i), eye = in(kEyeRegion, i), mouth = in(kMouthRegion, i);
    maps["flesh"].push_back(Smooth(0.5, 5.0, p.y) * (1 - shape.ear[i]));
    const Double3 brow = in(kBrowRegion, i);
    maps["muscles"].push_back(maps["flesh"][i] * Smooth(-7, -1, p.z) * Smooth(27.5, 24.0, brow.y));
    const double front = Smooth(2.0, 4.5, eye.z) * (1 - shape.ear[i]);
    maps["orbit.L"].push_back(Ball(eye, {3.2, 18.6, 7.2}, {3.4, 3.0, 4.5}) * Smooth(-0.2, 0.8, eye.x) *
                              front);
    maps["orbit.R"].push_back(Ball(eye, {-3.2, 18.6, 7.2}, {3.4, 3.0, 4.5}) * Smooth(-0.2, 0.8, -eye.x) *
                              front);
    maps["muzzle"].push_back(Ball(mouth, {0, 12.0, 9.0}, {5.2, 4.4, 5.5}));
  }
  for (std::size_t ring = 1; ring < shape.eye_rings.size(); ++ring) {
    const double left = 1 - Smooth(0, shape.lid_ring - 1, static_cast<double>(ring));
    eye_ring(ring, [&](std::size_t i) { maps["flesh"][i] *= left, maps["muscles"][i] *= left; });
  }
  // Nor is the lining of the mouth smoothed, which is folded
  for (std::size_t ring = contact; ring < shape.mouth_rings.size(); ++ring) {
    const double smoothed = ring == contact ? 0.5 : ring == contact + 1 ? 0.25 : 0;
    for (int i : shape.mouth_rings[ring]) {
      maps["mush"][static_cast<std::size_t>(i)] = smoothed;
      maps["flesh"][static_cast<std::size_t>(i)] *= 0.6;
      maps["muscles"][static_cast<std::size_t>(i)] *= 0.6;
    }
  }
  return maps;
}

}  // namespace kpsa::engine::scenes
