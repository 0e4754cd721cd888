// The parts of the head with rings of their own: eyes, mouth, nostrils, ears.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/head_builder.h"

namespace kpsa::scenes {

namespace {

// Corners and lids of the left eye: k = 0 the inner corner, n / 2 the outer one, first along the upper lid.
// `open` scales the height, `wide` the width; the point lies on a flattened sphere of radius rho.
Double3 LidPoint(int k, int n, double wide, double open, double rho) {
  const int half = n / 2;
  const bool upper = k <= half;
  const double even = upper ? static_cast<double>(k) / half : static_cast<double>(n - k) / half;
  const double s = 0.45 * even + 0.55 * (0.5 - 0.5 * Cos(kPi * even));
  const double x = -1.30 + 2.62 * s;
  const double skew = upper ? s + 0.16 * s * (1 - s) : s - 0.22 * s * (1 - s);
  const double arch = 4 * skew * (1 - skew), roundness = std::sqrt(arch);
  const double height =
      upper ? 0.53 * (0.55 * arch + 0.45 * roundness) : -0.44 * (0.6 * arch + 0.4 * roundness);
  const double line = -0.14 * (1 - s) + 0.06 * s;
  const Double3 p = {x * wide, line + height * open, 0};
  const double inside = rho * rho - 0.86 * p.x * p.x - p.y * p.y;
  return kEyeCenter + Double3{p.x, p.y, std::sqrt(std::max(inside, 0.04))};
}

struct LidRing {
  double wide, open, rho;
};
constexpr LidRing kLidRings[] = {{1.16, 1.62, kEyeRadius + 0.20}, {1.05, 1.22, kEyeRadius + 0.20},
                                 {1.0, 1.0, kEyeRadius + 0.15},   {0.985, 0.94, kEyeRadius + 0.03},
                                 {1.01, 1.1, kEyeRadius + 0.035}, {1.02, 1.7, kEyeRadius + 0.04}};
constexpr int kSkinRingsOfEye = 3;

}  // namespace

void HeadBuilder::MakeEyes() {
  const int mid = kEyeRow + 3;
  std::vector<int> loop = Loop(kEyeRow, kEyeRow + 6, kEyeColumn0, kEyeColumn1, mid, kEyeColumn0);
  std::reverse(loop.begin() + 1, loop.end());  // from the inner corner over the upper lid: clockwise
  const int n = static_cast<int>(loop.size());
  std::vector<std::vector<int>> rings = {loop};
  for (int ring = 1; ring <= kSkinRingsOfEye + static_cast<int>(std::size(kLidRings)); ++ring) {
    std::vector<int> points;
    for (int k = 0; k < n; ++k) {
      const int lid = ring - kSkinRingsOfEye - 1;
      if (lid < 0) {
        const double t = static_cast<double>(ring) / (kSkinRingsOfEye + 1);
        const LidRing& first = kLidRings[0];
        const Double3 inner = LidPoint(k, n, first.wide, first.open, first.rho);
        points.push_back(AddPair(ProjectToHead(At(loop[Size(k)]) * (1 - t) + inner * t)));
      } else {
        points.push_back(
            AddPair(LidPoint(k, n, kLidRings[lid].wide, kLidRings[lid].open, kLidRings[lid].rho)));
        if (lid == 0) At(points.back()) = ProjectToHead(At(points.back()));
        if (lid == 1 && k < n / 2)
          At(points.back()).z -= 0.07 * Sin(2 * kPi * k / n);  // the upper lid's fold
        if (lid >= 1) Pin(points.back());
      }
    }
    rings.push_back(points);
  }
  for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
    for (int k = 0; k < n; ++k) {
      const int next = (k + 1) % n;
      QuadPair(rings[ring][Size(next)], rings[ring][Size(k)], rings[ring + 1][Size(k)],
               rings[ring + 1][Size(next)]);
    }
  }
  shape_.eye_rings = rings;
  shape_.lid_ring = kSkinRingsOfEye + 3;
  for (int r = kEyeRow; r < kEyeRow + 6; ++r) {
    for (int c = kEyeColumn0; c < kEyeColumn1; ++c) {
      hole_[Size(r * kColumns + c)] = hole_[Size(r * kColumns + (kColumns - 1 - c))] = true;
    }
  }
}

