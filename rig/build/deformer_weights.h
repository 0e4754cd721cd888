// The weights of a loaded rig's deformers, one mesh at a time: as weight files, and over a plane of symmetry.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/weights_json.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// A deformer in the stack of a mesh. Both are the rig's.
struct DeformedMesh {
  const CharacterMesh* mesh = nullptr;
  const Stage* stage = nullptr;
  bool is_skin() const { return stage->node == mesh->skin_cluster; }
};

// A deformer by its name, where it deforms one mesh, or MESH@STAGE. Errors of usage: unknown names (with the
// nearest), several meshes, the file's morph targets and transforms, which take no weights.
Result<DeformedMesh> FindDeformed(const Rig& rig, std::string_view text);

// Weight files of a deformer that a reference brought along are those of the referenced rig, and name meshes,
// joints and maps as that does: without the "hero:" of the reference. Other names stay as they are.
std::string OwnName(const Rig& rig, const DeformedMesh& of, const std::string& name);
WeightFile InOwnNames(const Rig& rig, const DeformedMesh& of, WeightFile file);

// Of a deformer that is no skin: by point of the mesh, members, maps and falloff multiplied.
std::vector<float> PointWeights(const Rig& rig, const DeformedMesh& of);
// What the deformer weighs the vertices with: members, maps and falloff multiplied, as one map called by the
// deformer; of a skin a map for each joint.
Result<WeightFile> DeformerWeights(const Rig& rig, const DeformedMesh& of);

// Whether the file is for this mesh as the rig has it, and holds a skin where that is one. Errors are at the
// file.
Status CheckWeights(const Rig& rig, const DeformedMesh& of, const WeightFile& file);

using NamePairs = std::vector<std::pair<std::string, std::string>>;  // ".L", ".R"

struct MirrorOptions {
  enum class From { kLeft, kRight, kBoth };  // left: above 0; both: the two sides change places
  // Of the mesh's own space, or of the world where fewer points have no partner in that: of positions that are stored
  // as whole numbers the mesh's own origin is nowhere in particular. The plane goes through the origin.
  int axis = 0;
  From from = From::kLeft;
  NamePairs names = {};                  // parts of joints' names on the left and on the right
  std::optional<double> tolerance = {};  // metres; unset: 1/1000 of the mesh's diagonal
};
NamePairs DefaultNamePairs();
// The joint on the other side: `name` with one side's part replaced by the other's, where such a joint
// exists; else itself.
std::string MirroredName(const std::string& name, const NamePairs& pairs,
                         const std::vector<std::string>& joints);

struct MirroredWeights {
  WeightFile file;
  std::vector<Index> unmatched;       // vertices whose partner is farther away than the tolerance
  double farthest = 0;                // metres, of all partners
  double tolerance = 0;               // that was kept
  std::vector<std::string> unpaired;  // joints whose name has a side, but no joint has the other
};
// The weights of one side on the other. The partner of a point is the one whose rest place, and whose
// neighbours', come closest to those of its mirror image. A point that is its own partner keeps its weight;
// in a skin the joints of both sides share it, where its mirror image is within the tolerance. The side that
// is taken from stays as it is.
Result<MirroredWeights> MirrorWeights(const Rig& rig, const DeformedMesh& of, const MirrorOptions& options);

}  // namespace kpsa::engine
