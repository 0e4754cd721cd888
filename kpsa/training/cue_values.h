// What cues measure in recorded poses. Internal to training.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>

#include "kpsa/training/cue_selection.h"

namespace kpsa::engine {

using Affine = Eigen::Matrix<double, 3, 4>;  // the upper three rows of a matrix

// The relative matrix whose first entry is a scalar of the layout, in a row of a pose matrix; mean: what the
// rows are centred with, or null.
Affine RelativeMatrix(const PoseLayout& layout, std::span<const float> row, const Eigen::VectorXd* mean,
                      Index first_entry);
// How many times longer than those of a rotation the axes of such a matrix are, about: a power of two, and 1 up to four
// times. Armatures that were exported in other units than their meshes have 100 or 0.01; without it an entry of theirs
// would weigh so much more, and errors in the space of such a joint so much less. mean: as above.
double JointScale(const PoseMatrix& poses, const Eigen::VectorXd* mean, Index first_entry);
// None where there is none.
std::optional<Affine> InverseOf(const Affine& matrix);
Affine Product(const Affine& a, const Affine& b);

// Reads the cues of one row, those in the spaces of joints, too.
class CueReader {
 public:
  CueReader(const PoseLayout& layout, std::span<const float> row, const Eigen::VectorXd* mean)
      : layout_(layout), row_(row), mean_(mean) {}
  // CueHeight numbers, not centred. Where the joint's matrix has no inverse, as if it were the identity.
  void Read(const CueRef& cue, double* values);

 private:
  double At(std::size_t column) const {
    return static_cast<double>(row_[column]) +
           (mean_ == nullptr ? 0 : (*mean_)[static_cast<Eigen::Index>(column)]);
  }
  const PoseLayout& layout_;
  std::span<const float> row_;
  const Eigen::VectorXd* mean_;
  std::map<Index, Affine> back_;  // by joint
};

// Cues as MakeCueSet, their means and scales from the poses, which are centred with `mean`; no loadings and
// no noise. Into `measured` y of the poses [r x T].
CueSet MeasureCues(const PoseMatrix& poses, const Eigen::VectorXd& mean, std::span<const CueRef> cues,
                   Eigen::MatrixXd* measured);

}  // namespace kpsa::engine