namespace {

// The lines of the mouth at s = -1 .. 1 (x = s * half width).
double MouthLine(double s) {
  return -0.05 * Bump(s, 0.3) + 0.05 * Bump(std::fabs(s) - 0.4, 0.45) - 0.07 * s * s;
}
double UpperBorder(double s) {
  const double a = std::fabs(s), side = std::max(1 - a, 0.0);
  return 0.72 * std::sqrt(side) * (0.35 + 0.65 * side) / (0.35 + 0.65 * 0.8) * 1.05 - 0.14 * Bump(s, 0.26);
}
double LowerBorder(double s) {
  const double c = std::max(1 - s * s, 0.0);
  return -0.92 * (0.55 * c + 0.45 * c * c) - 0.02;
}

constexpr int kSkinRingsOfMouth = 3;
constexpr int kMouthRings = 12;  // with the block's border

}  // namespace

void HeadBuilder::MakeMouth() {
  std::vector<int> loop =
      Loop(kMouthRow, kMouthRow + 6, -kMouthColumn, kMouthColumn, kMouthRow + 3, -kMouthColumn);
  std::reverse(loop.begin() + 1, loop.end());
  const int n = static_cast<int>(loop.size()), half = n / 2;
  std::vector<std::vector<int>> rings = {loop};
  for (int ring = 1; ring < kMouthRings; ++ring) {
    std::vector<int> points;
    for (int k = 0; k < n; ++k) points.push_back(Add({}));
    for (int k = 0; k < n; ++k) {
      const int twin = k <= half ? half - k : n + half - k;
      shape_.mirror[Size(points[Size(k)])] = points[Size(twin)];
    }
    rings.push_back(points);
  }
  shape_.mouth_rings = rings;
  shape_.border_ring = kSkinRingsOfMouth + 1;
  shape_.contact_ring = kSkinRingsOfMouth + 4;
  FinishMouth();
  for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
    for (int k = 0; k < n; ++k) {
      const int next = (k + 1) % n;
      Quad(rings[ring][Size(next)], rings[ring][Size(k)], rings[ring + 1][Size(k)],
           rings[ring + 1][Size(next)]);
    }
  }
  const std::vector<int>& last = rings.back();  // the pocket's end
  for (int k = 0; k < half; ++k) {
    const int a = last[Size(k)], b = last[Size(k + 1)];
    const int c = last[Size((n - k - 1) % n)], d = last[Size((n - k) % n)];
    if (k == 0) {
      Quad(b, a, c, c);
    } else if (k == half - 1) {
      Quad(b, a, d, d);
    } else {
      Quad(b, a, d, c);
    }
  }
  for (int r = kMouthRow; r < kMouthRow + 6; ++r) {
    for (int c = -kMouthColumn; c < kMouthColumn; ++c) {
      hole_[Size(r * kColumns + (c + kColumns) % kColumns)] = true;
    }
  }
}

// Places the rings of the mouth between the block's border, as it is now, and the lines of the lips.
void HeadBuilder::FinishMouth() {
  const std::vector<std::vector<int>>& rings = shape_.mouth_rings;
  const int n = static_cast<int>(rings[0].size()), half = n / 2;
  for (int k = 0; k < n; ++k) {
    const bool upper = k > 0 && k < half, corner = k == 0 || k == half;
    const double even = (k <= half ? 2.0 * k / half : 2.0 * (n - k) / half) - 1;
    const double s = 0.5 * even + 0.5 * Sin(even * kPi / 2);
    const double side = corner ? 0 : upper ? 1 : -1;
    const double x = s * kMouthHalfWidth;
    const double line = kMouthCenter.y + MouthLine(s);
    const double open = corner ? 0 : upper ? UpperBorder(s) : LowerBorder(s);
    const double out_x = corner ? 1.05 : 1.02;
    const Double3 border = ProjectToHead({x * out_x, line + open, kMouthCenter.z - 0.12 * x * x});
    const Double3 contact = ProjectToHead({x, line, kMouthCenter.z - 0.12 * x * x});
    const Double3 n_border = HeadNormal(border), n_contact = HeadNormal(contact);
    const double full = std::sqrt(std::max(1 - s * s, 0.0));  // lips thin out towards the corners
    const double pout = upper ? 0.85 + 0.25 * Bump(s, 0.35) : 1.0 + 0.12 * Bump(std::fabs(s) - 0.3, 0.4);
    const Double3 deep = {0, 0, -1};
    const auto set = [&](int ring, Double3 p) {
      const int i = rings[Size(ring)][Size(k)];
      At(i) = p;
      shape_.lip[Size(i)] = side;
    };
    const Double3 block = At(rings[0][Size(k)]);
    for (int ring = 1; ring <= kSkinRingsOfMouth; ++ring) {
      const double t = static_cast<double>(ring) / (kSkinRingsOfMouth + 1);
      set(ring, ProjectToHead(block * (1 - t) + border * t));
    }
    const int b = shape_.border_ring;
    set(b, border + n_border * (0.05 * full));
    const auto mix = [&](double t) { return border * (1 - t) + contact * t; };
    set(b + 1, mix(0.30) + n_border * (0.21 * full * pout));
    set(b + 2, mix(0.66) + n_contact * (0.27 * full * pout));
    const Double3 meet = contact + n_contact * (0.15 * full) + Double3{0, side * 0.008, 0};
    set(b + 3, meet);
    const double shrink = 1 - 0.10 * std::fabs(s);
    set(b + 4, Double3{meet.x * shrink, meet.y + side * 0.012, meet.z} + deep * (0.30 + 0.15 * full));
    set(b + 5,
        Double3{meet.x * shrink * 0.95, meet.y + side * 0.22 * full, meet.z} + deep * (0.95 + 0.15 * full));
    set(b + 6,
        Double3{meet.x * shrink * 0.9, meet.y + side * 0.55 * full, meet.z} + deep * (1.6 + 0.3 * full));
    set(b + 7,
        Double3{meet.x * shrink * 0.75, meet.y + side * 0.35 * full, meet.z} + deep * (2.3 + 0.5 * full));
    for (int ring = b; ring < kMouthRings; ++ring) Pin(rings[Size(ring)][Size(k)]);
  }
}

