// Some of many points, which say what the others need: of each tile those that are farthest apart in the rest pose, so
// that a few that lie elsewhere are among them. Internal to training.
#pragma once

#include <optional>

#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// The rig with so many of its points at most, but 1 of 32 at least; nothing where it has no more than `many`. A tile of
// these points covers `every` tiles of all. Errors: the rest pose cannot be evaluated.
Result<std::optional<TrainingRig>> SomePointsOf(const TrainingRig& rig, std::size_t many, std::size_t some);

// That many of the places, ascending: the first one, and then each as far as possible from those before it.
std::vector<Index> FarthestApart(std::span<const Double3> places, std::size_t count);

}  // namespace kpsa::engine
