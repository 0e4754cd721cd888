// Which points of an array: all of them, or some in ascending order. Cheap to copy (indices are shared).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/digest.h"
#include "base/types.h"

namespace kpsa::engine {

class PointSet {
 public:
  PointSet() = default;  // empty, of an array of 0 points
  static PointSet All(Index total);
  static PointSet None(Index total);
  // Sorts and removes duplicates; every index must be below total. All of them gives All(total).
  static PointSet Of(std::vector<Index> indices, Index total);

  Index total() const { return total_; }  // points of the array
  Index size() const {
    return all_ ? total_ : static_cast<Index>(indices_ == nullptr ? 0 : indices_->size());
  }
  bool is_all() const { return all_; }
  bool empty() const { return size() == 0; }
  Index operator[](Index i) const { return all_ ? i : (*indices_)[i]; }  // the i-th member
  std::vector<Index> ToVector() const;

  bool Contains(Index point) const;
  bool Includes(const PointSet& other) const;  // every member of other is a member
  PointSet Union(const PointSet& other) const;
  // Positions in this set of the members of a subset.
  std::vector<Index> PositionsOf(const PointSet& subset) const;
  Digest digest() const;
  friend bool operator==(const PointSet& a, const PointSet& b);

 private:
  void CheckTotal(const PointSet& other) const;
  Index total_ = 0;
  bool all_ = false;
  std::shared_ptr<const std::vector<Index>> indices_;
};

}  // namespace kpsa::engine
