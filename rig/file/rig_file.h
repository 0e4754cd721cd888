// A rig file (docs/rig-format.md, version 1) as plain data, its includes merged in and its templates expanded.
// Names are not looked up and values of attributes are not typed yet: that takes a registry and a character
// (rig/build/rig_builder.h), which also reads the files of `references`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "files/quantity.h"
#include "files/trusted_folders.h"
#include "files/yaml_document.h"

namespace kpsa::engine {

// A file of the rig: the one that was opened, or one that it includes.
struct RigSource {
  std::string path;
  std::string folder;  // relative paths in the file start here; "" is the current folder
  FileUnits units;     // of bare numbers in this file
  SourceLocation included_at;
  std::string scope = {};  // of what a `use:` makes of a template: "arm_L:" begins the names of its nodes
  int outer = -1;          // ... and the source whose names it sees besides its own
  // Of overrides that the file which references this one gives it: "hero:" begins what that calls ours
  std::string referenced_as = {};
};

// A string or a value with its place. `source` is an index into RigFile::sources.
struct RigString {
  std::string text;
  SourceLocation where;
  int source = 0;
};

struct RigAttribute {
  std::string
      name;  // "iterations", "rotateX", "input[2]"; common words (parent, at, members, ...) are kept apart
  YamlNode key, value;
  int source = 0;
};

struct RigNode {
  std::string name, type;
  SourceLocation where;  // of the name
  int source = 0;
  YamlNode type_node;
  std::vector<RigAttribute> attributes;
};

struct RigConnection {
  std::string from, to;
  bool override_clip = false;  // `override: true`
  SourceLocation where;
  int source = 0;
};

struct RigDeform {
  std::vector<RigString> meshes;    // either meshes ...
  std::optional<RigString> points;  // ... or a points attribute
  std::vector<RigString> stack;
  SourceLocation where;
  int source = 0;
};

struct RigControl {
  RigString plug;
  YamlNode min, max;
};

struct RigAccelerateEntry {
  std::string name;
  SourceLocation where;
  int source = 0;
  struct Points {
    std::string mesh, stage;  // "head_mesh@mush"
    SourceLocation where;
  };
  std::vector<Points> points;     // either these
  std::vector<RigString> colors;  // or plugs of colours: "bounced.irradiance"
  std::optional<RigString> space;
  std::string subspace;             // path, resolved; "" where none is named
  std::optional<double> tolerance;  // metres; of colours in their units
  double violation_rate = 0.01;     // of frames, 0..1
  std::vector<RigString> train_clips, test_clips;
  std::optional<std::int64_t> train_samples;           // unset: the program chooses
  std::int64_t key_points = 0, calibration_poses = 0;  // 0: the trainer's
};

struct RigOverride {
  RigString plug;
  YamlNode value;
};

struct RigClipLayer {
  RigString clip;
  double weight = 1;  // 0..1
  bool additive = false;
  std::vector<RigString> mask;    // patterns with * and ? for names of nodes; none: all nodes
  std::optional<YamlNode> start;  // a bare number is a frame
  double speed = 1;
  bool loop = false;
};
// A clip of the rig's own: clips of the character over each other.
struct RigClip {
  std::string name;
  SourceLocation where;
  int source = 0;
  std::vector<RigClipLayer> layers;
  std::optional<std::pair<std::int64_t, std::int64_t>> frames;  // first and last
};

// Another rig, under a namespace.
struct RigReference {
  std::string name;  // "hero" of the namespace "hero:"
  SourceLocation where;
  int source = 0;
  RigString file;                            // path, resolved
  std::optional<YamlNode> translate, start;  // a bare start is a frame
  std::optional<RigString> clip;             // as the referenced file calls it
};

// Overrides that are chosen by name; all files' parts of it together.
struct RigVariant {
  std::string name;
  std::vector<RigOverride> overrides;
};

struct RigFile {
  TrustedFolders trusted;              // what the files may name
  std::vector<RigSource> sources;      // [0] is the file that was opened
  std::optional<RigString> character;  // path, resolved
  std::vector<RigString> plugins;      // paths, resolved
  std::optional<double> fps;
  bool weld = true;
  bool complete = true;  // false: some file could not be read, so that names may be missing
  std::vector<RigNode> nodes;
  std::vector<RigConnection> connections;
  std::vector<RigDeform> deform;
  std::vector<RigControl> controls;
  std::vector<RigAccelerateEntry> accelerate;
  std::vector<RigOverride> overrides;
  std::vector<RigVariant> variants;
  std::vector<RigClip> clips;
  std::vector<RigReference> references;
  std::vector<RigOverride>
      returned;  // connections of overrides that are not ours to make (rig/build/loader.cpp)
};

// Reads a rig and what it includes, relative to the including file. Errors are collected over all files; *rig
// then holds what could be read, for finding more of them. `fps` overrides the rig's for the suffix f. A part
// that others include has no character. Files that it names are in `trusted`; null: TrustedFolders::OfRig(path).
Status ReadRigFile(const std::string& path, std::optional<double> fps, RigFile* rig, bool part = false,
                   const TrustedFolders* trusted = nullptr);

// The units: section into `units`.
void ReadUnits(const YamlNode& node, FileUnits* units, YamlErrors* errors);
// Checks `kpsa: 1`.
void ReadVersion(YamlMap* map, YamlErrors* errors);

// The file that `path` is, as the rig's file `source` names it at `at`; nothing, with an error, where it leads out of
// the trusted folders by `..` or over links. An absolute path says openly where it leads: it may be read, and so may
// what is named within its folder. What is written has to be in the trusted folders in any case.
enum class FileUse { kRead, kWritten };
std::optional<std::string> ResolvePath(const RigFile& rig, int source, const std::string& path,
                                       const YamlNode& at, YamlErrors* errors, FileUse use = FileUse::kRead);

}  // namespace kpsa::engine
