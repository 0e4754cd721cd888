// The grid of the head, its crown, and what makes it even.
#include "scenes/head_shape.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/head_builder.h"

namespace kpsa::scenes {
namespace {

// --- The grid: rows from the neck's edge to the crown, columns around. Column 0 is the middle of the face.
// A row where its outline passes the front, the side (x is the half width) and the back; `rows` to the next
// one.
struct GuideRow {
  double front_y, front_z, side_x, side_y, side_z, back_y, back_z;
  int rows;
};
constexpr GuideRow kGuides[] = {{0.0, 3.9, 5.9, 0.0, -2.4, 0.0, -7.8, 4},
                                {4.0, 3.5, 5.3, 4.0, -2.0, 5.0, -6.8, 3},
                                {7.0, 4.4, 5.3, 7.6, -1.4, 8.6, -7.0, 4},
                                {7.35, 7.6, 5.7, 9.4, -0.6, 10.6, -7.6, 2},
                                {8.6, 8.7, 6.0, 10.6, -0.3, 12.0, -8.2, 3},
                                {10.0, 8.6, 6.2, 11.9, -0.2, 13.3, -8.9, 6},  // mouth
                                {13.1, 9.3, 6.7, 14.3, -0.4, 15.9, -9.8, 1},
                                {13.7, 9.6, 6.8, 14.9, -0.5, 16.5, -10.0, 3},  // under the nose
                                {14.35, 11.2, 6.9, 15.8, -0.6, 17.4, -10.2, 5},
                                {17.0, 10.0, 7.1, 17.4, -0.8, 19.2, -10.4, 6},  // eyes
                                {20.2, 8.9, 7.2, 20.2, -1.0, 21.9, -10.3, 2},
                                {21.3, 9.0, 7.3, 21.3, -1.1, 23.0, -10.0, 3},
                                {23.6, 8.8, 7.3, 23.6, -1.2, 24.8, -9.4, 3},
                                {26.6, 7.2, 6.5, 26.6, -1.3, 27.2, -7.8, 3},
                                {28.9, 3.4, 3.9, 29.2, -1.3, 29.1, -5.2, 0}};
// Angle of column c = 0 .. kHalfColumns: even in x over the face, coarser behind.
double ColumnAngle(int c) {
  if (c <= 13) return Asin(0.058 * c);
  const double front = Asin(0.058 * 13);
  const double t = static_cast<double>(c - 13) / (kHalfColumns - 13);
  return front + (kPi - front) * (0.72 * t + 0.28 * t * t);
}

}  // namespace

// The border of the block rows x columns, counter-clockwise from outside, starting at a given point of it.
std::vector<int> HeadBuilder::Loop(int row0, int row1, int column0, int column1, int first_row,
                                   int first_column) const {
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

void HeadBuilder::MakeGrid() {
  for (const GuideRow& guide : kGuides) rows_ += guide.rows;
  ++rows_;
  std::vector<GuideRow> rows;
  for (std::size_t g = 0; g + 1 < std::size(kGuides); ++g) {
    const GuideRow &a = kGuides[g], &b = kGuides[g + 1];
    for (int k = 0; k < a.rows; ++k) {
      const double t = static_cast<double>(k) / a.rows, s = 1 - t;
      rows.push_back({a.front_y * s + b.front_y * t, a.front_z * s + b.front_z * t,
                      a.side_x * s + b.side_x * t, a.side_y * s + b.side_y * t, a.side_z * s + b.side_z * t,
                      a.back_y * s + b.back_y * t, a.back_z * s + b.back_z * t, 0});
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
void HeadBuilder::MakeCrown() {
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

// Moves free points towards the mean of their neighbours along the surface, and back onto it.
void HeadBuilder::Relax(int iterations) {
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

void HeadBuilder::Symmetrize() {
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
void HeadBuilder::Compact() {
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

void HeadBuilder::PickCurves() {
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

HeadShape HeadBuilder::Build() {
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

HeadShape MakeHeadShape() { return HeadBuilder().Build(); }

}  // namespace kpsa::scenes
