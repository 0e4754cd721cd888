// What decides a random graph: a seed, or bytes (of a fuzzer), which are 0 after their end.
#pragma once

#include <cstdint>
#include <random>
#include <span>

namespace kpsa::engine {

class Choices {
 public:
  explicit Choices(unsigned seed) : random_(seed) {}
  explicit Choices(std::span<const std::uint8_t> bytes) : of_bytes_(true), bytes_(bytes) {}

  // Below `count`, which is 65536 at most.
  int Pick(int count) {
    if (!of_bytes_) return static_cast<int>(random_() % static_cast<unsigned>(count));
    unsigned value = Byte();
    if (count > 256) value = value << 8 | Byte();
    return static_cast<int>(value % static_cast<unsigned>(count));
  }
  bool Chance(int percent) { return Pick(100) >= 100 - percent; }  // bytes of 0 choose nothing
  bool over() const { return of_bytes_ && bytes_.empty(); }

 private:
  unsigned Byte() {
    if (bytes_.empty()) return 0;
    const unsigned value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }

  std::mt19937 random_;
  bool of_bytes_ = false;
  std::span<const std::uint8_t> bytes_;
};

}  // namespace kpsa::engine
