#include "bench/untouched_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kpsa::engine::untouched {
namespace {

constexpr int kSearches = 5;  // for the size of a cell
constexpr double kNearEnough = 0.01;
constexpr double kSurelyClear = 0.4;  // of a distance, as distances are approximate
constexpr int kRelaxations = 3;       // a grid leaves slivers

class Net {
 public:
  Net(const Part& part, double cell) : part_(part), cell_(cell) {
    for (int k = 0; k < 3; ++k) {
      origin_[k] = part.low[k] - 1.5 * cell;
      count_[k] = static_cast<std::size_t>(std::ceil((part.high[k] - part.low[k]) / cell)) + 4;
    }
    values_.reserve(count_[0] * count_[1] * count_[2]);
    for (std::size_t z = 0; z < count_[2]; ++z) {
      for (std::size_t y = 0; y < count_[1]; ++y) AddRow(y, z);
    }
  }

  Surface Make() {
    vertex_.assign(values_.size(), kNoIndex);
    for (std::size_t z = 0; z + 1 < count_[2]; ++z) {
      for (std::size_t y = 0; y + 1 < count_[1]; ++y) {
        for (std::size_t x = 0; x + 1 < count_[0]; ++x) AddVertex({x, y, z});
      }
    }
    for (std::size_t z = 1; z + 1 < count_[2]; ++z) {
      for (std::size_t y = 1; y + 1 < count_[1]; ++y) {
        for (std::size_t x = 1; x + 1 < count_[0]; ++x) AddQuads({x, y, z});
      }
    }
    Relax();
    return std::move(surface_);
  }

 private:
  using Cell = std::array<std::size_t, 3>;

  Double3 Corner(std::size_t x, std::size_t y, std::size_t z) const {
    return origin_ + Double3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)} * cell_;
  }
  std::size_t At(const Cell& c) const { return (c[2] * count_[1] + c[1]) * count_[0] + c[0]; }

  // Far from the surface a value stands for those after it, too.
  void AddRow(std::size_t y, std::size_t z) {
    for (std::size_t x = 0; x < count_[0];) {
      const double value = part_.distance(Corner(x, y, z));
      const auto clear = static_cast<std::size_t>(kSurelyClear * std::fabs(value) / cell_);
      const std::size_t end = std::min(x + std::max<std::size_t>(clear, 1), count_[0]);
      for (; x < end; ++x) values_.push_back(value);
    }
  }

  // The mean of where the surface crosses the cell's edges.
  void AddVertex(const Cell& cell) {
    Double3 sum;
    int crossings = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t side = 0; side < 4; ++side) {
        Cell from = cell;
        from[(axis + 1) % 3] += side & 1, from[(axis + 2) % 3] += side >> 1;
        Cell to = from;
        ++to[axis];
        const double a = values_[At(from)], b = values_[At(to)];
        if ((a < 0) == (b < 0)) continue;
        const Double3 begin = Corner(from[0], from[1], from[2]), end = Corner(to[0], to[1], to[2]);
        sum = sum + begin + (end - begin) * (a / (a - b));
        ++crossings;
      }
    }
    if (crossings == 0) return;
    vertex_[At(cell)] = static_cast<Index>(surface_.points.size());
    surface_.points.push_back(sum * (1.0 / crossings));
  }

  // One around each edge that the surface crosses.
  void AddQuads(const Cell& corner) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Cell end = corner;
      ++end[axis];
      const bool inside = values_[At(corner)] < 0;
      if (inside == (values_[At(end)] < 0)) continue;
      std::array<Index, 4> quad{};
      for (std::size_t k = 0; k < 4; ++k) {
        Cell cell = corner;
        if (k == 0 || k == 3) --cell[(axis + 1) % 3];
        if (k < 2) --cell[(axis + 2) % 3];
        quad[k] = vertex_[At(cell)];
      }
      if (!inside) std::swap(quad[1], quad[3]);
      surface_.quads.push_back(quad);
    }
  }

  Double3 OntoSurface(Double3 p) const {
    const double step = 0.05 * cell_, distance = part_.distance(p);
    Double3 slope;
    for (int k = 0; k < 3; ++k) {
      Double3 beside = p;
      beside[k] += step;
      slope[k] = (part_.distance(beside) - distance) / step;
    }
    const double square = Dot(slope, slope);
    if (!(square > 1e-4)) return p;
    return p - slope * (std::clamp(distance / square, -0.5 * cell_, 0.5 * cell_));
  }

  void Relax() {
    const std::vector<std::vector<Index>> neighbours = surface_.Neighbours();
    for (int round = 0; round < kRelaxations; ++round) {
      std::vector<Double3> next = surface_.points;
      for (std::size_t i = 0; i < next.size(); ++i) {
        Double3 mean;
        for (Index n : neighbours[i]) mean = mean + surface_.points[n];
        if (!neighbours[i].empty())
          next[i] = OntoSurface((next[i] + mean * (1.0 / static_cast<double>(neighbours[i].size()))) * 0.5);
      }
      surface_.points = std::move(next);
    }
  }

  const Part& part_;
  double cell_;
  Double3 origin_;
  std::array<std::size_t, 3> count_{};
  std::vector<double> values_;  // at corners, x fastest
  std::vector<Index> vertex_;   // by cell, as its first corner
  Surface surface_;
};

}  // namespace

std::vector<std::vector<Index>> Surface::Neighbours() const {
  std::vector<std::vector<Index>> out(points.size());
  for (const auto& quad : quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      const Index a = quad[k], b = quad[(k + 1) % 4];
      out[a].push_back(b), out[b].push_back(a);
    }
  }
  for (std::vector<Index>& list : out) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return out;
}

Surface MakeSurface(const Part& part, std::size_t points) {
  const Double3 size = part.high - part.low;
  // As if it were the box
  double cell = std::sqrt(2 * (size.x * size.y + size.y * size.z + size.z * size.x) /
                          static_cast<double>(std::max<std::size_t>(points, 8)));
  Surface best;
  for (int search = 0; search < kSearches; ++search) {
    Surface surface = Net(part, cell).Make();
    const double ratio = static_cast<double>(surface.points.size()) / static_cast<double>(points);
    const auto distance = [&](const Surface& s) {
      return std::fabs(static_cast<double>(s.points.size()) - static_cast<double>(points));
    };
    if (best.points.empty() || distance(surface) < distance(best)) best = std::move(surface);
    if (std::fabs(ratio - 1) < kNearEnough) break;
    cell *= std::sqrt(std::clamp(ratio, 0.05, 20.0));
  }
  return best;
}

}  // namespace kpsa::engine::untouched
