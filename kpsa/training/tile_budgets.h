// How finely tiles are stored: the errors that bytes and lower ranks may add. Internal to training.
#pragma once

#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {

enum class TileStorage : std::uint8_t {
  kForAllPoints,  // the coarsest: cues for all points hardly see what a tile adds
  kOwnCues,       // of tiles with cues of their own: thousands of columns are read, but errors count, too
  kFinely,        // of either, where many poses would miss: errors count more than bytes
  kLight,         // as kForAllPoints; what its modes leave out is noise, which nobody wants
};

inline TileOptions TileBudget(TileStorage storage, double tolerance) {
  // Of what the modes leave out (RMS): where few of them leave out more than the tolerance asks of tiles,
  // finer ones would buy nothing
  constexpr double kLeftOut = 0.25;
  switch (storage) {
    case TileStorage::kForAllPoints:
      return {0.05 * tolerance, 0.6 * tolerance, kLeftOut};
    case TileStorage::kOwnCues:
      return {0.05 * tolerance, 0.4 * tolerance, kLeftOut};
    case TileStorage::kFinely:
      return {0.03 * tolerance, 0.2 * tolerance, kLeftOut};
    case TileStorage::kLight:
      return {0.05 * tolerance, 0.6 * tolerance, 0};
  }
  return {};
}

}  // namespace kpsa::engine
