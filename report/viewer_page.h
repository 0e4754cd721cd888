// The page of reports and of the live view, viewer/dist/viewer.html, as it was when this was built (cmake/Embed.cmake).
#pragma once

#include <string_view>

namespace kpsa::engine {

// Where a report's data goes: it is there once, alone on its line (docs/viewer-data.md).
inline constexpr std::string_view kPagePlaceholder = "<!--kpsa:data-->";

std::string_view ViewerPage();

}  // namespace kpsa::engine
