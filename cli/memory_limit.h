// How much memory the program may take.
#pragma once

#include <string_view>

#include "base/status.h"

namespace kpsa::engine {

// From here on the process gets no more address space than that: "500MB", "2GB" (of 1024's), "1073741824". What needs
// more fails as an error (exit 3 or 4). Errors, of usage: another text, less than 64 MB, a system that refuses.
Status LimitMemory(std::string_view text);
// Freed memory stays with the process, to be used again: training takes and frees matrices of megabytes all the time, and
// a page that comes back from the system costs more than what is computed in it. Where the C library cannot, nothing.
void KeepFreedMemory();

}  // namespace kpsa::engine
