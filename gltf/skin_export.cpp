#include "gltf/skin_export.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "files/cache_normals.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
constexpr float kSameNormal = 1e-6f;

// The entries of the part's vertices, counted within it.
CacheTarget PartOf(const CacheTarget& target, const CachePart& part) {
  const auto begin = std::lower_bound(target.vertices.begin(), target.vertices.end(), part.first_vertex);
  const auto end = std::lower_bound(begin, target.vertices.end(), part.first_vertex + part.vertex_count);
  CacheTarget of{target.name, {begin, end}, {}};
  for (Index& vertex : of.vertices) vertex -= part.first_vertex;
  const auto first = target.deltas.begin() + 3 * (begin - target.vertices.begin());
  of.deltas.assign(first, first + 3 * (end - begin));
  return of;
}

// Whichever takes less; indices and numbers of what moves, or numbers of all.
int AddTarget(const CacheTarget& target, std::size_t count, GlbFile* glb) {
  if (4 * target.vertices.size() < 3 * count)
    return glb->AddSparsePositions(count, target.vertices, target.deltas);
  std::vector<float> all(3 * count, 0.0f);
  for (std::size_t i = 0; i < target.vertices.size(); ++i)
    std::copy_n(&target.deltas[3 * i], 3, &all[3 * std::size_t{target.vertices[i]}]);
  return glb->AddPositions(all);
}

// How the normals of the rest differ from those with the target at 1.
CacheTarget NormalsOf(const CacheTarget& target, const std::vector<float>& rest, PointCacheMesh* look,
                      const std::vector<float>& rest_normals) {
  look->frames = rest;
  for (std::size_t i = 0; i < target.vertices.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      look->frames[3 * std::size_t{target.vertices[i]} + k] += target.deltas[3 * i + k];
  }
  const std::vector<float> normals = CacheNormals(*look, 0);
  CacheTarget result{target.name, {}, {}};
  for (Index v = 0; v < normals.size() / 3; ++v) {
    float delta[3];
    bool same = true;
    for (std::size_t k = 0; k < 3; ++k) {
      delta[k] = normals[3 * std::size_t{v} + k] - rest_normals[3 * std::size_t{v} + k];
      same = same && std::fabs(delta[k]) < kSameNormal;
    }
    if (same) continue;
    result.vertices.push_back(v);
    result.deltas.insert(result.deltas.end(), delta, delta + 3);
  }
  return result;
}

bool SameJoints(const CacheSkin& a, const CacheSkin& b) {
  return a.joints == b.joints && a.inverse_binds == b.inverse_binds;
}

}  // namespace

std::span<const float> PartRows(const std::vector<float>& values, const CachePart& part, std::size_t width) {
  return {&values[width * part.first_vertex], width * part.vertex_count};
}

GlbPrimitive PrimitiveOfPart(const PointCacheMesh& mesh, const CachePart& part,
                             const std::vector<float>& rest, const std::vector<float>& normals,
                             GlbFile* glb) {
  GlbPrimitive primitive;
  primitive.attributes.emplace_back("POSITION", glb->AddPositions(PartRows(rest, part, 3)));
  std::vector<Index> triangles = PartTriangles(mesh, part);
  if (!triangles.empty()) {
    for (Index& vertex : triangles) vertex -= part.first_vertex;
    if (!PartIsFlat(mesh, part))
      primitive.attributes.emplace_back("NORMAL", glb->AddVectors(PartRows(normals, part, 3)));
    primitive.indices = glb->AddIndices(triangles);
  }
  if (PartHasUvs(mesh, part))
    primitive.attributes.emplace_back("TEXCOORD_0", glb->AddUvs(PartRows(mesh.uvs, part, 2)));
  if (!mesh.colors.empty())
    primitive.attributes.emplace_back("COLOR_0", glb->AddVectors(PartRows(mesh.colors, part, 3)));
  primitive.material = part.material;
  return primitive;
}

void SkinExport::AddNodes(const std::vector<const CacheSkin*>& skins) {
  std::vector<bool> wanted(scene_.nodes.size(), false), jointed(scene_.nodes.size(), false);
  const auto want = [&](Index node, std::vector<bool>* set) {
    for (; node != kNoIndex && !(*set)[node]; node = tracks_[node].parent) (*set)[node] = true;
  };
  for (const CacheSkin* skin : skins) {
    for (const Index joint : skin->joints) want(joint, &wanted), want(joint, &jointed);
    want(skin->node, &wanted);
  }
  std::size_t roots = 0;
  for (Index n = 0; n < wanted.size(); ++n) roots += jointed[n] && tracks_[n].parent == kNoIndex;
  std::size_t root = kNowhere;
  rooted_ = roots > 1;
  if (rooted_) {
    root = glb_->AddNode("joints");
    glb_->AddToScene(root);
  }
  written_.assign(scene_.nodes.size(), kNowhere);
  for (Index n = 0; n < wanted.size(); ++n) {
    if (wanted[n]) AddNode(n, jointed[n] ? root : kNowhere);
  }
}

