// The grid of the head, its crown, and what makes it even.
#include "scenes/head_shape.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/head_builder.h"

namespace kpsa::engine::scenes {

// Angle of column c = 0 .. half_columns: even in x over the face, coarser behind.
double HeadBuilder::ColumnAngle(int c) const {
  if (c <= design_.even_columns) return Asin(design_.column_step * c);
  const double front = Asin(design_.column_step * design_.even_columns);
  const double t =
      static_cast<double>(c - design_.even_columns) / (design_.half_columns - design_.even_columns);
  return front + (kPi - front) * (0.72 * t + 0.28 * t * t);
}

namespace {

std::vector<GuideRow> AllRows(const HeadDesign& design) {
  std::vector<GuideRow> rows;
  for (std::size_t g = 0; g + 1 < design.guides.size(); ++g) {
    const GuideRow &a = design.guides[g], &b = design.guides[g + 1];
    for (int k = 0; k < a.rows; ++k) {
      const double t = static_cast<double>(k) / a.rows, s = 1 - t;
      rows.push_back({a.front_y * s + b.front_y * t, a.front_z * s + b.front_z * t,
                      a.side_x * s + b.side_x * t, a.side_y * s + b.side_y * t, a.side_z * s + b.side_z * t,
                      a.back_y * s + b.back_y * t, a.back_z * s + b.back_z * t, 0});
    }
  }
  rows.push_back(design.guides.back());
  return rows;
}

Double3 PlaceInRow(const GuideRow& row, double angle) {
  const double sine = Sin(angle), cosine = Cos(angle);
  const bool front = cosine >= 0;
  const double end_y = front ? row.front_y : row.back_y, end_z = front ? row.front_z : row.back_z;
  const double blend = sine * sine;
  // The face is flat from side to side near its middle: keep the front row's height there
  return {row.side_x * sine, end_y + (row.side_y - end_y) * blend,
          row.side_z + (end_z - row.side_z) * std::fabs(cosine)};
}

}  // namespace

Double3 GuidePlace(const HeadDesign& design, double row, double angle) {
  const std::vector<GuideRow> rows = AllRows(design);
  const auto below = std::min(static_cast<std::size_t>(row), rows.size() - 2);
  const double t = row - static_cast<double>(below);
  return PlaceInRow(rows[below], angle) * (1 - t) + PlaceInRow(rows[below + 1], angle) * t;
}

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
  const std::vector<GuideRow> rows = AllRows(design_);
  rows_ = static_cast<int>(rows.size());
  grid_.assign(Size(rows_), std::vector<int>(Size(columns_)));
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) grid_[Size(r)][Size(c)] = Add({});
  }
  for (int r = 0; r < rows_; ++r) {
    const GuideRow& row = rows[Size(r)];
    for (int c = 0; c <= design_.half_columns; ++c) {
      const int a = Grid(r, c), b = Grid(r, -c);
      At(a) = Project(PlaceInRow(row, ColumnAngle(c)));
      if (r == 0) At(a) = {At(a).x, 0, At(a).z};
      if (c == 0 || c == design_.half_columns) At(a).x = 0;
      Pair(a, b);
      if (a != b) At(b) = {-At(a).x, At(a).y, At(a).z};
      if (r == 0) Pin(a);
    }
  }
  hole_.assign(Size(rows_ * columns_), false);
}

// The crown: the top row is the border of a square grid of quads.
void HeadBuilder::MakeCrown() {
  // Columns -w .. w in front are one side, the same behind, and the rest the sides
  const int wide = design_.crown_wide,
            deep = design_.half_columns - 2 * wide;  // quads across (2 w), quads deep
  const int top = rows_ - 1;
  // square[i][j]: i from the front to the back, j from -x to +x
  std::vector<std::vector<int>> square(Size(deep + 1), std::vector<int>(Size(2 * wide + 1)));
  for (int i = 0; i <= deep; ++i) {
    for (int j = -wide; j <= wide; ++j) {
      int& point = square[Size(i)][Size(j + wide)];
      if (i == 0) {
        point = Grid(top, j);
      } else if (i == deep) {
        point = Grid(top, design_.half_columns - j);
      } else if (j == wide) {
        point = Grid(top, wide + i);
      } else if (j == -wide) {
        point = Grid(top, -wide - i);
      } else {
        point = Add({});
      }
    }
  }
  for (int i = 1; i < deep; ++i) {
    for (int j = -wide + 1; j < wide; ++j) {
      const int point = square[Size(i)][Size(j + wide)];
      const double u = static_cast<double>(i) / deep, v = (j + wide) / (2.0 * wide);
      const Double3 front = At(square[0][Size(j + wide)]), back = At(square[Size(deep)][Size(j + wide)]);
      const Double3 right = At(square[Size(i)][0]), left = At(square[Size(i)][Size(2 * wide)]);
      // Half of each of the two linear blends, lifted, then projected
      Double3 p = (front * (1 - u) + back * u) * 0.5 + (right * (1 - v) + left * v) * 0.5;
      p.y += 1.0;
      At(point) = Project(p);
      shape_.mirror[Size(point)] = square[Size(i)][Size(-j + wide)];
    }
  }
  for (int i = 0; i < deep; ++i) {
    for (int j = 0; j < 2 * wide; ++j) {
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
      const Double3 normal = Normal(shape_.points[i]);
      Double3 step = mean - shape_.points[i];
      step = step - normal * Dot(step, normal);
      next[i] = Project(shape_.points[i] + step * 0.5);
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
    out.ear_inside.push_back(shape_.ear_inside[i]);
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
  const int brow_row = design_.eye_row + 7;
  for (int c = design_.brow_column0; c <= design_.brow_column1; ++c) {
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
    for (int c = 0; c < design_.half_columns; ++c) {
      if (hole_[Size(r * columns_ + c)]) continue;
      QuadPair(Grid(r, c), Grid(r, c + 1), Grid(r + 1, c + 1), Grid(r + 1, c));
    }
  }
  Relax(design_.relaxations);
  FinishMouth();
  FinishNostrils();
  Relax(10);
  FinishNostrils();
  Symmetrize();
  Compact();
  PickCurves();
  return std::move(shape_);
}

HeadShape MakeHeadShape(const HeadDesign& design) { return HeadBuilder(design).Build(); }

}  // namespace kpsa::engine::scenes
