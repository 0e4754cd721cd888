// Changes to a rig's graph from code, as its YAML file would make them.
#pragma once

#include <span>
#include <string_view>

#include "kpsa/result.h"

namespace kpsa {

// The graph of a copy of a rig, while Rig::Edited runs. Every change is checked; a refused one changes nothing.
class GraphEdit {
 public:
  // A node of a registered type. Errors: no such type (the nearest is named), a name that is taken.
  Result<Done> AddNode(std::string_view type, std::string_view name);
  // A number in the units of the rig's file, a vector, a quaternion or a matrix (column by column), a choice or a text.
  // Structural attributes may be set, too.
  Result<Done> Set(std::string_view plug, double value);
  Result<Done> Set(std::string_view plug, std::span<const double> values);
  Result<Done> Set(std::string_view plug, std::string_view text);
  // As `connections:` of a rig: between numbers of the same unit they go over as they are; between an angle or a
  // length and a plain number, which counts in the units of the rig's file, a unitConversion comes in. Types have
  // to agree; a cycle is refused with its path. A plug that something drives takes the new source.
  Result<Done> Connect(std::string_view source, std::string_view destination);
  Result<Done> Disconnect(std::string_view destination);
  // Puts a deformer at the end of a mesh's stack, where its points are named mesh@node.
  Result<Done> Deform(std::string_view mesh, std::string_view node);

 private:
  friend class Rig;
  struct Impl;
  explicit GraphEdit(Impl* impl) : impl_(impl) {}
  Impl* impl_;
};

}  // namespace kpsa
