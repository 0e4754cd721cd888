// The temporary files that this process is writing: what a program removes that a signal ends.
#pragma once

#include <string>

namespace kpsa::engine {

// To be called before the file is created; more than kMostTemporaries at once are not known. Thread-safe.
void AddTemporary(const std::string& path);
// The file has its final name, or is removed.
void DropTemporary(const std::string& path);
inline constexpr int kMostTemporaries = 64;

// Removes all that are known. Async-signal-safe (signal-safety(7)): the process is about to end.
void RemoveTemporaries();

}  // namespace kpsa::engine
