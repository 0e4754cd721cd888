// Inside of the rig reader: the sections of one file. Nothing outside rig/file/rig_file*.cpp includes this.
#pragma once

#include <functional>
#include <string>

#include "rig/file/rig_file.h"

namespace kpsa::engine {

struct SectionReader {
  RigFile* rig;
  YamlErrors* errors;
  int source;  // of the file that is read
  // Notes a key of a section; false if it was defined before, in this file or another.
  std::function<bool(const std::string& section, const std::string& key, const SourceLocation& where)> define;

  void ReadNodes(const YamlNode& node);
  void ReadConnections(const YamlNode& node);
  void ReadDeform(const YamlNode& node);
  void ReadControls(const YamlNode& node);
  void ReadAccelerate(const YamlNode& node);
  void ReadOverrides(const YamlNode& node);
  void ReadVariants(const YamlNode& node);
  void ReadClips(const YamlNode& node);       // rig/file/clips.cpp
  void ReadReferences(const YamlNode& node);  // the same

 private:
  bool CheckMap(const YamlNode& node, const char* section) const;
  // What a section's key declares, with its name and place.
  template <typename T>
  T Declared(const YamlNode& key) const {
    T declared;
    declared.name = key.scalar;
    declared.where = key.where();
    declared.source = source;
    return declared;
  }
  bool ReadNames(const YamlNode& node, const std::string& what, std::vector<RigString>* names) const;
  void ReadLayer(const YamlNode& node, RigClip* clip) const;
  void ReadAcceleratePoints(const YamlNode& node, RigAccelerateEntry* accelerate) const;
  const std::string& scope() const { return rig->sources[static_cast<std::size_t>(source)].scope; }
  const FileUnits& units() const { return rig->sources[static_cast<std::size_t>(source)].units; }
};

}  // namespace kpsa::engine