void HeadBuilder::MakeNostrils() {
  const std::vector<int> loop = Loop(kNoseRow, kNoseRow + 2, 1, 3, kNoseRow, 1);
  nostril_rings_ = {loop};
  const int n = static_cast<int>(loop.size());
  for (int ring = 0; ring < 3; ++ring) {
    std::vector<int> points;
    for (int k = 0; k < n; ++k) points.push_back(AddPair({1, 14, 10}));
    for (int k = 0; k < n; ++k) {
      const int next = (k + 1) % n;
      const std::vector<int>& outer = nostril_rings_.back();
      QuadPair(outer[Size(k)], outer[Size(next)], points[Size(next)], points[Size(k)]);
    }
    nostril_rings_.push_back(points);
  }
  const std::vector<int>& p = nostril_rings_.back();
  for (int k = 0; k < n / 2 - 1; ++k) {
    if (k == 0) {
      QuadPair(p[0], p[1], p[Size(n - 1)], p[Size(n - 1)]);
    } else {
      QuadPair(p[Size(k)], p[Size(k + 1)], p[Size(n - k - 1)], p[Size(n - k)]);
    }
  }
  QuadPair(p[Size(n / 2 - 1)], p[Size(n / 2)], p[Size(n / 2 + 1)], p[Size(n / 2 + 1)]);
  FinishNostrils();
  for (int r = kNoseRow; r < kNoseRow + 2; ++r) {
    for (int c = 1; c < 3; ++c) {
      hole_[Size(r * kColumns + c)] = hole_[Size(r * kColumns + (kColumns - 1 - c))] = true;
    }
  }
}

void HeadBuilder::FinishNostrils() {
  Double3 center = {};
  const double n = static_cast<double>(nostril_rings_[0].size());
  for (int i : nostril_rings_[0]) center = center + At(i) * (1 / n);
  const Double3 up = HeadNormal(center) * -1.0;
  constexpr double kScale[] = {0.72, 0.6, 0.4}, kDepth[] = {0.0, 0.3, 0.7};
  for (std::size_t ring = 1; ring < nostril_rings_.size(); ++ring) {
    for (std::size_t k = 0; k < nostril_rings_[0].size(); ++k) {
      const Double3 outer = At(nostril_rings_[0][k]);
      Double3 p = center + (outer - center) * kScale[ring - 1];
      if (ring == 1) p = ProjectToHead(p);
      At(nostril_rings_[ring][k]) = p + (up + Double3{0, 0, -0.3}) * kDepth[ring - 1];
      Pin(nostril_rings_[ring][k]);
    }
  }
}

