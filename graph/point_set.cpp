#include "graph/point_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <stdexcept>

namespace kpsa::engine {

PointSet PointSet::All(Index total) {
  PointSet set;
  set.total_ = total;
  set.all_ = true;
  return set;
}

PointSet PointSet::None(Index total) {
  PointSet set;
  set.total_ = total;
  return set;
}

PointSet PointSet::Of(std::vector<Index> indices, Index total) {
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  if (!indices.empty() && indices.back() >= total)
    throw std::out_of_range(fmt::format("point {} of {}", indices.back(), total));
  if (indices.size() == total) return All(total);
  PointSet set = None(total);
  set.indices_ = std::make_shared<const std::vector<Index>>(std::move(indices));
  return set;
}

std::vector<Index> PointSet::ToVector() const {
  if (!all_) return indices_ == nullptr ? std::vector<Index>() : *indices_;
  std::vector<Index> indices(total_);
  std::iota(indices.begin(), indices.end(), Index{0});
  return indices;
}

bool PointSet::Contains(Index point) const {
  if (all_) return point < total_;
  return indices_ != nullptr && std::binary_search(indices_->begin(), indices_->end(), point);
}

void PointSet::CheckTotal(const PointSet& other) const {
  if (total_ != other.total_)
    throw std::logic_error(
        fmt::format("a set of {} points and one of {} are not of the same points", total_, other.total_));
}

bool PointSet::Includes(const PointSet& other) const {
  CheckTotal(other);
  if (all_ || other.empty()) return true;
  if (other.all_ || other.size() > size()) return false;
  return std::includes(indices_->begin(), indices_->end(), other.indices_->begin(), other.indices_->end());
}

PointSet PointSet::Union(const PointSet& other) const {
  CheckTotal(other);
  if (all_ || other.empty()) return *this;
  if (other.all_ || empty()) return other;
  std::vector<Index> merged;
  merged.reserve(size() + other.size());
  std::set_union(indices_->begin(), indices_->end(), other.indices_->begin(), other.indices_->end(),
                 std::back_inserter(merged));
  return Of(std::move(merged), total_);
}

std::vector<Index> PointSet::PositionsOf(const PointSet& subset) const {
  CheckTotal(subset);
  std::vector<Index> positions(subset.size());
  Index at = 0;
  for (Index i = 0; i < subset.size(); ++i) {
    const Index point = subset[i];
    if (all_) {
      positions[i] = point;
      continue;
    }
    while (at < size() && (*indices_)[at] < point) ++at;
    if (at >= size() || (*indices_)[at] != point)
      throw std::out_of_range(fmt::format("point {} is not in the set", point));
    positions[i] = at;
  }
  return positions;
}

Digest PointSet::digest() const {
  Hasher hasher;
  hasher.Add(total_);
  hasher.Add(all_);
  if (indices_ != nullptr) hasher.Add(std::span<const Index>(indices_->data(), indices_->size()));
  return hasher.Finish();
}

bool operator==(const PointSet& a, const PointSet& b) {
  if (a.total_ != b.total_ || a.all_ != b.all_ || a.size() != b.size()) return false;
  return a.all_ || a.empty() || a.indices_ == b.indices_ || *a.indices_ == *b.indices_;
}

}  // namespace kpsa::engine
