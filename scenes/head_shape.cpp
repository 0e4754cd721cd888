#include "scenes/head_shape.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::scenes {
namespace {

// --- The grid: rows from the neck's edge to the crown, columns around. Column 0 is the middle of the face.
constexpr int kHalfColumns = 27;
constexpr int kColumns = 2 * kHalfColumns;

// A row where its outline passes the front, the side (x is the half width) and the back; `rows` to the next one.
struct GuideRow {
  double front_y, front_z, side_x, side_y, side_z, back_y, back_z;
  int rows;
};
constexpr GuideRow kGuides[] = {
    {0.0, 3.9, 5.9, 0.0, -2.4, 0.0, -7.8, 4},      {4.0, 3.5, 5.3, 4.0, -2.0, 5.0, -6.8, 3},
    {7.0, 4.4, 5.3, 7.6, -1.4, 8.6, -7.0, 4},      {7.35, 7.6, 5.7, 9.4, -0.6, 10.6, -7.6, 2},
    {8.6, 8.7, 6.0, 10.6, -0.3, 12.0, -8.2, 3},    {10.0, 8.6, 6.2, 11.9, -0.2, 13.3, -8.9, 6},  // mouth
    {13.1, 9.3, 6.7, 14.3, -0.4, 15.9, -9.8, 1},   {13.7, 9.6, 6.8, 14.9, -0.5, 16.5, -10.0, 3},  // under the nose
    {14.35, 11.2, 6.9, 15.8, -0.6, 17.4, -10.2, 5}, {17.0, 10.0, 7.1, 17.4, -0.8, 19.2, -10.4, 6},  // eyes
    {20.2, 8.9, 7.2, 20.2, -1.0, 21.9, -10.3, 2},  {21.3, 9.0, 7.3, 21.3, -1.1, 23.0, -10.0, 3},
    {23.6, 8.8, 7.3, 23.6, -1.2, 24.8, -9.4, 3},   {26.6, 7.2, 6.5, 26.6, -1.3, 27.2, -7.8, 3},
    {28.9, 3.4, 3.9, 29.2, -1.3, 29.1, -5.2, 0}};
constexpr int kMouthRow = 16, kNoseRow = 23, kEyeRow = 31;  // first rows of the blocks that get rings
constexpr int kEyeColumn0 = 3, kEyeColumn1 = 12, kMouthColumn = 8;
constexpr int kEarColumn0 = 17, kEarColumn1 = 20, kEarRow0 = 25, kEarRow1 = 35;

// Angle of column c = 0 .. kHalfColumns: even in x over the face, coarser behind.
double ColumnAngle(int c) {
  if (c <= 13) return Asin(0.058 * c);
  const double front = Asin(0.058 * 13);
  const double t = static_cast<double>(c - 13) / (kHalfColumns - 13);
  return front + (kPi - front) * (0.72 * t + 0.28 * t * t);
}

class Builder {
 public:
  HeadShape Build();

 private:
  int Add(Double3 p) {
    shape_.points.push_back(p);
    pinned_.push_back(false);
    shape_.mirror.push_back(static_cast<int>(shape_.points.size()) - 1);
    shape_.lip.push_back(0);
    shape_.ear.push_back(0);
    return static_cast<int>(shape_.points.size()) - 1;
  }
  // A point and its mirror image; returns the first.
  int AddPair(Double3 p) {
    const int a = Add(p), b = Add({-p.x, p.y, p.z});
    Pair(a, b);
    return a;
  }
  void Pair(int a, int b) {
    shape_.mirror[Size(a)] = b;
    shape_.mirror[Size(b)] = a;
  }
  static std::size_t Size(int i) { return static_cast<std::size_t>(i); }
  Double3& At(int i) { return shape_.points[Size(i)]; }
  void Pin(int i) { pinned_[Size(i)] = true, pinned_[Size(shape_.mirror[Size(i)])] = true; }
  void Quad(int a, int b, int c, int d) { shape_.quads.push_back({a, b, c, d}); }
  void QuadPair(int a, int b, int c, int d) {
    const auto& m = shape_.mirror;
    Quad(a, b, c, d);
    if (c == d) {
      Quad(m[Size(a)], m[Size(c)], m[Size(b)], m[Size(b)]);
    } else {
      Quad(m[Size(a)], m[Size(d)], m[Size(c)], m[Size(b)]);
    }
  }
  int Grid(int row, int column) const { return grid_[Size(row)][Size((column + kColumns) % kColumns)]; }
  std::vector<int> Loop(int row0, int row1, int column0, int column1, int first_row, int first_column) const;
  void MakeGrid();
  void MakeCrown();
  void MakeEyes();
  void MakeMouth();
  void MakeNostrils();
  void MakeEars();
  void Relax(int iterations);
  void FinishEyes();
  void FinishMouth();
  void FinishNostrils();
  void Symmetrize();
  void Compact();
  void PickCurves();

