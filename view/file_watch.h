// Whether files have changed: their times of modification and sizes, compared.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kpsa::engine {

class FileWatch {
 public:
  // From now on these as well; those that are known already stay as they were seen.
  void Add(const std::vector<std::string>& files);
  // From now on these alone.
  void Keep(const std::vector<std::string>& files);
  // Whether any is another than when it was seen last, has come or has gone; sees them as they are now.
  bool Look();

 private:
  struct Seen {
    std::string path;
    std::int64_t modified = -1;  // nanoseconds; -1: there is none
    std::uint64_t size = 0;
    bool operator==(const Seen&) const = default;
  };
  static Seen SeenNow(const std::string& path);
  std::vector<Seen> seen_;
};

}  // namespace kpsa::engine
