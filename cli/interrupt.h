// What signals do to the program: Ctrl-C and its like end it within half a second, and nothing half-written stays.
#pragma once

#include <atomic>

#include "host/watch.h"

namespace kpsa::engine {

// For the whole process, once:
//  - SIGINT, SIGTERM and SIGHUP: within an InterruptScope the first one sets the flag that Interrupted() reads, says so,
//    and gives the command kGraceMs to come to an end by itself; outside of scopes, after that time, and at the second
//    signal the temporary files (files/temporaries.h) are removed and the program ends with 130.
//  - SIGPIPE, SIGQUIT and SIGABRT: temporary files are removed, then the signal does what it does.
//  - SIGXFSZ: ignored; writing beyond the limit of a file's size is then an error of the write.
void InstallSignalHandlers();
inline constexpr int kGraceMs = 350;

// From here to the end of the scope the program ends by itself where Interrupted() is true.
class InterruptScope {
 public:
  InterruptScope();
  ~InterruptScope();
  InterruptScope(const InterruptScope&) = delete;
  InterruptScope& operator=(const InterruptScope&) = delete;
};
bool Interrupted();
const std::atomic<bool>* InterruptFlag();
Status InterruptedStatus();
// Of calls that an interrupt ends.
Watch InterruptWatch();

}  // namespace kpsa::engine
