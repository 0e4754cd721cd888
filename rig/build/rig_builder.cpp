// The order of the steps from a rig file to a rig; what each one reads and writes is said in its header.
#include "rig/build/build_rig.h"
#include "rig/build/steps/add_accelerate_entries.h"
#include "rig/build/steps/add_clips.h"
#include "rig/build/steps/add_constraints.h"
#include "rig/build/steps/add_controls.h"
#include "rig/build/steps/add_curves.h"
#include "rig/build/steps/add_nodes.h"
#include "rig/build/steps/add_shape_rules.h"
#include "rig/build/steps/apply_special_overrides.h"
#include "rig/build/steps/build_mesh_stacks.h"
#include "rig/build/steps/build_point_stacks.h"
#include "rig/build/steps/check_variants.h"
#include "rig/build/steps/connect_curves.h"
#include "rig/build/steps/connect_drivers.h"
#include "rig/build/steps/connect_falloffs.h"
#include "rig/build/steps/connect_lights.h"
#include "rig/build/steps/connect_parents.h"
#include "rig/build/steps/connect_pivots.h"
#include "rig/build/steps/connect_time.h"
#include "rig/build/steps/finish_overrides.h"
#include "rig/build/steps/finish_stacks.h"
#include "rig/build/steps/make_connections.h"
#include "rig/build/steps/measure_rest.h"
#include "rig/build/steps/note_double_moves.h"
#include "rig/build/steps/note_lost_weights.h"
#include "rig/build/steps/place_falloffs.h"
#include "rig/build/steps/place_handles.h"
#include "rig/build/steps/place_stages.h"
#include "rig/build/steps/place_stages_at_handles.h"
#include "rig/build/steps/read_attributes.h"
#include "rig/build/steps/read_overrides.h"
#include "rig/build/steps/read_targets.h"
#include "rig/build/steps/resolve_scopes.h"
#include "rig/build/steps/set_blend_weights.h"
#include "rig/build/steps/set_influences.h"
#include "rig/build/steps/set_targets.h"
#include "rig/build/steps/set_weights.h"

namespace kpsa::engine {

void BuildRig(RigFile* file, RestPose* rest, Rig* rig, YamlErrors* errors) {
  Graph* const graph = rig->graph.get();
  CharacterGraph* const scene = &rig->scene;
  const RigNames names(*file, *rig, errors);
  const BuildInput in{*file, *rig, names, errors};
  WeightMaps maps(in, rig);

  // Before anything is made of the file's own nodes
  AddClips(in, scene);
  ResolveScopes(names, graph->registry(), file);
  OwnDeformers own;
  ApplySpecialOverrides(in, file, &own);
  SetInfluences(in, own, &maps, scene, graph);
  rig->rest_diagonal = RestDiagonal(*scene, rest);

  // Nodes and their values
  MadeNodes nodes;
  AddNodes(in, &nodes, &rig->node_places, graph);
  TargetShapes shapes(in, rig);
  ReadTargets(in, nodes, &shapes, graph);
  PlugReader reader(in, &file->returned, graph);
  ReadAttributes(in, &nodes, &reader, graph);
  ReadOverrides(in, &reader, graph);
  AddShapeRules(in, nodes, own, graph);

  // Where they are at rest
  RestCurves curves;
  RestPlaces places(in, curves, rest, &nodes, graph);
  AddCurves(in, nodes, places, &curves, graph);
  ConnectParents(in, nodes, graph);
  if (errors->ok()) PlaceHandles(in, &places, &nodes, graph);
  ConnectCurves(in, nodes, graph);

  // Stacks, and what weighs them
  PlugKeys stacked;
  const RestFalloffs falloffs(in, &places, rest, &maps);
  WeightSetter weights(in, falloffs, &maps, graph, &rig->notes);
  BuildMeshStacks(in, *rest, &nodes, scene, graph, &rig->notes);
  SetWeights(&weights, &nodes);
  PlaceStages(in, rest, &nodes, graph);
  BuildPointStacks(in, curves, rest, &nodes, &stacked, graph);
  std::vector<FalloffUse> falloff_uses;
  ConnectFalloffs(in, &nodes, &falloff_uses, graph);
  FinishStacks(&weights, *graph, &nodes, &rig->notes);

  // What needs the stages
  ConnectLights(in, nodes, graph);
  ConnectDrivers(in, nodes, rest, graph);
  SetTargets(in, nodes, shapes, graph, &rig->notes);
  SetBlendWeights(in, own, &maps, graph);

  // What drives what
  MakeConnections(in, reader.pending(), reader.overridden(), graph);
  ConstrainedPlugs constrained(in, reader.overridden(), {&scene->clip_inputs, &stacked, &rig->pinned, graph});
  AddConstraints(in, nodes, &constrained, graph);
  ConnectTime(in, nodes, graph);

  // What depends on who drives whom
  PlaceStagesAtHandles(in, &places, rest, &nodes, graph);
  PlaceFalloffs(in, falloff_uses, nodes, graph);
  ConnectPivots(in, *rest, nodes, graph);
  FinishOverrides(in, reader.overridden(), stacked, &rig->pinned, graph);
  CheckVariants(in, nodes);
  NoteDoubleMoves(in, nodes, &rig->notes);
  NoteLostWeights(*scene, *graph, &rig->notes);

  // What the rig is for
  AddControls(in, &rig->controls);
  AddAccelerateEntries(in, scene, &rig->accelerate, &rig->notes);
}

}  // namespace kpsa::engine
