// Inside of the rig builder: what every one of its steps may read, and where it reports. Nothing outside rig/build
// includes this. What else a step reads is handed to it const, and what it writes by pointer.
#pragma once

#include <string>
#include <utility>

#include "rig/build/rig_builder.h"
#include "rig/build/rig_names.h"
#include "rig/file/rig_file.h"

namespace kpsa::engine {

struct BuildInput {
  const RigFile& file;
  const Rig& rig;  // as far as it is built
  const RigNames& names;
  YamlErrors* errors;

  const Graph& graph() const { return *rig.graph; }
  // Of a file of the rig, by its index in RigFile::sources.
  const FileUnits& units(int source) const { return file.sources[static_cast<std::size_t>(source)].units; }
  // False, with an error at the place, where `status` is one.
  bool Fail(const SourceLocation& where, Status status) const {
    if (status.ok()) return true;
    errors->Append(std::move(status).At(where));
    return false;
  }
  // The same of a plug that a file names; no second error where its node could not be made.
  bool FailPlug(const SourceLocation& where, const std::string& plug, Status status) const {
    if (!status.ok() && names.LacksNodeOf(plug)) return false;
    return Fail(where, std::move(status));
  }
};

}  // namespace kpsa::engine
