// Which controls act together, from poses that sweep them one by one.
#pragma once

#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/poses.h"

namespace kpsa::engine {

// Rows [first, first + 2 controls) of the poses are those of Sweeps. Looks at some of the output points; a
// control acts where it moves a point by a good part of what it moves any point.
ControlGroups FindControlGroups(const PoseMatrix& poses, std::size_t first, std::size_t controls);

}  // namespace kpsa::engine