  HeadShape shape_;
  std::vector<bool> pinned_;
  std::vector<std::vector<int>> grid_;
  std::vector<std::vector<int>> nostril_rings_;
  std::vector<bool> hole_;  // of grid cells
  int rows_ = 0;
};

// The border of the block rows x columns, counter-clockwise from outside, starting at a given point of it.
std::vector<int> Builder::Loop(int row0, int row1, int column0, int column1, int first_row, int first_column) const {
  std::vector<std::array<int, 2>> cells;
  for (int c = column0; c < column1; ++c) cells.push_back({row0, c});
  for (int r = row0; r < row1; ++r) cells.push_back({r, column1});
  for (int c = column1; c > column0; --c) cells.push_back({row1, c});
  for (int r = row1; r > row0; --r) cells.push_back({r, column0});
  const auto first = std::find(cells.begin(), cells.end(), std::array<int, 2>{first_row, first_column});
  std::rotate(cells.begin(), first, cells.end());
  std::vector<int> loop;
  for (const auto& cell : cells) loop.push_back(Grid(cell[0], cell[1]));
  return loop;
}

void Builder::MakeGrid() {
  for (const GuideRow& guide : kGuides) rows_ += guide.rows;
  ++rows_;
  std::vector<GuideRow> rows;
  for (std::size_t g = 0; g + 1 < std::size(kGuides); ++g) {
    const GuideRow &a = kGuides[g], &b = kGuides[g + 1];
    for (int k = 0; k < a.rows; ++k) {
      const double t = static_cast<double>(k) / a.rows, s = 1 - t;
      rows.push_back({a.front_y * s + b.front_y * t, a.front_z * s + b.front_z * t, a.side_x * s + b.side_x * t,
                      a.side_y * s + b.side_y * t, a.side_z * s + b.side_z * t, a.back_y * s + b.back_y * t,
                      a.back_z * s + b.back_z * t, 0});
    }
  }
  rows.push_back(kGuides[std::size(kGuides) - 1]);
  grid_.assign(Size(rows_), std::vector<int>(kColumns));
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < kColumns; ++c) grid_[Size(r)][Size(c)] = Add({});
  }
  for (int r = 0; r < rows_; ++r) {
    const GuideRow& row = rows[Size(r)];
    for (int c = 0; c <= kHalfColumns; ++c) {
      const double angle = ColumnAngle(c), sine = Sin(angle), cosine = Cos(angle);
      const bool front = cosine >= 0;
      const double end_y = front ? row.front_y : row.back_y, end_z = front ? row.front_z : row.back_z;
      const double blend = sine * sine;
      // The face is flat from side to side near its middle: keep the front row's height there
      Double3 p = {row.side_x * sine, end_y + (row.side_y - end_y) * blend,
                   row.side_z + (end_z - row.side_z) * std::fabs(cosine)};
      const int a = Grid(r, c), b = Grid(r, -c);
      At(a) = ProjectToHead(p);
      if (r == 0) At(a) = {At(a).x, 0, At(a).z};
      if (c == 0 || c == kHalfColumns) At(a).x = 0;
      Pair(a, b);
      if (a != b) At(b) = {-At(a).x, At(a).y, At(a).z};
      if (r == 0) Pin(a);
    }
  }
  hole_.assign(Size(rows_ * kColumns), false);
}

