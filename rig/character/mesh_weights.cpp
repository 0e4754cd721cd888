#include "rig/character/mesh_weights.h"

#include <algorithm>
#include <cmath>

namespace kpsa::engine {
namespace {

constexpr double kSumSlack = 1e-5;  // as the skin's kernel has it
constexpr std::size_t kMostErrors = 20;

struct JointWeight {
  Index joint;
  double weight;
};

}  // namespace

bool NamesMesh(const WeightFile& file, const gltf::Character& character, const Graph& graph,
               const CharacterMesh& mesh) {
  return file.mesh == mesh.name || file.mesh == graph.name(mesh.transform) ||
         file.mesh == character.nodes[mesh.gltf_node].name;
}

WeightFile VertexWeights(const CharacterMesh& mesh, std::string map, const std::vector<float>& by_point) {
  NamedWeights weights{std::move(map), 0, {}, {}};
  std::size_t ones = 0, zeros = 0;
  for (Index p : mesh.mesh().data().vertex_to_point) {
    ones += by_point[p] == 1;
    zeros += by_point[p] == 0;
  }
  weights.default_value = ones > zeros ? 1 : 0;
  for (Index v = 0; v < mesh.vertex_count; ++v) {
    const float weight = by_point[mesh.mesh().data().vertex_to_point[v]];
    if (weight == weights.default_value) continue;
    weights.indices.push_back(v);
    weights.values.push_back(weight);
  }
  return {mesh.name, mesh.vertex_count, {std::move(weights)}};
}

Result<std::vector<std::string>> InfluenceNames(const CharacterMesh& mesh, const Graph& graph) {
  std::vector<std::string> names;
  for (NodeId node : mesh.influence_nodes) {
    const std::string& name = graph.name(node);
    if (std::find(names.begin(), names.end(), name) != names.end())
      return Status::Invalid("\"{}\" is twice in the skin of {}, so its weights cannot be told apart", name,
                             mesh.name);
    names.push_back(name);
  }
  return names;
}

Result<WeightFile> SkinWeights(const CharacterMesh& mesh, const Influences& influences, const Graph& graph) {
  const Result<std::vector<std::string>> names = InfluenceNames(mesh, graph);
  if (!names.ok()) return names.status();
  std::vector<NamedWeights> maps(names->size());
  for (std::size_t j = 0; j < maps.size(); ++j) maps[j].name = (*names)[j];
  for (Index v = 0; v < mesh.vertex_count; ++v) {
    const Index p = mesh.mesh().data().vertex_to_point[v];
    for (Index i = influences.offsets()[p]; i < influences.offsets()[p + 1]; ++i) {
      maps[influences.joints()[i]].indices.push_back(v);
      maps[influences.joints()[i]].values.push_back(influences.weights()[i]);
    }
  }
  std::erase_if(maps, [](const NamedWeights& map) { return map.indices.empty(); });
  return WeightFile{mesh.name, mesh.vertex_count, std::move(maps)};
}

Result<std::shared_ptr<const Influences>> InfluencesFrom(const WeightFile& file, const CharacterMesh& mesh,
                                                         const Graph& graph) {
  const Result<std::vector<std::string>> names = InfluenceNames(mesh, graph);
  if (!names.ok()) return names.status();
  const std::vector<Index>& point_of = mesh.mesh().data().vertex_to_point;
  const std::size_t points = mesh.mesh().point_count();
  std::vector<double> vertices(points, 0.0), sum(points, 0.0);
  for (Index p : point_of) vertices[p] += 1;
  Status errors;
  const auto full = [&] { return errors.errors().size() >= kMostErrors; };
  std::vector<std::vector<JointWeight>> rows(points);
  for (const NamedWeights& map : file.maps) {
    const auto joint = std::find(names->begin(), names->end(), map.name);
    if (joint == names->end()) {
      if (!full())
        errors.Append(Status::Invalid("map \"{}\": no joint of the skin of {} is called so{}", map.name,
                                      mesh.name, DidYouMean(map.name, *names)));
      continue;
    }
    const std::vector<float> dense = DenseWeights(file, map);
    std::fill(sum.begin(), sum.end(), 0.0);
    for (Index v = 0; v < dense.size(); ++v) {
      if (dense[v] < 0 && !full())
        errors.Append(
            Status::Invalid("map \"{}\": vertex {} has the negative weight {}", map.name, v, dense[v]));
      sum[point_of[v]] += static_cast<double>(dense[v]);
    }
    for (std::size_t p = 0; p < points; ++p) {
      if (sum[p] > 0) rows[p].push_back({static_cast<Index>(joint - names->begin()), sum[p] / vertices[p]});
    }
  }
  for (Index v = 0; v < point_of.size() && errors.ok(); ++v) {
    if (rows[point_of[v]].empty()) errors = Status::Invalid("no joint moves vertex {}", v);
  }
  if (!errors.ok()) return std::move(errors).At({file.path});

  const Influences& before = *mesh.influences;
  std::vector<Index> offsets{0}, joints;
  std::vector<float> weights;
  for (std::size_t p = 0; p < points; ++p) {
    const auto begin = before.joints().begin() + before.offsets()[p],
               end = before.joints().begin() + before.offsets()[p + 1];
    // Those that it had come first, as they were; new ones follow by their number
    const auto place = [&](const JointWeight& row) {
      const auto at = std::find(begin, end, row.joint);
      return at == end ? static_cast<std::ptrdiff_t>(before.joints().size()) + row.joint : at - begin;
    };
    std::sort(rows[p].begin(), rows[p].end(),
              [&](const JointWeight& a, const JointWeight& b) { return place(a) < place(b); });
    double total = 0;
    for (const JointWeight& row : rows[p]) total += row.weight;
    const double divisor = std::fabs(total - 1) <= kSumSlack ? 1 : total;
    for (const JointWeight& row : rows[p]) {
      joints.push_back(row.joint);
      weights.push_back(static_cast<float>(row.weight / divisor));
    }
    offsets.push_back(static_cast<Index>(joints.size()));
  }
  return std::make_shared<const Influences>(std::move(offsets), std::move(joints), std::move(weights),
                                            before.joint_count());
}

}  // namespace kpsa::engine
