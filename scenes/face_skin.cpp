// Skin weights and weight maps of the face.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::scenes {
namespace {

constexpr Double3 kJawJoint = {0, 14.4, 0.6};

// Share of the jaw in a point of the skin outside the mouth: by its angle about the jaw's axis, from the
// mouth's line down to the chin, ending at the throat.
double JawField(Double3 p) {
  const double degrees = Atan2(p.y - kJawJoint.y, p.z - kJawJoint.z) * 180 / kPi;
  return Smooth(-10, -40, degrees) * Smooth(-82, -58, degrees) * Smooth(-1.0, 2.5, p.z);
}

}  // namespace

const std::vector<JointRest>& FaceJoints() {
  static const std::vector<JointRest> joints = {
      {"root", -1, {0, 0, 0}},          {"neck", kRoot, {0, 1.5, -2.6}},
      {"head", kNeck, {0, 10.5, -2.0}}, {"jaw", kHead, kJawJoint},
      {"eye.L", kHead, kEyeCenter},     {"eye.R", kHead, {-kEyeCenter.x, kEyeCenter.y, kEyeCenter.z}}};
  return joints;
}

std::vector<std::array<double, kJointCount>> FaceWeights(const HeadShape& shape) {
  const std::size_t count = shape.points.size();
  std::vector<double> jaw(count), eye(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) jaw[i] = JawField(shape.points[i]);
  // The mouth's rings lead from that field to the lips, which follow one side alone
  const int n = static_cast<int>(shape.mouth_rings[0].size()), half = n / 2;
  for (std::size_t ring = 1; ring < shape.mouth_rings.size(); ++ring) {
    const double inner = std::min(1.0, static_cast<double>(ring) / shape.border_ring);
    for (int k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(shape.mouth_rings[ring][static_cast<std::size_t>(k)]);
      const int from_corner = std::min(std::min(k % half, half - k % half), 4);
      const double side = shape.lip[i] * Smooth(0, 4, from_corner);
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
    const Double3 p = shape.points[i];
    const double above_base = Smooth(0, 4.2, p.y);
    const double head = Smooth(3.2, 11.2, p.y + 0.27 * p.z) * above_base;
    const double on_head = std::max(head, jaw[i]);  // the chin belongs to the head, low as it is
    std::array<double, kJointCount>& w = out[i];
    w[kRoot] = (1 - above_base) * (1 - jaw[i]);
    w[kNeck] = std::max(0.0, 1 - on_head - w[kRoot]);
    w[kJaw] = jaw[i] * on_head;
    w[p.x >= 0 ? kEyeL : kEyeR] = eye[i] * on_head;
    w[kHead] = std::max(0.0, on_head - w[kJaw] - eye[i] * on_head);
  }
  return out;
}

std::map<std::string, std::vector<double>> FaceWeightMaps(const HeadShape& shape) {
  const std::size_t count = shape.points.size();
  std::map<std::string, std::vector<double>> maps;
  for (const char* name : {"upperLip", "lowerLip", "brow.L", "brow.R", "mush", "jawCage", "skullCage"}) {
    maps[name].assign(count, 0.0);
  }
  std::vector<double> upper(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = shape.points[i];
    upper[i] = Smooth(kMouthCenter.y - 0.5, kMouthCenter.y + 0.5, p.y);
    const double face = Smooth(2.0, 5.0, p.z), ear = shape.ear[i];
    maps["brow.L"][i] = Smooth(-0.4, 0.6, p.x) * Smooth(19.3, 20.2, p.y) * face;
    maps["brow.R"][i] = Smooth(-0.4, 0.6, -p.x) * Smooth(19.3, 20.2, p.y) * face;
    maps["mush"][i] = 1 - 0.6 * ear;
    maps["jawCage"][i] = Smooth(16.5, 14.0, p.y) * Smooth(4.0, 7.0, p.y) * Smooth(-3.0, 1.0, p.z) * (1 - ear);
    maps["skullCage"][i] = Smooth(19.5, 22.5, p.y) * (1 - ear);
  }
  for (std::size_t ring = 1; ring < shape.mouth_rings.size(); ++ring) {
    for (int point : shape.mouth_rings[ring]) {
      const auto i = static_cast<std::size_t>(point);
      upper[i] = 0.5 + 0.5 * shape.lip[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = shape.points[i];
    const double near = Bump(p.x, 5.0) * Bump(p.y - kMouthCenter.y, 4.0) * Smooth(4.0, 6.5, p.z);
    maps["upperLip"][i] = upper[i] * near;
    maps["lowerLip"][i] = (1 - upper[i]) * near;
  }
  // Thin edges keep their shape: less smoothing at the lids' edges and inside the lips
  for (std::size_t ring = static_cast<std::size_t>(shape.lid_ring) - 1; ring < shape.eye_rings.size();
       ++ring) {
    for (int i : shape.eye_rings[ring]) {
      for (int j : {i, shape.mirror[static_cast<std::size_t>(i)]})
        maps["mush"][static_cast<std::size_t>(j)] = 0.35;
    }
  }
  for (std::size_t ring = static_cast<std::size_t>(shape.contact_ring); ring < shape.mouth_rings.size();
       ++ring) {
    for (int i : shape.mouth_rings[ring]) maps["mush"][static_cast<std::size_t>(i)] = 0.5;
  }
  return maps;
}

}  // namespace kpsa::scenes
