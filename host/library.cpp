#include "kpsa/library.h"

#include "base/simd.h"
#include "host/face_impl.h"
#include "host/node_type.h"
#include "host/problems.h"
#include "kpsa/kpsa_node.h"
#include "nodes/standard_nodes.h"

namespace kpsa {

Library::Impl::Impl() {
  static const std::string simd = engine::ApplySimdChoice();  // once, before the first kernel runs
  engine::AddStandardNodes(registry);
  engine::AddKpsaNode(registry);
}

Library::Library() : impl_(std::make_shared<Impl>()) {}
Library::~Library() = default;
Library::Library(const Library&) = default;
Library& Library::operator=(const Library&) = default;

kpsa::Result<Done> Library::AddPlugin(const std::string& path) {
  const engine::Status status = impl_->plugins.Load(path);
  if (!status.ok()) return engine::ProblemsOf(engine::Status(status).At({path}));
  return Done();
}

kpsa::Result<Done> Library::AddNode(const NodeType& type) {
  engine::NodeRegistry added;
  engine::Status status = engine::DeclareNode(type, &added);
  if (status.ok()) status = impl_->plugins.Add(std::move(added));
  if (!status.ok()) return engine::ProblemsOf(status);
  return Done();
}

kpsa::Result<kpsa::Rig> Library::Load(const std::string& path, const LoadOptions& options) const {
  engine::RigOptions rig_options;
  rig_options.rest = true;
  rig_options.fps = options.fps;
  rig_options.variant = options.variant;
  rig_options.trust = options.trust;
  if (options.plugins) rig_options.plugins = &impl_->plugins;
  engine::Result<engine::Rig> rig = engine::LoadRig(impl_->registry, path, rig_options);
  if (!rig.ok()) return engine::ProblemsOf(engine::Status(rig.status()).At({path}));
  return kpsa::Rig(kpsa::Rig::Impl::Make(impl_, std::move(*rig)));
}

}  // namespace kpsa
