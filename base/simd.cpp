#include "base/simd.h"

#include <cstdlib>

#include "hwy/targets.h"

namespace kpsa::engine {
namespace {

struct Choice {
  const char* name;
  std::int64_t target;
};
constexpr Choice kChoices[] = {
    {"avx512", HWY_AVX3}, {"avx2", HWY_AVX2}, {"neon", HWY_NEON}, {"scalar", HWY_SCALAR | HWY_EMU128}};

}  // namespace

bool SelectSimdTarget(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name.empty()) return true;
  for (const Choice& choice : kChoices) {
    if (name != choice.name) continue;
    if ((hwy::SupportedTargets() & choice.target) == 0) return false;
    hwy::SetSupportedTargetsForTest(choice.target);
    return true;
  }
  return false;
}

std::string ApplySimdChoice() {
  const char* name = std::getenv("KPSA_SIMD");
  if (name == nullptr || SelectSimdTarget(name)) return "";
  return std::string("KPSA_SIMD=") + name +
         ": expected avx512, avx2, neon or scalar, and one that this processor has";
}

std::string SimdTargetName() {
  const std::int64_t supported = hwy::SupportedTargets();
  for (const Choice& choice : kChoices) {
    if ((supported & choice.target) != 0) return choice.name;
  }
  return "scalar";
}

}  // namespace kpsa::engine
