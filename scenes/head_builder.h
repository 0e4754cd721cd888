// Inside of the head's shape: the points and quads while they are put together. Only head_shape.cpp and
// head_features.cpp include this.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "scenes/head_shape.h"

namespace kpsa::scenes {

// The grid: rows from the neck's edge to the crown, columns around. Column 0 is the middle of the face,
// columns count towards +x; -1 is the mirror image of 1.
inline constexpr int kHalfColumns = 27;
inline constexpr int kColumns = 2 * kHalfColumns;

inline constexpr int kMouthRow = 16, kNoseRow = 23, kEyeRow = 31;  // first rows of the blocks that get rings
inline constexpr int kEyeColumn0 = 3, kEyeColumn1 = 12, kMouthColumn = 8;
inline constexpr int kEarColumn0 = 17, kEarColumn1 = 20, kEarRow0 = 25, kEarRow1 = 35;

class HeadBuilder {
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

}  // namespace kpsa::scenes
