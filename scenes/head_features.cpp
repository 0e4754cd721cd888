// The parts of the head with rings of their own: eyes, mouth, nostrils, ears.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/head_builder.h"

namespace kpsa::engine::scenes {

// Corners and lids of the left eye: k = 0 the inner corner, n / 2 the outer one, first along the upper lid.
// The point lies on a flattened sphere above the eyeball.
Double3 HeadBuilder::LidPoint(int k, int n, const LidRing& ring) const {
  const int half = n / 2;
  const bool upper = k <= half;
  const double even = upper ? static_cast<double>(k) / half : static_cast<double>(n - k) / half;
  const double s = 0.45 * even + 0.55 * (0.5 - 0.5 * Cos(kPi * even));
  const double x = design_.lid_inner + design_.lid_span * s;
  const double skew = upper ? s + 0.16 * s * (1 - s) : s - 0.22 * s * (1 - s);
  const double arch = 4 * skew * (1 - skew), roundness = std::sqrt(arch);
  const double height = upper ? design_.lid_upper * (0.55 * arch + 0.45 * roundness)
                              : -design_.lid_lower * (0.6 * arch + 0.4 * roundness);
  const double line = design_.tilt_inner * (1 - s) + design_.tilt_outer * s;
  const Double3 p = {x * ring.wide, line + height * ring.open, 0};
  const double rho = design_.eye_radius + ring.above;
  const double inside = rho * rho - 0.86 * p.x * p.x - p.y * p.y;
  return design_.eye_center + Double3{p.x, p.y, std::sqrt(std::max(inside, 0.04))};
}

namespace {
constexpr int kSkinRingsOfEye = 3;
}

// The cells of a block, and their mirror images, have no quads of the grid.
void HeadBuilder::MarkHole(int row0, int row1, int column0, int column1) {
  for (int r = row0; r < row1; ++r) {
    for (int c = column0; c < column1; ++c) {
      hole_[Size(r * columns_ + (c + columns_) % columns_)] = true;
      hole_[Size(r * columns_ + (2 * columns_ - 1 - c) % columns_)] = true;
    }
  }
}

void HeadBuilder::MakeEyes() {
  const int eye_row = design_.eye_row;
  std::vector<int> loop =
      Loop(eye_row, eye_row + 6, design_.eye_column0, design_.eye_column1, eye_row + 3, design_.eye_column0);
  std::reverse(loop.begin() + 1, loop.end());  // from the inner corner over the upper lid: clockwise
  const int n = static_cast<int>(loop.size());
  std::vector<std::vector<int>> rings = {loop};
  for (int ring = 1; ring <= kSkinRingsOfEye + static_cast<int>(design_.lid_rings.size()); ++ring) {
    std::vector<int> points;
    for (int k = 0; k < n; ++k) {
      const int lid = ring - kSkinRingsOfEye - 1;
      if (lid < 0) {
        const double t = static_cast<double>(ring) / (kSkinRingsOfEye + 1);
        const Double3 inner = LidPoint(k, n, design_.lid_rings[0]);
        points.push_back(AddPair(Project(At(loop[Size(k)]) * (1 - t) + inner * t)));
      } else {
        points.push_back(AddPair(LidPoint(k, n, design_.lid_rings[Size(lid)])));
        if (lid == 0) At(points.back()) = Project(At(points.back()));
        if (lid == 1 && k < n / 2)
          At(points.back()).z -= design_.lid_fold * Sin(2 * kPi * k / n);  // the upper lid's fold
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
  MarkHole(eye_row, eye_row + 6, design_.eye_column0, design_.eye_column1);
}

// The lines of the mouth at s = -1 .. 1 (x = s * half width).
double HeadBuilder::MouthLine(double s) const {
  return design_.line_middle * Bump(s, 0.3) + design_.line_side * Bump(std::fabs(s) - 0.4, 0.45) -
         design_.line_end * s * s;
}
double HeadBuilder::UpperBorder(double s) const {
  const double a = std::fabs(s), side = std::max(1 - a, 0.0);
  return design_.upper_height * std::sqrt(side) * (0.35 + 0.65 * side) / (0.35 + 0.65 * 0.8) * 1.05 -
         design_.upper_notch * Bump(s, 0.26);
}
double HeadBuilder::LowerBorder(double s) const {
  const double c = std::max(1 - s * s, 0.0);
  return -design_.lower_height * (0.55 * c + 0.45 * c * c) - 0.02;
}

namespace {

constexpr int kSkinRingsOfMouth = 3;
constexpr int kMouthRings = 12;  // with the block's border

}  // namespace

void HeadBuilder::MakeMouth() {
  const int mouth_row = design_.mouth_row, column = design_.mouth_column;
  std::vector<int> loop = Loop(mouth_row, mouth_row + 6, -column, column, mouth_row + 3, -column);
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
  MarkHole(mouth_row, mouth_row + 6, -column, column);
}

// Places the rings of the mouth between the block's border, as it is now, and the lines of the lips.
void HeadBuilder::FinishMouth() {
  const std::vector<std::vector<int>>& rings = shape_.mouth_rings;
  const Double3 mouth = design_.mouth_center;
  const int n = static_cast<int>(rings[0].size()), half = n / 2;
  for (int k = 0; k < n; ++k) {
    const bool upper = k > 0 && k < half, corner = k == 0 || k == half;
    const double even = (k <= half ? 2.0 * k / half : 2.0 * (n - k) / half) - 1;
    const double s = 0.5 * even + 0.5 * Sin(even * kPi / 2);
    const double side = corner ? 0 : upper ? 1 : -1;
    const double x = s * design_.mouth_half_width;
    const double line = mouth.y + MouthLine(s);
    const double open = corner ? 0 : upper ? UpperBorder(s) : LowerBorder(s);
    const double out_x = corner ? 1.05 : 1.02;
    const Double3 border = Project({x * out_x, line + open, mouth.z - design_.mouth_curve * x * x});
    const Double3 contact = Project({x, line, mouth.z - design_.mouth_curve * x * x});
    const Double3 n_border = Normal(border), n_contact = Normal(contact);
    const double full = std::sqrt(std::max(1 - s * s, 0.0));  // lips thin out towards the corners
    const double pout = design_.lip_fullness *
                        (upper ? 0.85 + 0.25 * Bump(s, 0.35) : 1.0 + 0.12 * Bump(std::fabs(s) - 0.3, 0.4));
    const Double3 deep = {0, 0, -design_.mouth_depth};
    const auto set = [&](int ring, Double3 p) {
      const int i = rings[Size(ring)][Size(k)];
      At(i) = p;
      shape_.lip[Size(i)] = side;
    };
    const Double3 block = At(rings[0][Size(k)]);
    for (int ring = 1; ring <= kSkinRingsOfMouth; ++ring) {
      const double t = static_cast<double>(ring) / (kSkinRingsOfMouth + 1);
      set(ring, Project(block * (1 - t) + border * t));
    }
    const int b = shape_.border_ring;
    set(b, border + n_border * (0.05 * full));
    const auto mix = [&](double t) { return border * (1 - t) + contact * t; };
    set(b + 1, mix(0.30) + n_border * (0.21 * full * pout));
    set(b + 2, mix(0.66) + n_contact * (0.27 * full * pout));
    const Double3 meet = contact + n_contact * (0.15 * full) + Double3{0, side * 0.008, 0};
    set(b + 3, meet);
    const double shrink = 1 - design_.pocket_narrow * std::fabs(s);
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
  const std::vector<int> loop = Loop(design_.nose_row, design_.nose_row + 2, 1, 3, design_.nose_row, 1);
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
  MarkHole(design_.nose_row, design_.nose_row + 2, 1, 3);
}

void HeadBuilder::FinishNostrils() {
  Double3 center = {};
  const double n = static_cast<double>(nostril_rings_[0].size());
  for (int i : nostril_rings_[0]) center = center + At(i) * (1 / n);
  const Double3 up = Normal(center) * -1.0;
  constexpr double kScale[] = {0.72, 0.6, 0.4}, kDepth[] = {0.0, 0.3, 0.7};
  for (std::size_t ring = 1; ring < nostril_rings_.size(); ++ring) {
    for (std::size_t k = 0; k < nostril_rings_[0].size(); ++k) {
      const Double3 outer = At(nostril_rings_[0][k]);
      Double3 p = center + (outer - center) * kScale[ring - 1];
      if (ring == 1) p = Project(p);
      At(nostril_rings_[ring][k]) =
          p + (up + Double3{0, 0, -0.3}) * (design_.nostril_depth * kDepth[ring - 1]);
      Pin(nostril_rings_[ring][k]);
    }
  }
}

// A closed Catmull-Rom curve through the outline, evenly in its parameter; rings shrink towards the bowl,
// which lies in front and a little below the middle.
std::vector<Double3> HeadBuilder::ShellRing(std::size_t ring, std::size_t count, Double3 origin) const {
  const EarDesign& ear = design_.ear;
  const EarRing& e = ear.rings[ring];
  const int n = static_cast<int>(count), m = static_cast<int>(ear.outline.size());
  std::vector<Double3> points;
  for (int k = 0; k < n; ++k) {
    const double at = static_cast<double>(k) * m / n;
    const int i1 = static_cast<int>(at);
    const double t = at - i1, t2 = t * t, t3 = t2 * t;
    const double w[4] = {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2,
                         (t3 - t2) / 2};
    double p = 0, q = 0;
    for (int j = 0; j < 4; ++j) {
      const auto& control = ear.outline[Size((i1 + j - 1 + m) % m)];
      p += w[j] * control[0];
      q += w[j] * control[1];
    }
    const double bowl_p = 0.75, bowl_q = -0.15;
    const double rp = bowl_p + (p - bowl_p) * e.scale, rq = bowl_q + (q - bowl_q) * e.scale;
    const double rear = Smooth(-0.6, 2.0, p), lobe = Smooth(-1.2, -2.6, q);
    double height = e.front_height + (e.back_height - e.front_height) * rear;
    if (e.scale < 0.85 && ring >= ear.rings.size() / 2)
      height += lobe * (0.42 + 0.55 * rear - height) * 0.8;  // the lobe is plain
    points.push_back(origin + ear.back * rp + ear.lean * rq + ear.out * height);
  }
  return points;
}

// A cone over the loop, cut open from low in front to its tip behind.
std::vector<Double3> HeadBuilder::CupRing(const EarRing& ring, const std::vector<int>& loop,
                                          Double3 center) const {
  const EarDesign& ear = design_.ear;
  const double length = Length(ear.lean);
  const Double3 up = ear.lean * (1 / length), open = ear.back;
  std::vector<Double3> points;
  for (int i : loop) {
    Double3 across = shape_.points[Size(i)] - center;
    across = across - up * Dot(across, up);
    const double behind = 0.5 - 0.5 * Dot(across, open) / Length(across);  // 0 where it opens, 1 at the tip
    const double rim = 0.08 + 0.92 * behind * behind * (1.4 - 0.4 * behind);
    const double height = std::min(rim * ring.front_height + ring.back_height, 1.0);
    const double width = ring.scale * (1 - height * height * 0.6 - height * 0.34);
    points.push_back(center + across * width + up * (length * height));
  }
  return points;
}

void HeadBuilder::MakeEars() {
  const EarDesign& ear = design_.ear;
  const std::vector<int> loop = Loop(ear.row0, ear.row1, ear.column0, ear.column1, ear.row0, ear.column0);
  const int n = static_cast<int>(loop.size());
  Double3 center = {};
  for (int i : loop) center = center + At(i) * (1.0 / n);
  center = Project(center);
  const Double3 origin = center + ear.shift;
  std::vector<int> outer = loop;
  std::vector<int> points;
  for (std::size_t ring = 0; ring < ear.rings.size(); ++ring) {
    points.clear();
    const std::vector<Double3> places =
        ear.pointed ? CupRing(ear.rings[ring], loop, origin) : ShellRing(ring, loop.size(), origin);
    for (const Double3& pos : places) {
      points.push_back(AddPair(pos));
      const std::size_t id = Size(points.back());
      shape_.ear[id] = shape_.ear[id + 1] = std::min(1.0, static_cast<double>(ring) / 3.0);
      shape_.ear_inside[id] = shape_.ear_inside[id + 1] = ring > ear.rings.size() / 2;
      if (ring == 0) At(points.back()) = Project(pos);
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
  MarkHole(ear.row0, ear.row1, ear.column0, ear.column1);
}

}  // namespace kpsa::engine::scenes
