// Checks of what only a programmer can get wrong. A failed check prints both values and aborts; it is active
// in every build type, so keep it out of per-point loops (KPSA_DCHECK is for those).
#pragma once

#include <fmt/format.h>

#include <string>

namespace kpsa::engine {

[[noreturn]] void CheckFailed(const char* file, int line, const char* expression, const std::string& detail);

template <typename T>
std::string CheckText(const T& value) {
  if constexpr (fmt::is_formattable<T>::value) {
    return fmt::format("{}", value);
  } else {
    return "?";
  }
}

}  // namespace kpsa::engine

#define KPSA_CHECK(condition)                                                  \
  do {                                                                         \
    if (!(condition)) ::kpsa::engine::CheckFailed(__FILE__, __LINE__, #condition, ""); \
  } while (false)

#define KPSA_CHECK_OP(a, op, b)                                                                 \
  do {                                                                                          \
    const auto& kpsa_a = (a);                                                                   \
    const auto& kpsa_b = (b);                                                                   \
    if (!(kpsa_a op kpsa_b))                                                                    \
      ::kpsa::engine::CheckFailed(__FILE__, __LINE__, #a " " #op " " #b,                                \
                          ::kpsa::engine::CheckText(kpsa_a) + " against " + ::kpsa::engine::CheckText(kpsa_b)); \
  } while (false)

#define KPSA_CHECK_EQ(a, b) KPSA_CHECK_OP(a, ==, b)
#define KPSA_CHECK_LT(a, b) KPSA_CHECK_OP(a, <, b)
#define KPSA_CHECK_LE(a, b) KPSA_CHECK_OP(a, <=, b)

#ifdef NDEBUG
#define KPSA_DCHECK(condition) \
  do {                         \
  } while (false)
#else
#define KPSA_DCHECK(condition) KPSA_CHECK(condition)
#endif
