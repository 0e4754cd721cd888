// A report as a browser reads it: the meta and the blobs of a page (docs/viewer-data.md).
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace kpsa::engine {

struct ReadPage {
  nlohmann::json meta;
  std::map<std::string, std::string> blobs;  // bytes, inflated
  std::string error;                         // what is wrong with the page; "": nothing

  // Of a blob of that type. The count must be that of the meta; else empty, and a failure is added.
  std::vector<float> Floats(const std::string& name) const;
  std::vector<int> Wholes(const std::string& name) const;  // i8, i16 or u8
  // [V, 3] of a row of the shape, computed naively in float64.
  std::vector<double> Positions(std::size_t row) const;
};

// Parses as a browser does: an element ends at the first "</script".
ReadPage ParsePage(const std::string& html);
std::string FromBase64(const std::string& text);

}  // namespace kpsa::engine
