// The graph of a rig, its cues and its fields on the viewer's page (docs/viewer-data.md).
#pragma once

#include <cstddef>
#include <vector>

#include "host/bench/bench_result.h"
#include "host/cue_marks.h"
#include "host/node_outline.h"
#include "report/page_data.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Its own key, with the times a frame of those nodes that have any. `accelerated`: nodes have states.
void PutNodes(const std::vector<OutlinedNode>& nodes, bool accelerated,
              const std::vector<BenchNode>& full_times, const std::vector<BenchNode>& accelerated_times,
              PageData* page);
// Its own key; none without cues. cue_us: BenchResult's, or none where nothing was measured.
void PutCues(const std::vector<CueMark>& cues, const std::vector<std::vector<double>>& cue_us,
             PageData* page);

inline constexpr std::size_t kMostFieldBlobs = 64;
// `fields` with their weights as blobs (FieldsOf); false and nothing where there are more than kMostFieldBlobs.
bool PutFieldBlobs(const Rig& rig, PageData* page);

}  // namespace kpsa::engine
