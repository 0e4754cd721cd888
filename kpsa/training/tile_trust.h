// How far the doubt of each tile is to be believed (kpsa/training/score_choice.h). What products add says how
// far a pose is from where the linear map was good, and not how much is wrong there: where a stack is
// quadratic, products are large and right; where a deltaMush turns its frames over, they are small and wrong.
// Poses that nobody trained on tell by how much each tile errs when it doubts. Internal to training.
#pragma once

#include <span>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/score_choice.h"

namespace kpsa::engine {

// Of each tile, at most 1: its errors to its doubts, in quartic means over the judges that no guard keeps
// from hitting. Relative to the tile that errs most, and at least kLeastTrust, since a clip may go where no
// judge has been. Empty where nothing is doubted.
inline constexpr double kLeastTrust = 0.1;
std::vector<double> TrustInTiles(std::span<const ScoreJudge> judges);

// What the judges would be with doubts times these; subspace: its patches are those that they have, or none.
void WeighDoubts(std::span<const double> trust, const Subspace& subspace, std::span<ScoreJudge> judges);
// Likewise the tiles, output after output.
void WeighTiles(std::span<const double> trust, Subspace* subspace);

}  // namespace kpsa::engine
