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

// kVectors of a panel's rows at a time, for some frames.
template <int kComponents, int kFrames, int kVectors>
KPSA_VNNI inline void Panels(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                             std::size_t first, const InputBytes* bytes, const TileFrame* frames) {
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  const std::size_t padded = PaddedCount(frames[0].out.count);
  for (std::size_t p = 0; p < panels; ++p, u += 4 * groups * kRows, mean += kRows, first += kPanelPoints) {
#pragma GCC unroll 2
    for (std::size_t row = 0; row < kRows; row += 16 * kVectors) {
      __m512i high[kFrames][kVectors], low[kFrames][kVectors];
#pragma GCC unroll 4
      for (int f = 0; f < kFrames; ++f) {
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) {
          high[f][v] = _mm512_setzero_si512();
          low[f][v] = _mm512_set1_epi32(-frames[f].bias);
        }
      }
      for (std::size_t g = 0; g < groups; ++g) {
        const std::uint8_t* at = u + 4 * (g * kRows + row);
        __m512i columns[kVectors];
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) columns[v] = _mm512_load_si512(at + 64 * v);
#pragma GCC unroll 4
        for (int f = 0; f < kFrames; ++f) {
          const __m512i q_high = _mm512_set1_epi32(bytes[f].high[g]),
                        q_low = _mm512_set1_epi32(bytes[f].low[g]);
#pragma GCC unroll 6
          for (int v = 0; v < kVectors; ++v) {
            AddProducts(&high[f][v], columns[v], q_high);
            AddProducts(&low[f][v], columns[v], q_low);
          }
        }
      }
#pragma GCC unroll 4
      for (int f = 0; f < kFrames; ++f) {
        float* const components[3] = {frames[f].out.x, frames[f].out.y, frames[f].out.z};
        const __m512 step = _mm512_set1_ps(frames[f].step);
        __m512 position[kVectors];
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v)
          position[v] = Position(high[f][v], low[f][v], step, mean + row + 16 * static_cast<std::size_t>(v));
        if constexpr (kVectors == 6) {
          if (frames[f].space != nullptr) {
            const float* m = frames[f].space->data();
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
          const std::size_t at = row + 16 * static_cast<std::size_t>(v), point = first + at % kPanelPoints;
          if (point < padded) _mm512_store_ps(components[at / kPanelPoints] + point, position[v]);
        }
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
    Panels<kComponents, 1, 2 * kComponents>(u, panels, groups, mean, first, bytes + f, frames + f);
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
