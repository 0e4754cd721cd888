// What training tried and promised, as tables of the viewer's page.
#pragma once

#include <vector>

#include "host/acceleration.h"
#include "report/page_table.h"

namespace kpsa::engine {

// Of every subspace; those without rows are left out.
std::vector<PageTable> TrainingTables(const std::vector<AppliedSubspace>& applied);

}  // namespace kpsa::engine