// The crown: the top row is the border of a square grid of quads.
void Builder::MakeCrown() {
  // Columns -w .. w in front are one side, the same behind, and the rest the sides
  constexpr int kWide = 6, kDeep = kHalfColumns - 2 * kWide;  // quads across (2 w), quads deep
  const int top = rows_ - 1;
  // square[i][j]: i from the front to the back, j from -x to +x
  std::vector<std::vector<int>> square(Size(kDeep + 1), std::vector<int>(Size(2 * kWide + 1)));
  for (int i = 0; i <= kDeep; ++i) {
    for (int j = -kWide; j <= kWide; ++j) {
      int& point = square[Size(i)][Size(j + kWide)];
      if (i == 0) {
        point = Grid(top, j);
      } else if (i == kDeep) {
        point = Grid(top, kHalfColumns - j);
      } else if (j == kWide) {
        point = Grid(top, kWide + i);
      } else if (j == -kWide) {
        point = Grid(top, -kWide - i);
      } else {
        point = Add({});
      }
    }
  }
  for (int i = 1; i < kDeep; ++i) {
    for (int j = -kWide + 1; j < kWide; ++j) {
      const int point = square[Size(i)][Size(j + kWide)];
      const double u = static_cast<double>(i) / kDeep, v = (j + kWide) / (2.0 * kWide);
      const Double3 front = At(square[0][Size(j + kWide)]), back = At(square[Size(kDeep)][Size(j + kWide)]);
      const Double3 right = At(square[Size(i)][0]), left = At(square[Size(i)][2 * kWide]);
      // Half of each of the two linear blends, lifted, then projected
      Double3 p = (front * (1 - u) + back * u) * 0.5 + (right * (1 - v) + left * v) * 0.5;
      p.y += 1.0;
      At(point) = ProjectToHead(p);
      shape_.mirror[Size(point)] = square[Size(i)][Size(-j + kWide)];
    }
  }
  for (int i = 0; i < kDeep; ++i) {
    for (int j = 0; j < 2 * kWide; ++j) {
      const auto at = [&](int a, int b) { return square[Size(a)][Size(b)]; };
      Quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    }
  }
}

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
  const double height = upper ? 0.53 * (0.55 * arch + 0.45 * roundness) : -0.44 * (0.6 * arch + 0.4 * roundness);
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

