// YAML to the values of attributes: the type, unit and range come from the node's definition, and from
// nowhere else.
#pragma once

#include "graph/graph.h"
#include "files/yaml_document.h"

namespace kpsa::engine {

// Whether a value is a connection: a string that is given to a numeric attribute and is no number. Numbers of
// a plug type are bool to matrix, points, colors and weights.
bool IsConnection(const YamlNode& node, const Graph& graph, Type type, Unit unit, const FileUnits& units);

// Reads the value of an attribute (of one element, for arrays; of one component, for components). False, with
// its errors, where it does not fit. Assets cannot be written in a rig.
bool ReadValue(const YamlNode& node, std::string_view what, const AttributeDef& attribute, Type type,
               const FileUnits& units, Value* value, YamlErrors* errors);

// A list of `count` numbers.
bool ReadNumbers(const YamlNode& node, std::string_view what, Unit unit, const FileUnits& units,
                 std::size_t count, std::vector<double>* values, YamlErrors* errors);

// When a clip begins, in seconds: a bare number is a frame.
bool ReadStart(const YamlNode& node, double fps, const FileUnits& units, double* seconds, YamlErrors* errors);

}  // namespace kpsa::engine
