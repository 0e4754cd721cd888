// What the page shows of a rig that is evaluated live, besides what report/page_rig.h writes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "report/page_data.h"
#include "rig/build/rig_builder.h"
#include "view/handles.h"

namespace kpsa::engine {

// Its own key: the smallest one in force, metres; none where any error may pass.
void PutTolerance(const std::vector<AppliedSubspace>& applied, PageData* page);
// clips: the frames that kpsa eval evaluates of each; `first` comes first. Errors: no such clip, one that is too long.
Status PutClipTimes(const Rig& rest, const std::optional<std::string>& first, PageData* page);
// handles: places at rest, one each. None without any.
void PutHandles(const Rig& rest, const std::vector<Handle>& handles, const std::vector<Double3>& places,
                PageData* page);

}  // namespace kpsa::engine