void Builder::MakeEyes() {
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
        points.push_back(AddPair(LidPoint(k, n, kLidRings[lid].wide, kLidRings[lid].open, kLidRings[lid].rho)));
        if (lid == 0) At(points.back()) = ProjectToHead(At(points.back()));
        if (lid == 1 && k < n / 2) At(points.back()).z -= 0.07 * Sin(2 * kPi * k / n);  // the upper lid's fold
        if (lid >= 1) Pin(points.back());
      }
    }
    rings.push_back(points);
  }
  for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
    for (int k = 0; k < n; ++k) {
      const int next = (k + 1) % n;
      QuadPair(rings[ring][Size(next)], rings[ring][Size(k)], rings[ring + 1][Size(k)], rings[ring + 1][Size(next)]);
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

// The lines of the mouth at s = -1 .. 1 (x = s * half width).
double MouthLine(double s) { return -0.05 * Bump(s, 0.3) + 0.05 * Bump(std::fabs(s) - 0.4, 0.45) - 0.07 * s * s; }
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

void Builder::MakeMouth() {
  std::vector<int> loop = Loop(kMouthRow, kMouthRow + 6, -kMouthColumn, kMouthColumn, kMouthRow + 3, -kMouthColumn);
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
      Quad(rings[ring][Size(next)], rings[ring][Size(k)], rings[ring + 1][Size(k)], rings[ring + 1][Size(next)]);
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
void Builder::FinishMouth() {
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
    set(b + 5, Double3{meet.x * shrink * 0.95, meet.y + side * 0.22 * full, meet.z} + deep * (0.95 + 0.15 * full));
    set(b + 6, Double3{meet.x * shrink * 0.9, meet.y + side * 0.55 * full, meet.z} + deep * (1.6 + 0.3 * full));
    set(b + 7, Double3{meet.x * shrink * 0.75, meet.y + side * 0.35 * full, meet.z} + deep * (2.3 + 0.5 * full));
    for (int ring = b; ring < kMouthRings; ++ring) Pin(rings[Size(ring)][Size(k)]);
  }
}

void Builder::MakeNostrils() {
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

void Builder::FinishNostrils() {
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

// Outline of the left ear in its plane: p backwards, q upwards, cm; counter-clockwise from outside.
constexpr double kEarOutline[][2] = {{-0.15, -2.55}, {0.55, -3.0}, {1.25, -2.5}, {1.75, -1.35}, {2.3, -0.1}, {2.65, 1.2},
                                     {2.45, 2.4},    {1.6, 3.15},  {0.6, 3.1},   {-0.2, 2.2},   {-0.4, 0.9}, {-0.45, -0.9}};
struct EarRing {
  double scale, front_height, back_height;
};
constexpr EarRing kEarRings[] = {{0.60, -0.05, 0.05}, {0.72, 0.12, 0.55}, {0.97, 0.22, 1.0},  {1.0, 0.36, 1.22},
                                 {0.90, 0.42, 1.30},  {0.80, 0.26, 1.02}, {0.66, 0.22, 0.92}, {0.52, 0.24, 0.98},
                                 {0.38, 0.0, 0.62},   {0.22, -0.18, 0.18}};

void Builder::MakeEars() {
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
      const double w[4] = {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2, (t3 - t2) / 2};
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
    const int a = outer[Size(k)], b = outer[Size(k + 1)], c = outer[Size((n - k - 1) % n)], d = outer[Size((n - k) % n)];
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

// Moves free points towards the mean of their neighbours along the surface, and back onto it.
void Builder::Relax(int iterations) {
  std::vector<std::vector<int>> neighbours(shape_.points.size());
  for (const auto& q : shape_.quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      const int a = q[k], b = q[(k + 1) % 4];
      if (a == b) continue;
      for (const auto& [from, to] : {std::array<int, 2>{a, b}, std::array<int, 2>{b, a}}) {
        auto& list = neighbours[Size(from)];
        if (std::find(list.begin(), list.end(), to) == list.end()) list.push_back(to);
      }
    }
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<Double3> next = shape_.points;
    for (std::size_t i = 0; i < next.size(); ++i) {
      if (pinned_[i] || neighbours[i].empty()) continue;
      Double3 mean = {};
      for (int j : neighbours[i]) mean = mean + At(j) * (1.0 / static_cast<double>(neighbours[i].size()));
      const Double3 normal = HeadNormal(shape_.points[i]);
      Double3 step = mean - shape_.points[i];
      step = step - normal * Dot(step, normal);
      next[i] = ProjectToHead(shape_.points[i] + step * 0.5);
    }
    shape_.points = next;
    Symmetrize();
  }
}

void Builder::Symmetrize() {
  for (std::size_t i = 0; i < shape_.points.size(); ++i) {
    const std::size_t m = Size(shape_.mirror[i]);
    if (m == i) shape_.points[i].x = 0;
    if (m <= i) continue;
    const Double3 a = shape_.points[i], b = shape_.points[m];
    const Double3 mean = {(a.x - b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    shape_.points[i] = mean;
    shape_.points[m] = {-mean.x, mean.y, mean.z};
  }
}

// Leaves out the points that no quad uses (the inside of the blocks).
void Builder::Compact() {
  std::vector<int> index(shape_.points.size(), -1);
  for (const auto& q : shape_.quads) {
    for (int i : q) index[Size(i)] = 0;
  }
  int count = 0;
  for (int& i : index) {
    if (i == 0) i = count++;
  }
  HeadShape out;
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (index[i] < 0) continue;
    out.points.push_back(shape_.points[i]);
    out.mirror.push_back(index[Size(shape_.mirror[i])]);
    out.lip.push_back(shape_.lip[i]);
    out.ear.push_back(shape_.ear[i]);
  }
  for (auto q : shape_.quads) {
    for (int& i : q) i = index[Size(i)];
    out.quads.push_back(q);
  }
  out.lid_ring = shape_.lid_ring;
  out.border_ring = shape_.border_ring;
  out.contact_ring = shape_.contact_ring;
  for (const auto* rings : {&shape_.eye_rings, &shape_.mouth_rings}) {
    auto& to = rings == &shape_.eye_rings ? out.eye_rings : out.mouth_rings;
    for (const auto& ring : *rings) {
      to.emplace_back();
      for (int i : ring) to.back().push_back(index[Size(i)]);
    }
  }
  for (auto& row : grid_) {
    for (int& i : row) i = index[Size(i)];
  }
  shape_ = std::move(out);
}

void Builder::PickCurves() {
  const std::vector<int>& lips = shape_.mouth_rings[Size(shape_.border_ring + 1)];
  const int n = static_cast<int>(lips.size()), half = n / 2;
  for (int k = 0; k <= half; ++k) {  // every other point: the corners, and the middle between them
    if (k % 2 == 0 && k != 0 && k != half) continue;
    shape_.upper_lip_curve.push_back(lips[Size(k)]);
    shape_.lower_lip_curve.push_back(lips[Size((n - k) % n)]);
  }
  const int brow_row = kEyeRow + 7;
  for (int c = 2; c <= 13; ++c) {
    shape_.brow_curve_left.push_back(Grid(brow_row, c));
    shape_.brow_curve_right.push_back(Grid(brow_row, -c));
  }
}

HeadShape Builder::Build() {
  MakeGrid();
  MakeCrown();
  MakeEyes();
  MakeMouth();
  MakeNostrils();
  MakeEars();
  for (int r = 0; r + 1 < rows_; ++r) {
    for (int c = 0; c < kHalfColumns; ++c) {
      if (hole_[Size(r * kColumns + c)]) continue;
      QuadPair(Grid(r, c), Grid(r, c + 1), Grid(r + 1, c + 1), Grid(r + 1, c));
    }
  }
  Relax(24);
  FinishMouth();
  FinishNostrils();
  Relax(10);
  FinishNostrils();
  Symmetrize();
  Compact();
  PickCurves();
  return std::move(shape_);
}

}  // namespace

HeadShape MakeHeadShape() { return Builder().Build(); }

EyeShape MakeEyeShape() {
  EyeShape eye;
  constexpr int kAround = 20;
  // Rings from the pupil's floor to the back: angle from the axis, radius share, part
  struct Ring {
    double angle, radius;
    int part;
  };
  constexpr Ring kRings[] = {{0.10, 0.80, 2}, {0.16, 0.84, 2}, {0.185, 0.955, 1}, {0.26, 0.945, 1}, {0.36, 0.955, 1},
                             {0.425, 0.975, 0}, {0.47, 1.0, 0},  {0.62, 1.0, 0},    {0.90, 1.0, 0},   {1.25, 1.0, 0},
                             {1.65, 1.0, 0},  {2.1, 1.0, 0},   {2.6, 1.0, 0}};
  eye.points.push_back({0, 0, 0.80 * kEyeRadius});
  eye.part.push_back(2);
  for (const Ring& ring : kRings) {
    for (int k = 0; k < kAround; ++k) {
      const double around = 2 * kPi * k / kAround, r = kEyeRadius * ring.radius;
      eye.points.push_back({r * Sin(ring.angle) * Cos(around), r * Sin(ring.angle) * Sin(around), r * Cos(ring.angle)});
      eye.part.push_back(ring.part);
    }
  }
  eye.points.push_back({0, 0, -kEyeRadius});
  eye.part.push_back(0);
  const int rings = static_cast<int>(std::size(kRings)), last = static_cast<int>(eye.points.size()) - 1;
  for (int k = 0; k < kAround; ++k) {
    const int next = (k + 1) % kAround;
    eye.quads.push_back({0, 1 + k, 1 + next, 1 + next});
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int a = 1 + ring * kAround, b = a + kAround;
      eye.quads.push_back({a + k, b + k, b + next, a + next});
    }
    const int a = 1 + (rings - 1) * kAround;
    eye.quads.push_back({a + k, last, a + next, a + next});
  }
  return eye;
}

}  // namespace kpsa::scenes
