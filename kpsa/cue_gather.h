// The raw measurement of a frame: cues as the graph gives them, in the frames that they are measured in.
// Entries of one matrix in one frame are taken from their product, which is made once. Immutable; for any
// thread.
#pragma once

#include <span>
#include <vector>

#include "graph/compute_context.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/matrix_entries.h"

namespace kpsa::engine {

class CueGather {
 public:
  CueGather() = default;
  explicit CueGather(const KpsaConfig::Data& data);

  std::size_t scratch_floats() const { return sizeof(Matrix4) / sizeof(float) * 2 * joints_.size(); }
  struct Inputs {
    ArrayView<ConstPointsView> cues;
    ArrayView<Matrix4> matrices;
    ArrayView<double> scalars;
    const Matrix4& world_from_space;
  };
  // raw: in the order of the subspace's rows; scratch: scratch_floats() for doubles.
  void Gather(const Inputs& inputs, float* scratch, std::span<double> raw) const;

 private:
  struct Point {
    Index input = 0, element = 0;  // which cues[], and of these
    Index joint = kNoIndex;        // into joints_
    bool in_space = false, near = false;
    std::size_t row = 0;  // of three
  };
  struct Scalar {
    Index input = 0;
    std::size_t row = 0;
  };
  struct Product {
    KpsaConfig::Product of;
    std::size_t row = 0;
  };
  bool has_space_ = false;
  Double3 rest_origin_;
  std::vector<Index> joints_;  // into matrices
  std::vector<Point> points_;
  std::vector<MatrixBlock> blocks_;  // entries of a matrix that are measured in the same frame
  std::vector<MatrixEntry> entries_;
  std::vector<Scalar> scalars_;
  std::vector<Product> products_;
};

}  // namespace kpsa::engine
