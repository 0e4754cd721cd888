// How deep a JSON text is nested, before a parser sees it.
#pragma once

#include <cstdint>
#include <span>

#include "base/status.h"

namespace kpsa::engine {

// A glTF document needs 10, weight files and benches fewer; extras may want more.
inline constexpr int kDeepestJson = 500;

// Bracket depth of the text (strings skipped) is at most max_depth: parsers, printing and comparing recurse.
// The error names no file.
Status CheckJsonDepth(std::span<const std::uint8_t> text, int max_depth = kDeepestJson);

}  // namespace kpsa::engine
