// Text of USD, as files/usda.cpp writes it. Nothing else includes this.
#pragma once

#include <fmt/format.h>

#include <set>
#include <string>

#include "files/file.h"

namespace kpsa::engine {

// Text in blocks, with its length.
class TextWriter {
 public:
  explicit TextWriter(const ByteSink& sink) : sink_(sink) {}
  template <typename... Args>
  Status Put(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(block_), format, std::forward<Args>(args)...);
    return block_.size() < (1 << 16) ? Status() : Flush();
  }
  Status Flush() {
    written_ += block_.size();
    Status status = sink_({reinterpret_cast<const std::uint8_t*>(block_.data()), block_.size()});
    block_.clear();
    return status;
  }
  std::uint64_t written() const { return written_; }

 private:
  const ByteSink& sink_;
  std::string block_;
  std::uint64_t written_ = 0;
};

// A prim name: letters, digits and underscores, not starting with a digit, not yet in `taken`.
inline std::string PrimName(const std::string& name, std::set<std::string>* taken) {
  std::string prim;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    prim += plain ? c : '_';
  }
  if (prim.empty() || (prim[0] >= '0' && prim[0] <= '9')) prim = "_" + prim;
  std::string unique = prim;
  for (int i = 1; !taken->insert(unique).second; ++i) unique = fmt::format("{}_{}", prim, i);
  return unique;
}

inline std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return quoted + "\"";
}

}  // namespace kpsa::engine
