// A glTF character as graph nodes: a transform for every node of the file, and for every mesh node of its
// scene the chain mesh -> blendShape -> skinCluster (or transformGeometry, where there is no skin), and the
// nodes of one clip.
//
// Names: glTF names stay verbatim; a shared name becomes `name#<glTF index>`, the bare name then being
// ambiguous; an unnamed node is `node<index>`; every node is also found by its path, /Torso/Head (paths up to
// 512 bytes).
// `<mesh>_mesh`, `<mesh>_blendShape` and `<mesh>_skinCluster` carry the mesh's name in outputs
// (Character::UniqueName);
// `<mesh>.weight[...]` finds the blendShape's. What VRM's extensions add: rig/character/character_vrm.h.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "gltf/import.h"
#include "graph/geometry.h"
#include "graph/graph.h"
#include "rig/character/weld.h"

namespace kpsa::engine {

struct CharacterOptions {
  std::optional<std::string> clip;  // a clip's id; unset: the first clip, if there is one
  bool rest = false;                // no clip
  bool weld = true;
};

// A place in a mesh's stack where its points can be named (head_mesh@skin).
struct Stage {
  std::string name;  // "morph", "skin", "transform" or the deformer's
  NodeId node;
  int geometry = 0;    // which of the deformer's geometries
  bool world = false;  // its points are in world space, not in the mesh's
  PlugRef points;      // node.outPoints[geometry]
};

// One glTF primitive in outputs: its vertices are mesh.vertex_to_point[first_vertex ...].
struct OutputPrimitive {
  std::string key;  // "<node name>/<primitive index>"
  Index first_vertex = 0, vertex_count = 0;
};

struct CharacterMesh {
  std::string name;  // in outputs
  Index gltf_node = kNoIndex;
  bool visible = true;  // a hidden one may drive others, but is no output unless somebody asks for it
  Index vertex_count = 0;
  WeldedMesh geometry;
  std::shared_ptr<const Influences> influences;                // null without a skin
  std::vector<NodeId> influence_nodes;                         // transform that Influences' joint j follows
  std::vector<Matrix4> inverse_binds;                          // [j] joint_from_mesh at bind time
  std::vector<double> weights;                                 // default morph weights
  NodeId transform;                                            // of the mesh node
  NodeId rest, blend_shape, skin_cluster, transform_geometry;  // invalid where absent
  NodeId morph_weights;       // likewise: before the blendShape, where expressions move the mesh
  Stage at_rest;              // "rest": before all stages, in mesh space
  std::vector<Stage> stages;  // in order; the last one's points are `points`
  PlugRef points;
  bool world = false;  // whether `points` are in world space
  std::vector<OutputPrimitive> primitives;
  const Mesh& mesh() const { return *geometry.mesh; }
  // Whose `weight` clips and rigs set.
  NodeId weights_node() const { return morph_weights.version != 0 ? morph_weights : blend_shape; }
  // By name; `gltf` is the last of the file's own stages, `skin` also an unskinned mesh's transform, `rest` what comes
  // before all of them. Null if none.
  const Stage* FindStage(std::string_view stage) const;
};

struct CharacterClip {
  std::string id;
  double duration = 0;  // seconds, from time 0 to its end
  double begin = 0;     // the first time that is played where nobody says
};

// A clip of the character's clips, over each other (nodes/clip_layers.cpp says how).
struct LayeredClip {
  struct Layer {
    Index clip = kNoIndex;  // of the character
    double weight = 1;      // 0..1
    bool additive = false;
    double start = 0, speed = 1;  // seconds; seconds of the clip a second
    bool loop = false;
    std::vector<bool> moves;  // by glTF node: whether the layer may move it; empty: all
  };
  std::string id;
  std::vector<Layer> layers;
};

struct CharacterGraph {
  std::vector<CharacterMesh> meshes;  // in the order of their glTF nodes
  std::vector<NodeId> transforms;     // by glTF node
  std::vector<CharacterClip> clips;   // all of the file, then the layered ones
  std::vector<LayeredClip> layered;
  std::optional<std::string> clip;  // the one that plays
  std::vector<NodeId> clip_nodes;
  NodeId expressions;  // of VRM; invalid where absent
  PlugRef time;
  std::vector<std::string> notes;  // what was ignored, one line each
  std::unordered_set<Index> clip_transforms,
      clip_weights;  // graph nodes that any clip moves, or whose weights
  // Where the clip of a transform goes, if not to its offsetParentMatrix (to the constraint that owns that)
  std::unordered_map<Index, PlugRef> clip_inputs;
};

// The meshes that are visible, by number; all of them where none is.
std::vector<std::size_t> ShownMeshes(const CharacterGraph& scene);

// Adds the character to an empty graph whose registry has the standard nodes. Works without recursion at any
// depth of hierarchy. Errors: an unknown clip; a character beyond kMaxCharacterPoints points, or
// kMaxSkinJoints or kMaxMorphTargets a mesh.
Result<CharacterGraph> BuildCharacterGraph(const gltf::Character& character, const CharacterOptions& options,
                                           Graph* graph);
inline constexpr std::uint64_t kMaxCharacterPoints = 100'000'000;
inline constexpr std::size_t kMaxSkinJoints = 8192;
inline constexpr std::size_t kMaxMorphTargets = 8192;

// The error of a name that no clip has: with the nearest one, and those that there are.
Status NoSuchClip(const CharacterGraph& scene, std::string_view clip);
// Replaces the clip that plays; none: the rest pose. Plugs that somebody else drives are left alone.
Status SetClip(const gltf::Character& character, std::optional<std::string_view> clip, CharacterGraph* scene,
               Graph* graph);
// Lets a clip, plain or layered, play besides what plays already; it begins at `start` seconds. Nodes that
// another clip moves are left to that.
Status AddClip(const gltf::Character& character, std::string_view clip, double start, CharacterGraph* scene,
               Graph* graph);
// The nodes of a layered clip.
Status PlayLayers(const gltf::Character& character, const LayeredClip& clip, CharacterGraph* scene,
                  Graph* graph);
// Where the clip of a transform goes.
PlugRef ClipInput(const CharacterGraph& scene, const Graph& graph, NodeId transform);
// Whether any clip of the character drives the plug.
bool IsClipPlug(const CharacterGraph& scene, const Graph& graph, const PlugRef& plug);

// Chains the deformers from the mesh's rest points on, in place of the stages that it had; `points` of each
// stage is set, and mesh[g] and space of each node. Deformers may serve several meshes, in different
// geometries.
Status ConnectStages(std::vector<Stage> stages, CharacterMesh* mesh, Graph* graph);
// The file's own stages of a mesh: morph (if it has targets), then skin or transform.
std::vector<Stage> OwnStages(const CharacterMesh& mesh);

}  // namespace kpsa::engine
