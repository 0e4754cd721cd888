#include "kpsa/tile_panels_vnni.h"

#include "base/check.h"
#include "kpsa/tiles.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define KPSA_VNNI __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vnni,fma")))

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxGroups = (2 * kMaxTileRank + 32) / 4;

// The two bytes of the inputs of a frame, four to a group in the order of U's bytes: q = 256 high + low, both
// signed.
struct InputBytes {
  alignas(64) std::int32_t high[kMaxGroups], low[kMaxGroups];
  std::size_t high_groups = 0;  // beyond these all of `high` are zero: small inputs come last
};

KPSA_VNNI inline void SplitInputs(const std::int16_t* q, std::size_t groups, InputBytes* bytes) {
  // Bytes 0 and 2 of four meet the first two inputs
  const __m256i order =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 2, 1, 3, 4, 6, 5, 7, 8, 10, 9, 11, 12, 14, 13, 15));
  for (std::size_t g = 0; g < groups; g += 8) {
    const __m512i all = _mm512_load_si512(q + 4 * g);
    const __m512i low = _mm512_srai_epi16(_mm512_slli_epi16(all, 8), 8);
    const __m512i high = _mm512_srai_epi16(_mm512_sub_epi16(all, low), 8);
    _mm256_store_si256(reinterpret_cast<__m256i*>(bytes->low + g),
                       _mm256_shuffle_epi8(_mm512_cvtepi16_epi8(low), order));
    _mm256_store_si256(reinterpret_cast<__m256i*>(bytes->high + g),
                       _mm256_shuffle_epi8(_mm512_cvtepi16_epi8(high), order));
  }
  bytes->high_groups = groups;
  while (bytes->high_groups > 0 && bytes->high[bytes->high_groups - 1] == 0) --bytes->high_groups;
}

// _mm512_dpbusd_epi32 in place: GCC 12 keeps its result elsewhere and copies it back, for as much again.
KPSA_VNNI inline void AddProducts(__m512i* sum, __m512i bytes, __m512i q) {
  asm("vpdpbusd %2, %1, %0" : "+v"(*sum) : "v"(bytes), "v"(q));
}

// (sum of high * 256 + low) * step + mean
KPSA_VNNI inline __m512 Position(__m512i high, __m512i low, __m512 step, const float* mean) {
  const __m512i sum = _mm512_add_epi32(_mm512_slli_epi32(high, 8), low);
  return _mm512_fmadd_ps(_mm512_cvtepi32_ps(sum), step, _mm512_load_ps(mean));
}

// A row of kpsa/rigid_points.cpp's product.
KPSA_VNNI inline __m512 Transformed(const float* m, __m512 x, __m512 y, __m512 z) {
  return _mm512_fmadd_ps(_mm512_set1_ps(m[0]), x,
                         _mm512_fmadd_ps(_mm512_set1_ps(m[3]), y,
                                         _mm512_fmadd_ps(_mm512_set1_ps(m[6]), z, _mm512_set1_ps(m[9]))));
}

// kVectors of a panel's rows at a time.
template <int kComponents, int kVectors>
KPSA_VNNI inline void Panels(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                             std::size_t first, const InputBytes& bytes, const TileFrame& frame) {
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  const std::size_t padded = PaddedCount(frame.out.count);
  for (std::size_t p = 0; p < panels; ++p, u += 4 * groups * kRows, mean += kRows, first += kPanelPoints) {
    const bool whole = first + kPanelPoints <= padded;
#pragma GCC unroll 2
    for (std::size_t row = 0; row < kRows; row += 16 * kVectors) {
      __m512i high[kVectors], low[kVectors];
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v)
        high[v] = _mm512_setzero_si512(), low[v] = _mm512_set1_epi32(-frame.bias);
      const std::uint8_t* at = u + 4 * row;
      std::size_t g = 0;
      for (; g < bytes.high_groups; ++g, at += 4 * kRows) {
        const __m512i q_high = _mm512_set1_epi32(bytes.high[g]), q_low = _mm512_set1_epi32(bytes.low[g]);
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) {
          const __m512i columns = _mm512_load_si512(at + 64 * v);
          AddProducts(&high[v], columns, q_high);
          AddProducts(&low[v], columns, q_low);
        }
      }
      for (; g < groups; ++g, at += 4 * kRows) {
        const __m512i q_low = _mm512_set1_epi32(bytes.low[g]);
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) AddProducts(&low[v], _mm512_load_si512(at + 64 * v), q_low);
      }
      float* const components[3] = {frame.out.x, frame.out.y, frame.out.z};
      const __m512 step = _mm512_set1_ps(frame.step);
      __m512 position[kVectors];
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v)
        position[v] = Position(high[v], low[v], step, mean + row + 16 * static_cast<std::size_t>(v));
      if constexpr (kVectors == 6) {
        if (frame.space != nullptr) {
          const float* m = frame.space->data();
#pragma GCC unroll 2
          for (int v = 0; v < 2; ++v) {
            const __m512 x = position[v], y = position[v + 2], z = position[v + 4];
            position[v] = Transformed(m, x, y, z);
            position[v + 2] = Transformed(m + 1, x, y, z);
            position[v + 4] = Transformed(m + 2, x, y, z);
          }
        }
      }
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t to = row + 16 * static_cast<std::size_t>(v), point = first + to % kPanelPoints;
        if (whole || point < padded) _mm512_store_ps(components[to / kPanelPoints] + point, position[v]);
      }
    }
  }
}

template <int kComponents>
KPSA_VNNI void Tile(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                    std::size_t first, const TileFrame* frames, std::size_t frame_count) {
  InputBytes bytes[kBlockFrames];
  for (std::size_t f = 0; f < frame_count; ++f) SplitInputs(frames[f].q, groups, &bytes[f]);
  for (std::size_t f = 0; f < frame_count; ++f)
    Panels<kComponents, 2 * kComponents>(u, panels, groups, mean, first, bytes[f], frames[f]);
}

}  // namespace

bool HasVnni() {
  static const bool has = __builtin_cpu_supports("avx512vnni") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  return has;
}

void TilePanelsVnni(const std::uint8_t* u, std::size_t panels, std::size_t groups, int components,
                    const float* mean, std::size_t first, const TileFrame* frames, std::size_t frame_count) {
  KPSA_DCHECK(frame_count <= kBlockFrames && groups <= kMaxGroups);
  components == 3 ? Tile<3>(u, panels, groups, mean, first, frames, frame_count)
                  : Tile<1>(u, panels, groups, mean, first, frames, frame_count);
}

}  // namespace kpsa::engine
#else
namespace kpsa::engine {
bool HasVnni() { return false; }
void TilePanelsVnni(const std::uint8_t*, std::size_t, std::size_t, int, const float*, std::size_t,
                    const TileFrame*, std::size_t) {
  KPSA_CHECK(false);
}
}  // namespace kpsa::engine
#endif
