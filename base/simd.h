// Highway's door. A kernel source that wants SIMD is compiled once for every target and dispatches at run
// time:
//
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "nodes/kernels/skin.cpp"
//   #include "hwy/foreach_target.h"
//   #include "base/simd-inl.h"        // kpsa::engine::HWY_NAMESPACE::Fma and friends, after foreach_target
//
// All targets give the same bits: they have fused multiply-add, or emulate it lane by lane (base/simd-inl.h).
// The environment variable KPSA_SIMD (avx512, avx2, neon, scalar) limits the choice; ApplySimdChoice reads it.
#pragma once

#include <string>

namespace kpsa::engine {

// Reads KPSA_SIMD and restricts dispatch to that target; an unknown or unsupported name gives a message.
// Returns "" if all is well. Call once at start, before the first kernel runs. Not thread-safe.
std::string ApplySimdChoice();
// Restricts dispatch by name ("avx512", "avx2", "neon", "scalar"; "" for the best); false if the machine lacks it.
bool SelectSimdTarget(const std::string& name);
// The name of the target in use.
std::string SimdTargetName();

}  // namespace kpsa::engine
