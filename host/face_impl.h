// What the classes of the face (include/kpsa) hold.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "graph/node_registry.h"
#include "graph/plugin_loader.h"
#include "host/playing.h"
#include "kpsa/library.h"
#include "kpsa/rig.h"

namespace kpsa {

struct Library::Impl {
  Impl();
  engine::NodeRegistry registry;
  engine::PluginLoader plugins{&registry};
};

struct Rig::Impl {
  std::shared_ptr<Library::Impl> library;                  // whose registry the graph refers to
  engine::Rig rest;                                        // without a clip; never changed
  std::optional<engine::AccelerationChoice> acceleration;  // with the subspaces, which are read once
  std::vector<ControlInfo> controls;
  std::vector<ClipInfo> clips;
  std::vector<MeshInfo> meshes;

  // With what people are told of the rig: controls, clips, meshes.
  static std::shared_ptr<Impl> Make(std::shared_ptr<Library::Impl> library, engine::Rig rest);
  // Shared by scenes that play the clip.
  engine::Result<std::shared_ptr<engine::Playing>> PlayingOf(const std::optional<std::string>& clip) const;

 private:
  mutable std::mutex mutex_;
  mutable std::map<std::optional<std::string>, std::shared_ptr<engine::Playing>> playing_;
};

}  // namespace kpsa
