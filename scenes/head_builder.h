// Inside of the head's shape: the points and quads while they are put together. Only head_shape.cpp and
// head_features.cpp include this.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "scenes/head_shape.h"

namespace kpsa::engine::scenes {

class HeadBuilder {
 public:
  explicit HeadBuilder(const HeadDesign& design) : design_(design), columns_(2 * design.half_columns) {}
  HeadShape Build();

 private:
  int Add(Double3 p) {
    shape_.points.push_back(p);
    pinned_.push_back(false);
    shape_.mirror.push_back(static_cast<int>(shape_.points.size()) - 1);
    shape_.lip.push_back(0);
    shape_.ear.push_back(0);
    shape_.ear_inside.push_back(false);
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
  int Grid(int row, int column) const { return grid_[Size(row)][Size((column + columns_) % columns_)]; }
  double ColumnAngle(int column) const;
  Double3 Project(Double3 p) const { return ProjectToHead(design_, p); }
  Double3 Normal(Double3 p) const { return HeadNormal(design_, p); }
  Double3 LidPoint(int k, int n, const LidRing& ring) const;
  double MouthLine(double s) const;
  double UpperBorder(double s) const;
  double LowerBorder(double s) const;
  // The loop's points moved to ring `ring` of the ear: its shell, or its cup.
  std::vector<Double3> ShellRing(std::size_t ring, std::size_t count, Double3 origin) const;
  std::vector<Double3> CupRing(const EarRing& ring, const std::vector<int>& loop, Double3 center) const;
  void MarkHole(int row0, int row1, int column0, int column1);
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

  const HeadDesign& design_;
  const int columns_;
  HeadShape shape_;
  std::vector<bool> pinned_;
  std::vector<std::vector<int>> grid_;
  std::vector<std::vector<int>> nostril_rings_;
  std::vector<bool> hole_;  // of grid cells
  int rows_ = 0;
};

}  // namespace kpsa::engine::scenes
