#include "rig/build/steps/check_variants.h"

#include "rig/build/references.h"
#include "rig/file/words.h"

namespace kpsa::engine {

void CheckVariants(const BuildInput& in, const MadeNodes& nodes) {
  for (const RigVariant& variant : in.file.variants) {
    for (const RigOverride& override_ : variant.overrides) {
      const std::string& text = override_.plug.text;
      if (in.errors->full()) return;
      const Result<PlugRef> plug = in.graph().FindPlug(text);
      if (plug.ok() || in.graph().FindPlug(text + "[0]").ok()) continue;
      const std::size_t dot = text.rfind('.');
      const Result<NodeId> node = in.graph().FindNode(text.substr(0, dot));
      const bool written = dot != std::string::npos && node.ok() &&
                           (nodes.Find(*node) != nullptr || ReferenceOf(in.rig, *node) != nullptr);
      if (!written || !IsRigWord(in.graph().def(*node), text.substr(dot + 1)))
        in.FailPlug(override_.plug.where, text, plug.status());
    }
  }
}

}  // namespace kpsa::engine
