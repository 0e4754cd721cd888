// Rigs that tests write name characters of this checkout, plugins of its build, and the assets beside it. What is refused
// where nobody trusts anything is tested without it (tests/cli/trusted_test.cpp).
#include <cstdlib>

#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

[[maybe_unused]] const bool kTrusted = [] {
  const std::string folders = std::string(KPSA_TESTS_TRUST) + ":" + SharedFile("assets");
  return setenv("KPSA_TRUST", folders.c_str(), 0) == 0;
}();

}  // namespace
}  // namespace kpsa::engine