namespace {

// Outline of the left ear in its plane: p backwards, q upwards, cm; counter-clockwise from outside.
constexpr double kEarOutline[][2] = {{-0.15, -2.55}, {0.55, -3.0}, {1.25, -2.5}, {1.75, -1.35},
                                     {2.3, -0.1},    {2.65, 1.2},  {2.45, 2.4},  {1.6, 3.15},
                                     {0.6, 3.1},     {-0.2, 2.2},  {-0.4, 0.9},  {-0.45, -0.9}};
struct EarRing {
  double scale, front_height, back_height;
};
constexpr EarRing kEarRings[] = {
    {0.60, -0.05, 0.05}, {0.72, 0.12, 0.55}, {0.97, 0.22, 1.0},  {1.0, 0.36, 1.22}, {0.90, 0.42, 1.30},
    {0.80, 0.26, 1.02},  {0.66, 0.22, 0.92}, {0.52, 0.24, 0.98}, {0.38, 0.0, 0.62}, {0.22, -0.18, 0.18}};

}  // namespace

void HeadBuilder::MakeEars() {
  const std::vector<int> loop = Loop(kEarRow0, kEarRow1, kEarColumn0, kEarColumn1, kEarRow0, kEarColumn0);
  const int n = static_cast<int>(loop.size());
  Double3 center = {};
  for (int i : loop) center = center + At(i) * (1.0 / n);
  center = ProjectToHead(center);
  const Double3 origin = center + Double3{-0.15, 0.1, 0.5};
  const Double3 back = {0.27, 0.05, -0.962}, lean = {0.09, 0.975, -0.20}, out = {0.96, -0.05, 0.27};
  std::vector<int> outer = loop;
  std::vector<int> points;
  const int ring_count = static_cast<int>(std::size(kEarRings));
  for (int ring = 0; ring < ring_count; ++ring) {
    points.clear();
    const EarRing& e = kEarRings[ring];
    for (int k = 0; k < n; ++k) {
      // A closed Catmull-Rom curve through the outline, evenly in its parameter
      const int m = static_cast<int>(std::size(kEarOutline));
      const double at = static_cast<double>(k) * m / n;
      const int i1 = static_cast<int>(at);
      const double t = at - i1, t2 = t * t, t3 = t2 * t;
      const double w[4] = {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2,
                           (t3 - t2) / 2};
      double p = 0, q = 0;
      for (int j = 0; j < 4; ++j) {
        const auto& control = kEarOutline[(i1 + j - 1 + m) % m];
        p += w[j] * control[0];
        q += w[j] * control[1];
      }
      // Rings shrink towards the bowl, which lies in front and a little below the middle
      const double bowl_p = 0.75, bowl_q = -0.15;
      const double rp = bowl_p + (p - bowl_p) * e.scale, rq = bowl_q + (q - bowl_q) * e.scale;
      const double rear = Smooth(-0.6, 2.0, p), lobe = Smooth(-1.2, -2.6, q);
      double height = e.front_height + (e.back_height - e.front_height) * rear;
      if (ring >= 5) height += lobe * (0.42 + 0.55 * rear - height) * 0.8;  // the lobe is plain
      const Double3 pos = origin + back * rp + lean * rq + out * height;
      points.push_back(AddPair(pos));
      const std::size_t id = Size(points.back());
      shape_.ear[id] = shape_.ear[id + 1] = std::min(1.0, ring / 3.0);
      if (ring == 0) {
        At(points.back()) = ProjectToHead(pos);
      }
      Pin(points.back());
    }
    for (int k = 0; k < n; ++k) {
      const int next = (k + 1) % n;
      QuadPair(outer[Size(k)], outer[Size(next)], points[Size(next)], points[Size(k)]);
    }
    outer = points;
  }
  // The bowl's floor: quads between the two sides of the last ring
  for (int k = 0; k < n / 2; ++k) {
    const int a = outer[Size(k)], b = outer[Size(k + 1)], c = outer[Size((n - k - 1) % n)],
              d = outer[Size((n - k) % n)];
    if (k == 0) {
      QuadPair(a, b, c, c);
    } else if (k == n / 2 - 1) {
      QuadPair(a, b, d, d);
    } else {
      QuadPair(a, b, c, d);
    }
  }
  for (int r = kEarRow0; r < kEarRow1; ++r) {
    for (int c = kEarColumn0; c < kEarColumn1; ++c) {
      hole_[Size(r * kColumns + c)] = hole_[Size(r * kColumns + (kColumns - 1 - c))] = true;
    }
  }
}

}  // namespace kpsa::scenes
