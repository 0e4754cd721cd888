#include "rig/build/constrained_plugs.h"

#include <algorithm>

#include "rig/graph_editor.h"

namespace kpsa::engine {

// Whether the plug of a constraint is still free, so that the rig decides about it.
bool ConstrainedPlugs::IsUnwritten(const PlugRef& plug) const {
  return to_.graph->FindValue(plug) == nullptr && to_.graph->FindConnection(plug) == nullptr;
}

bool ConstrainedPlugs::TakeOver(const PlugRef& plug, const MadeNode& by, const PlugRef& in,
                                const PlugRef& out, const SourceLocation& where) {
  const auto [it, added] = constrained_.emplace(KeyOf(plug), std::pair(by.from->name, where));
  if (!added) {
    return in_.Fail(
        where, Status::Invalid("\"{}\" is constrained twice: by \"{}\" at {}, too",
                               to_.graph->name(plug.node), it->second.first, it->second.second.ToString()));
  }
  GraphEditor edit(to_.graph);
  const bool free = IsUnwritten(in);
  const bool pinned = std::any_of(overridden_.plugs.begin(), overridden_.plugs.end(),
                                  [&](const auto& o) { return o.second && o.first == plug; });
  if (const Value* value = to_.graph->FindValue(plug); value != nullptr && free)
    edit.Check(to_.graph->Set(in, *value));
  if (const Connection* driver = to_.graph->FindConnection(plug)) {
    const PlugRef source = driver->source;
    edit.Check(to_.graph->Disconnect(plug));
    if (free && !pinned) edit.Connect(source, in);
  }
  edit.Connect(out, plug);
  to_.stacked->insert(KeyOf(plug));  // an override is what the constraint gets
  if (pinned || (!free && to_.graph->FindConnection(in) == nullptr)) to_.pinned->push_back(in);
  return in_.Fail(where, edit.Take());
}

bool ConstrainedPlugs::ConnectParentOf(NodeId transform, const MadeNode& by,
                                       const SourceLocation& where) const {
  GraphEditor edit(to_.graph);
  if (!edit.Has(by.id, "parentMatrix")) return true;  // it acts on local matrices only
  const PlugRef above = edit.Plug(transform, "parentMatrix"), parent = edit.Plug(by.id, "parentMatrix");
  if (!edit.ok() || !IsUnwritten(parent)) return in_.Fail(where, edit.Take());
  if (const Connection* connection = to_.graph->FindConnection(above))
    return in_.Fail(where, to_.graph->Connect(connection->source, parent));
  const Value* value = to_.graph->FindValue(above);
  return value == nullptr || in_.Fail(where, to_.graph->Set(parent, *value));
}

bool ConstrainedPlugs::Constrain(NodeId transform, const MadeNode& by, const char* in_name,
                                 const char* out_name, int element, const SourceLocation& where) {
  GraphEditor edit(to_.graph);
  const PlugRef offset = edit.Plug(transform, "offsetParentMatrix"), in = edit.Plug(by.id, in_name, element),
                out = edit.Plug(by.id, out_name, element);
  if (!in_.Fail(where, edit.Take()) || !TakeOver(offset, by, in, out, where)) return false;
  to_.clip_inputs->try_emplace(transform.index,
                               in);  // below a constraint of the file, if there is one
  return true;
}

}  // namespace kpsa::engine