void SkinExport::AddNode(Index node, std::size_t root) {
  const NodeTrack& track = tracks_[node];
  const std::size_t at = glb_->AddNode(scene_.nodes[node].name);
  written_[node] = at;
  const std::size_t parent = track.parent == kNoIndex ? root : written_[track.parent];
  if (parent == kNowhere) {
    glb_->AddToScene(at);
  } else {
    glb_->AddChild(parent, at);
  }
  const auto add = [&](const std::vector<float>& values, std::size_t width, const char* path,
                       const std::vector<float>& none) {
    const std::vector<float> first(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
    if (first != none) glb_->SetTransform(at, path, first);
    if (values.size() > width) glb_->AddChannel(times_, glb_->AddKeys(values, width), at, path);
  };
  add(track.translations, 3, "translation", {0, 0, 0});
  add(track.rotations, 4, "rotation", {0, 0, 0, 1});
  add(track.scales, 3, "scale", {1, 1, 1});
}

std::size_t SkinExport::SkinOf(const CacheSkin& skin) {
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    if (SameJoints(*skins_[s], skin)) return s;
  }
  skins_.push_back(&skin);
  std::vector<std::size_t> joints;
  std::vector<float> columns;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    joints.push_back(written_[skin.joints[j]]);
    for (const double number : skin.inverse_binds[j].m) columns.push_back(static_cast<float>(number));
  }
  return glb_->AddSkin(joints, glb_->AddMatrices(columns));
}

GlbPrimitive SkinExport::Primitive(const PointCacheMesh& mesh, const CachePart& part, const CacheSkin& skin,
                                   const std::vector<float>& normals,
                                   const std::vector<CacheTarget>& target_normals) const {
  GlbPrimitive primitive = PrimitiveOfPart(mesh, part, skin.rest, normals, glb_);
  if (!skin.joints.empty()) {
    const auto begin = skin.offsets.begin() + part.first_vertex, end = begin + part.vertex_count;
    Index most = 1;
    for (auto row = begin; row != end; ++row) most = std::max(most, row[1] - row[0]);
    for (Index set = 0; 4 * set < most; ++set) {
      std::vector<Index> joints(4 * std::size_t{part.vertex_count}, 0);
      std::vector<float> shares(joints.size(), 0.0f);
      for (auto row = begin; row != end; ++row) {
        for (Index i = row[0] + 4 * set; i < std::min(row[0] + 4 * set + 4, row[1]); ++i) {
          const auto at = static_cast<std::size_t>(4 * (row - begin)) + (i - row[0]) % 4;
          joints[at] = skin.influences[i];
          shares[at] = skin.shares[i];
        }
      }
      primitive.attributes.emplace_back(fmt::format("JOINTS_{}", set),
                                        glb_->AddJoints(joints, skin.joints.size()));
      primitive.attributes.emplace_back(fmt::format("WEIGHTS_{}", set), glb_->AddWeights(shares));
    }
  }
  for (std::size_t k = 0; k < skin.targets.size(); ++k) {
    const int position = AddTarget(PartOf(skin.targets[k], part), part.vertex_count, glb_);
    const int normal =
        !primitive.has_normals() ? -1 : AddTarget(PartOf(target_normals[k], part), part.vertex_count, glb_);
    primitive.targets.push_back({position, normal});
  }
  return primitive;
}

std::size_t SkinExport::NodeForSkin(const std::string& name) {
  for (std::size_t n = 0; n < written_.size() && !rooted_; ++n) {
    const bool own = written_[n] != kNowhere && scene_.nodes[n].name == name;
    if (own && tracks_[n].parent == kNoIndex && tracks_[n].IsIdentity()) return written_[n];
  }
  const std::size_t node = glb_->AddNode(name);
  glb_->AddToScene(node);
  return node;
}

void SkinExport::AddMesh(const PointCacheMesh& mesh, const CacheSkin& skin) {
  PointCacheMesh look{
      .name = "", .vertex_count = mesh.vertex_count, .frames = skin.rest, .triangles = mesh.triangles};
  look.smooth = mesh.smooth;
  const std::vector<float> normals = CacheNormals(look, 0);
  std::vector<CacheTarget> target_normals;
  GlbMesh out{mesh.name, {}, {}, {}};
  for (const CacheTarget& target : skin.targets) {
    if (!normals.empty()) target_normals.push_back(NormalsOf(target, skin.rest, &look, normals));
    out.target_names.push_back(target.name);
  }
  for (const CachePart& part : CacheParts(mesh)) {
    if (part.vertex_count > 0) out.primitives.push_back(Primitive(mesh, part, skin, normals, target_normals));
  }
  const std::size_t node = skin.node == kNoIndex ? NodeForSkin(mesh.name) : written_[skin.node];
  if (const std::size_t count = skin.targets.size(); count > 0) {
    const std::vector<float> values(skin.weights.begin(), skin.weights.end());
    out.weights.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
    bool still = true;
    for (std::size_t i = count; i < values.size(); ++i) still = still && values[i] == values[i % count];
    if (!still) glb_->AddChannel(times_, glb_->AddNumbers(values), node, "weights");
  }
  if (!skin.joints.empty()) glb_->SetSkin(node, SkinOf(skin));
  glb_->SetMesh(node, glb_->AddMesh(out));
}

}  // namespace kpsa::engine
