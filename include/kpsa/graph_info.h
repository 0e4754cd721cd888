// A rig's graph, to be walked: what Rig::Nodes, Connections and Value give. Copies; nothing here refers to the rig.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace kpsa {

// An attribute of a node; plugs are "node.attribute", of arrays "node.attribute[2]".
struct PlugInfo {
  std::string name;  // "iterations"
  std::string
      type;  // "double", "int", "bool", "enum", "double3", "quaternion", "matrix", "points", "string", ...
  std::string unit;                  // "", "length", "angle" or "time"
  std::string doc;                   // a sentence, or ""
  bool output = false;               // computed; all others are set or driven
  bool structural = false;           // read when a plan is made
  bool array = false;                // its plugs are its elements
  std::size_t elements = 0;          // of an array that are set or driven
  std::vector<std::string> choices;  // of an enum
};
struct NodeInfo {
  std::string name, type;  // "mush", "deltaMush"
  std::string file;        // where the rig's file writes it; "" for what the character brings
  int line = 0, column = 0;
  std::vector<PlugInfo> plugs;
};
struct ConnectionInfo {
  std::string source, destination;  // "squeeze.outValue", "cage.points[4].x"
};
// Numbers in the units of the rig's file (a matrix column by column), or what else is held as a text: a choice, a
// string, "<mesh>".
struct PlugValue {
  std::vector<double> numbers;
  std::string text;
};

}  // namespace kpsa
