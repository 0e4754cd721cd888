# kpsa_settings: how every source of this project is compiled, and nothing of another's that links to it.
add_library(kpsa_settings INTERFACE)
if(KPSA_COMPILE_ONCE)
  set(KPSA_WERROR OFF)  # the release build has the warnings; GCC's are not reliable with sanitizers
else()
  target_compile_options(kpsa_settings INTERFACE -Wall -Wextra)
endif()
# No contraction: results may not depend on the compiler's mood
target_compile_options(kpsa_settings INTERFACE -ffp-contract=off -fno-math-errno -fno-semantic-interposition)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # False alarms about std::string (GCC bugs 105651 and 105329); from a precompiled header they are not hidden
  target_compile_options(kpsa_settings INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
  # Vectors of 32 bytes as parameters: of functions that are inlined, so that no ABI has them
  target_compile_options(kpsa_settings INTERFACE -Wno-psabi)
  if(KPSA_UNITY)  # takes a source that is included for a header; and its garbage is not worth collecting (a tenth of the time)
    target_compile_options(kpsa_settings INTERFACE -Wno-subobject-linkage "SHELL:--param ggc-min-heapsize=1500000")
  endif()
endif()
if(KPSA_COMPILE_ONCE)
  set(KPSA_NO_TARGETS "HWY_SSSE3|HWY_SSE4|HWY_AVX3|HWY_AVX3_DL")  # what most machines have, and the narrowest
else()
  set(KPSA_NO_TARGETS "HWY_SSSE3|HWY_SSE4|HWY_AVX3_DL")
endif()
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  set(KPSA_NO_TARGETS "HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128")  # kernels hold vectors in structs
endif()
target_compile_definitions(kpsa_settings INTERFACE HWY_DISABLED_TARGETS=${KPSA_NO_TARGETS})
if(KPSA_WERROR)
  target_compile_options(kpsa_settings INTERFACE -Werror)
endif()
if(KPSA_SANITIZE)
  target_compile_definitions(kpsa_settings INTERFACE KPSA_WITH_ASAN)
  target_compile_options(kpsa_settings INTERFACE -fsanitize=address,undefined -fno-sanitize=vptr,object-size,null,pointer-overflow
                         -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(kpsa_settings INTERFACE -fsanitize=address,undefined)
endif()
if(KPSA_FUZZ)
  target_compile_options(kpsa_settings INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(KPSA_TSAN)
  target_compile_definitions(kpsa_settings INTERFACE KPSA_WITH_TSAN)
  target_compile_options(kpsa_settings INTERFACE -fsanitize=thread)
  target_link_options(kpsa_settings INTERFACE -fsanitize=thread)
endif()
if((KPSA_SANITIZE OR KPSA_TSAN) AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  target_compile_options(kpsa_settings INTERFACE -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/unchecked.txt)
endif()

# Linking with symbols and sanitizers is slow with GNU's linker; lld is used where it is installed
find_program(KPSA_LLD ld.lld)
if(KPSA_LLD)
  target_link_options(kpsa_settings INTERFACE -fuse-ld=lld)
endif()
find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # What ccache needs to cache sources with precompiled headers
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
endif()

# Precompiled headers: the standard library's and other libraries', never the project's own. That headers include what
# they use is a test of its own (tests/architecture).
set(KPSA_COMMON_HEADERS <algorithm> <array> <atomic> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional> <limits> <map> <memory>
    <mutex> <optional> <set> <span> <string> <string_view> <unordered_map> <utility> <variant> <vector> <fmt/format.h>)
