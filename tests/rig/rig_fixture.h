// Rigs from text, on a small character: a triangle `body` (joints root and tip, morph target `up`), clip
// `wave`.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "rig/build/rig_builder.h"
#include "nodes/standard_nodes.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {

inline const NodeRegistry& StandardRegistry() {
  static const NodeRegistry* registry = [] {
    auto* r = new NodeRegistry;
    AddStandardNodes(*r);
    return r;
  }();
  return *registry;
}

inline bool Has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

class RigFixture : public ::testing::Test {
 protected:
  RigFixture() { folder.Write("c.gltf", GltfBuilder::Character().Text()); }

  // `text` follows the two lines that every rig here has, so that its own first line is line 3.
  Result<Rig> Load(const std::string& text, const RigOptions& options = {}) {
    return LoadRig(StandardRegistry(), folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\n" + text),
                   options);
  }
  Rig Loaded(const std::string& text, const RigOptions& options = {}) {
    Result<Rig> rig = Load(text, options);
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    if (rig.ok()) return std::move(*rig);
    rig = LoadRig(StandardRegistry(), folder / "c.gltf");  // so that the test can go on
    return std::move(*rig);
  }
  // All errors of a rig, without the folder in front of file names.
  std::string Errors(const std::string& text, const RigOptions& options = {}) {
    Result<Rig> rig = Load(text, options);
    return rig.ok() ? "no error" : Short(rig.status().ToString());
  }
  std::string Short(std::string text) const {
    for (std::size_t at; (at = text.find(folder.path() + "/")) != std::string::npos;)
      text.erase(at, folder.path().size() + 1);
    return text;
  }
  static std::string Driver(const Rig& rig, const std::string& name) {
    const Result<PlugRef> plug = rig.graph->FindPlug(name);
    if (!plug.ok()) return plug.status().ToString();
    const Connection* connection = rig.graph->FindConnection(*plug);
    return connection == nullptr ? "" : rig.graph->PlugName(connection->source);
  }
  static Value Held(const Rig& rig, const std::string& name) {
    const Result<PlugRef> plug = rig.graph->FindPlug(name);
    EXPECT_TRUE(plug.ok()) << plug.status().ToString();
    const Value* value = plug.ok() ? rig.graph->FindValue(*plug) : nullptr;
    return value == nullptr ? Value() : *value;
  }

  TemporaryFolder folder;
};

}  // namespace kpsa::engine
