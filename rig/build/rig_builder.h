// From a rig file and its character to a graph that can be compiled: everything of docs/rig-format.md is looked
// up, typed, checked and connected here. A .glb or .gltf alone is a rig, too: what it says is the default
// graph.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/cloned.h"
#include "graph/graph.h"
#include "rig/character/character_graph.h"
#include "rig/file/rig_file.h"

namespace kpsa::engine {

class PluginLoader;

struct RigOptions {
  std::optional<std::string> clip;  // of a character or the rig; unset: each character's first, if it has any
  bool rest = false;                // no clip
  std::optional<double> fps;        // instead of the rig's
  std::optional<std::string> variant;  // of the rig's `variants`, or hero:NAME of a reference's
  PluginLoader* plugins = nullptr;     // of the registry; null: rigs with plugins are refused
  std::vector<std::string> trust =
      {};  // folders besides its own whose files it may name (files/trusted_folders.h)
  std::string trust_word = "trust";  // what messages call naming such a folder
};

// A plug that an animator and the trainer may move. It is a number; runtime units.
struct Control {
  std::string name;  // as the rig writes it
  PlugRef plug;
  double min = 0, max = 0;
  double value = 0;  // at rest
  Unit unit = Unit::kNone;
  bool by_clip = false;  // a morph weight that some clip drives while it plays
  SourceLocation where;
};

struct AcceleratedPoints {
  std::size_t mesh = 0;   // in Rig::scene.meshes
  std::size_t stage = 0;  // in its stages: up to and including it
  PlugRef points;
  bool colors = false;  // points are colours of a node, and of no mesh
};
struct AccelerateEntry {
  std::string name;
  std::vector<AcceleratedPoints> points;
  std::optional<NodeId> space;  // a transform; unset: the world
  std::string subspace;         // path, "" where the rig names none
  double tolerance = 0;         // metres; where the rig names none, 1/2000 of the rest pose's diagonal;
                                // of colours in their units, 0.05 where the rig names none
  double violation_rate = 0.01;
  std::vector<std::string> train_clips, test_clips;
  std::optional<std::int64_t> train_samples;  // unset: TrainOptionsOf (host/rig_training.h) chooses
  std::int64_t key_points = 0;                // that are measured, at least; 0: the trainer's number
  std::int64_t calibration_poses = 0;         // of each kind; 0: the trainer's number
  SourceLocation where;
  int reference = -1;  // in Rig::references: whose entry it is; -1: of the rig's own files
};

// Another rig within this one. What it brings is called as there, after `name_space`.
struct Reference {
  std::string name_space;  // "hero:", and "hero:sub:" of one that hero references itself
  std::string file;
  NodeId root;           // the transform `hero`; all that stands in the world there hangs under it
  Index begin, end = 0;  // indices of the nodes that it brings
  bool Brought(NodeId node) const { return node.index >= begin && node.index < end; }
};

// A clip, or one of the rig's own, from a time on.
struct PlayedClip {
  std::string id;
  double start = 0;  // seconds
};

// A key of the rig that says something of a deformer's weights.
struct WeightSource {
  NodeId deformer;
  std::string key;  // weights, members, falloff, blendWeights, influences
  SourceLocation where;
  std::string geometry;   // the mesh's name in outputs; "": all that it deforms
  std::string path, map;  // of a weight file; "": the key names none
  bool operator==(const WeightSource& other) const {
    return deformer == other.deformer && key == other.key && where.file == other.where.file &&
           where.line == other.where.line && where.column == other.where.column &&
           geometry == other.geometry && path == other.path && map == other.map;
  }
};

struct Rig {
  std::string path;
  std::shared_ptr<const gltf::Character> character;
  Cloned<Graph> graph;  // refers to the registry that LoadRig was given; a copy of the rig has its own
  CharacterGraph scene;
  std::vector<Control> controls;
  std::vector<AccelerateEntry> accelerate;
  FileUnits units;  // of the file that was opened, fps included
  double fps = 24;
  std::vector<std::string> files;                     // all that were read
  std::vector<std::string> notes;                     // what may surprise, one line each
  std::map<std::string, SourceLocation> node_places;  // where the rig's own nodes are written, by name
  std::vector<WeightSource> weights;                  // in the order of the deformers
  std::vector<PlugRef> pinned;                        // plugs that clips leave alone: overridden or set
  double rest_diagonal = 0;                           // metres, of the bounding box of all meshes at rest
  // Several characters: `character` and `scene` are those of all of them, the rig's own first
  std::vector<Reference> references;     // those of references after them
  std::vector<PlayedClip> played;        // where no clip is chosen: one a character
  std::optional<CharacterClip> playing;  // what these come to while they play
  std::vector<Index> clip_characters;    // by clip of `character`: whose it is, counted from 0
  Index characters = 1;
};

// The registry must outlive the rig. All errors of the rig are collected, each at its place.
Result<Rig> LoadRig(const NodeRegistry& registry, const std::string& path, const RigOptions& options = {});

// Where the node stands that an error of the compiler or an evaluation is about; the rig itself where that is a
// node of the character, or none.
SourceLocation PlaceOf(const Rig& rig, const Error& error);

// The reference that brought a node, within others the innermost one; null for the rig's own nodes.
const Reference* InnermostReference(const Rig& rig, NodeId node);

// Another clip for a loaded rig (none: the rest pose); nodes and plugs of the rig itself stay as they are.
// Characters that the clip is not of go on with their own.
Status SetClip(Rig* rig, std::optional<std::string_view> clip);

// A value for a plug, from the command line or a pose file, typed, in runtime units; enums are numbers.
struct Setting {
  PlugRef plug;
  Value value;
  std::string text;  // "jaw.rotateX=-20", for messages
};
// "plug=value" with the value in the units of the rig's file: jaw.rotateX=-20, lipUp.translate=[0, 1mm, 0].
Result<Setting> ParseSetting(const Rig& rig, std::string_view text);
// A pose file: {kpsa: 1, units: {...}, clip: talk, time: 1.25s, pose: {jaw.rotateX: -20, ...}}; units default
// to the rig's. The clip, and when in it, are for poses over a clip; "" is the rest pose. Or the plugs alone, without
// `kpsa` and `pose`: {jaw.rotateX: -20, ...}.
struct PoseFile {
  std::vector<Setting> settings;
  std::optional<std::string> clip;
  std::optional<double> time;  // seconds
};
Result<PoseFile> ReadPoseFile(const Rig& rig, const std::string& path);
// The same of its text; `name` stands for the path in errors.
Result<PoseFile> ParsePose(const Rig& rig, std::string_view text, const std::string& name);
// Sets it in the graph. Takes over from a clip; a plug that the rig itself drives is an error.
Status ApplySetting(Rig* rig, const Setting& setting);

}  // namespace kpsa::engine
