// A check of JSON documents against the part of JSON Schema (draft 2020-12) that kpsa's schemas use.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace kpsa::engine {

// What is wrong with the value, each at its place ("/nodes/mush/iterations: ..."). A keyword that this check
// does not know is a fault of the schema, and reported too.
std::vector<std::string> SchemaProblems(const nlohmann::json& schema, const nlohmann::json& value);

}  // namespace kpsa::engine
