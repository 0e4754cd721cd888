#include "host/version.h"

#include <fmt/format.h>

#include "base/simd.h"
#include "kpsa/library.h"

namespace kpsa {

std::string_view Version() { return KPSA_VERSION; }

namespace engine {

std::string VersionText() {
  return fmt::format("kpsa {} ({})\ncompiled by {}, {}\nvector unit in use: {}\n{}", KPSA_VERSION,
                     KPSA_COMMIT, KPSA_COMPILER, *KPSA_BUILD_TYPE == '\0' ? "no build type" : KPSA_BUILD_TYPE,
                     SimdTargetName(), KPSA_LIBRARIES);
}

}  // namespace engine
}  // namespace kpsa
