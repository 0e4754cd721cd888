// The weight files of the generated rigs.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace kpsa::engine::scenes {

// One map a line, sparse, as rig files read it: name -> one value for each of the mesh's points.
std::string WeightsJson(const std::string& mesh, const std::map<std::string, std::vector<double>>& maps,
                        std::size_t points);

}  // namespace kpsa::engine::scenes
