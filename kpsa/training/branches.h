// Which controls hang from which: the joints of limbs, and the many that hang from one node as a face's do.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "kpsa/training/poses.h"
#include "kpsa/training/random.h"

namespace kpsa::engine {

// Controls [begin, end) of one node.
struct Branch {
  std::size_t begin = 0, end = 0;
  std::optional<std::size_t> above = {};  // the nearest branch whose node carries this one's
};

// The branches of the controls, which a node has next to one another; each weight of a mesh is one. A node carries
// another where its matrix goes into it, or into what lies between.
std::vector<Branch> BranchesOf(const Graph& graph, const std::vector<ControlRange>& controls);

// By branch, whether it stays as it is in a pose that folds limbs: where more than five hang from one, all but five of
// these, and what hangs from them. A body has four limbs and a head, a hand five fingers; a face or a mane has dozens.
std::vector<bool> StillBranches(std::span<const Branch> branches, Random* random);

}  // namespace kpsa::engine
