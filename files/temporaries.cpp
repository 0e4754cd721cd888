#include "files/temporaries.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>

namespace kpsa::engine {
namespace {

// A handler sees a whole name or none
std::atomic<char*> names[kMostTemporaries];
static_assert(std::atomic<char*>::is_always_lock_free);

}  // namespace

void AddTemporary(const std::string& path) {
  char* name = ::strdup(path.c_str());
  if (name == nullptr) return;
  for (std::atomic<char*>& slot : names) {
    char* none = nullptr;
    if (slot.compare_exchange_strong(none, name)) return;
  }
  std::free(name);
}

void DropTemporary(const std::string& path) {
  for (std::atomic<char*>& slot : names) {
    char* name = slot.load();
    if (name == nullptr || path != name) continue;
    // Not freed where a handler has taken it
    if (slot.compare_exchange_strong(name, nullptr)) std::free(name);
    return;
  }
}

void RemoveTemporaries() {
  for (std::atomic<char*>& slot : names) {
    // Taken meanwhile: whoever drops it now does not free it
    char* const name = slot.exchange(nullptr);
    if (name == nullptr) continue;
    ::unlink(name);
    slot.store(name);
  }
}

}  // namespace kpsa::engine
