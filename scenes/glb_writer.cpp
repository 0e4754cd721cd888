#include "scenes/glb_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/check.h"
#include "base/matrix.h"

namespace kpsa::engine::scenes {
namespace {

std::string Quoted(std::string_view text) {
  return fmt::format("\"{}\"", text);
}  // names here need no escapes

std::string Joined(const std::vector<std::string>& items) {
  std::string out = "[";
  for (const std::string& item : items) out += (out.size() > 1 ? "," : "") + item;
  return out + "]";
}

std::string Numbers(std::span<const float> values) {
  std::vector<std::string> items;
  for (float v : values) items.push_back(fmt::format("{}", v));
  return Joined(items);
}

std::array<float, 16> RigidInverse(const Matrix4& m) {
  std::array<float, 16> out = {};
  for (int row = 0; row < 3; ++row) {
    double at = 0;
    for (int k = 0; k < 3; ++k) {
      out[static_cast<std::size_t>(4 * k + row)] = static_cast<float>(m(k, row));
      at += m(k, row) * m(k, 3);
    }
    out[static_cast<std::size_t>(12 + row)] = static_cast<float>(-at);
  }
  out[15] = 1;
  return out;
}

class Writer {
 public:
  // Appends bytes as a buffer view, aligned to 4.
  template <typename T>
  int View(std::span<const T> data, int target = 0) {
    while (binary_.size() % 4 != 0) binary_.push_back('\0');
    views_.push_back(fmt::format("{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}{}}}", binary_.size(),
                                 data.size_bytes(),
                                 target == 0 ? "" : fmt::format(",\"target\":{}", target)));
    const std::size_t at = binary_.size();
    binary_.resize(at + data.size_bytes());
    if (!data.empty()) std::memcpy(binary_.data() + at, data.data(), data.size_bytes());
    return static_cast<int>(views_.size()) - 1;
  }

  int Accessor(int view, int component_type, std::size_t count, std::string_view type,
               std::string_view more = "") {
    accessors_.push_back(
        fmt::format("{{\"bufferView\":{},\"componentType\":{},\"count\":{},\"type\":\"{}\"{}}}", view,
                    component_type, count, type, more));
    return static_cast<int>(accessors_.size()) - 1;
  }

  static std::string Bounds(std::span<const Float3> values, bool with_zero) {
    Float3 low = {0, 0, 0}, high = {0, 0, 0};
    if (!with_zero && !values.empty()) low = high = values[0];
    for (const Float3& v : values) {
      for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], v[k]), high[k] = std::max(high[k], v[k]);
    }
    return fmt::format(",\"min\":{},\"max\":{}", Numbers(low), Numbers(high));
  }

  int Target(const SparseTarget& target, std::size_t points) {
    const std::vector<std::uint16_t> narrow(target.points.begin(), target.points.end());
    const bool fits = points < 65536;
    const int index_view =
        fits ? View(std::span<const std::uint16_t>(narrow)) : View(std::span<const Index>(target.points));
    const int value_view = View(std::span<const Float3>(target.deltas));
    accessors_.push_back(fmt::format(
        "{{\"componentType\":5126,\"count\":{},\"type\":\"VEC3\"{},\"sparse\":{{\"count\":{},\"indices\":"
        "{{\"bufferView\":{},\"componentType\":{}}},\"values\":{{\"bufferView\":{}}}}}}}",
        points, Bounds(target.deltas, true), target.points.size(), index_view, fits ? 5123 : 5125,
        value_view));
    return static_cast<int>(accessors_.size()) - 1;
  }

  std::string Mesh(const GlbMesh& mesh);
  std::string Clip(const GlbClip& clip);
  std::string Finish(const GlbScene& scene);

 private:
  std::string binary_;
  std::vector<std::string> views_, accessors_;
  std::vector<std::string> materials_ = {
      "{\"name\":\"surface\",\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0.6}}"};
};

std::string Writer::Mesh(const GlbMesh& mesh) {
  constexpr int kArray = 34962, kElements = 34963;
  const std::size_t count = mesh.positions.size();
  const int position = Accessor(View(std::span<const Float3>(mesh.positions), kArray), 5126, count, "VEC3",
                                Bounds(mesh.positions, false));
  const int normal = Accessor(View(std::span<const Float3>(mesh.normals), kArray), 5126, count, "VEC3");
  std::vector<std::array<std::uint8_t, 4>> narrow;
  std::vector<std::array<std::uint16_t, 4>> wide;
  std::vector<std::array<float, 4>> weights;
  bool fits = true;  // into a byte
  for (const Influences& i : mesh.influences) {
    wide.push_back(i.joints), weights.push_back(i.weights);
    std::array<std::uint8_t, 4>& bytes = narrow.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) {
      fits = fits && i.joints[k] < 256;
      bytes[k] = static_cast<std::uint8_t>(i.joints[k]);
    }
  }
  const int joint =
      fits ? Accessor(View(std::span<const std::array<std::uint8_t, 4>>(narrow), kArray), 5121, count, "VEC4")
           : Accessor(View(std::span<const std::array<std::uint16_t, 4>>(wide), kArray), 5123, count, "VEC4");
  const int weight =
      Accessor(View(std::span<const std::array<float, 4>>(weights), kArray), 5126, count, "VEC4");
  std::string color;
  if (!mesh.colors.empty()) {
    color = fmt::format(",\"COLOR_0\":{}",
                        Accessor(View(std::span<const std::array<std::uint8_t, 4>>(mesh.colors), kArray),
                                 5121, count, "VEC4", ",\"normalized\":true"));
  }
  const int indices = Accessor(View(std::span<const Index>(mesh.triangles), kElements), 5125,
                               mesh.triangles.size(), "SCALAR");
  std::size_t material = 0;
  if (mesh.base_color.has_value()) {
    const Float3& c = *mesh.base_color;
    const float rgba[4] = {c[0], c[1], c[2], 1};
    materials_.push_back(
        fmt::format("{{\"name\":\"{}\",\"pbrMetallicRoughness\":{{\"baseColorFactor\":{},"
                    "\"metallicFactor\":0}}}}",
                    mesh.name, Numbers(rgba)));
    material = materials_.size() - 1;
  }
  std::vector<std::string> targets, names, zeros;
  for (const SparseTarget& target : mesh.targets) {
    targets.push_back(fmt::format("{{\"POSITION\":{}}}", Target(target, count)));
    names.push_back(Quoted(target.name));
    zeros.push_back("0");
  }
  std::string morph, more;
  if (!targets.empty()) {
    morph = ",\"targets\":" + Joined(targets);
    more = fmt::format(",\"weights\":{},\"extras\":{{\"targetNames\":{}}}", Joined(zeros), Joined(names));
  }
  return fmt::format(
      "{{\"name\":\"{}\",\"primitives\":[{{\"attributes\":{{\"POSITION\":{},\"NORMAL\":{},\"JOINTS_0\":{},"
      "\"WEIGHTS_0\":{}"
      "{}}},\"indices\":{},\"material\":{}{}}}]{}}}",
      mesh.name, position, normal, joint, weight, color, indices, material, morph, more);
}

std::string Writer::Clip(const GlbClip& clip) {
  std::vector<float> times;
  for (int f = 0; f < clip.frames; ++f) times.push_back(static_cast<float>(f / clip.frames_per_second));
  const int input = Accessor(View(std::span<const float>(times)), 5126, times.size(), "SCALAR",
                             fmt::format(",\"min\":[{}],\"max\":[{}]", times.front(), times.back()));
  std::vector<std::string> samplers, channels;
  for (const GlbChannel& channel : clip.channels) {
    const int view = View(std::span<const float>(channel.values));
    const std::size_t width = channel.weights ? 1 : channel.translation ? 3 : 4;
    const int output = Accessor(view, 5126, channel.values.size() / width,
                                channel.weights       ? "SCALAR"
                                : channel.translation ? "VEC3"
                                                      : "VEC4");
    channels.push_back(fmt::format("{{\"sampler\":{},\"target\":{{\"node\":{},\"path\":\"{}\"}}}}",
                                   samplers.size(), channel.node,
                                   channel.weights       ? "weights"
                                   : channel.translation ? "translation"
                                                         : "rotation"));
    samplers.push_back(
        fmt::format("{{\"input\":{},\"output\":{},\"interpolation\":\"LINEAR\"}}", input, output));
  }
  return fmt::format("{{\"name\":\"{}\",\"samplers\":{},\"channels\":{}}}", clip.name, Joined(samplers),
                     Joined(channels));
}

std::string Writer::Finish(const GlbScene& scene) {
  std::vector<std::string> nodes, meshes, clips, roots, joints;
  for (const GlbMesh& mesh : scene.meshes) meshes.push_back(Mesh(mesh));
  for (const GlbClip& clip : scene.clips) clips.push_back(Clip(clip));
  std::vector<std::array<float, 16>> inverse_binds;
  for (int joint : scene.joints) {
    joints.push_back(fmt::format("{}", joint));
    Matrix4 world;
    for (int n = joint; n >= 0; n = scene.nodes[static_cast<std::size_t>(n)].parent) {
      const GlbNode& node = scene.nodes[static_cast<std::size_t>(n)];
      world = ComposeTrs(node.translation, node.rotation, {1, 1, 1}) * world;
    }
    inverse_binds.push_back(RigidInverse(world));
  }
  const int inverse = Accessor(View(std::span<const std::array<float, 16>>(inverse_binds)), 5126,
                               inverse_binds.size(), "MAT4");
  bool hides = false;
  std::vector<std::vector<std::string>> children_of(scene.nodes.size());
  for (std::size_t c = 0; c < scene.nodes.size(); ++c) {
    if (scene.nodes[c].parent >= 0)
      children_of[static_cast<std::size_t>(scene.nodes[c].parent)].push_back(fmt::format("{}", c));
  }
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    const GlbNode& node = scene.nodes[i];
    const std::vector<std::string>& children = children_of[i];
    std::string text = fmt::format("{{\"name\":\"{}\"", node.name);
    if (node.mesh >= 0) {
      text += fmt::format(",\"mesh\":{},\"skin\":0", node.mesh);
    } else {
      const float t[3] = {static_cast<float>(node.translation.x), static_cast<float>(node.translation.y),
                          static_cast<float>(node.translation.z)};
      text += ",\"translation\":" + Numbers(t);
      if (!(node.rotation == Quaternion())) {
        const Quaternion& q = node.rotation;
        const float r[4] = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z),
                            static_cast<float>(q.w)};
        text += ",\"rotation\":" + Numbers(r);
      }
    }
    if (!children.empty()) text += ",\"children\":" + Joined(children);
    if (node.hidden) text += R"(,"extensions":{"KHR_node_visibility":{"visible":false}})";
    hides = hides || node.hidden;
    nodes.push_back(text + "}");
    if (node.parent < 0) roots.push_back(fmt::format("{}", i));
  }
  while (binary_.size() % 4 != 0) binary_.push_back('\0');
  std::string json = fmt::format(
      "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"kpsa "
      "generate_scenes\"}},\"scene\":0,\"scenes\":[{{\"nodes\":{}}}],"
      "\"nodes\":{},\"meshes\":{},\"skins\":[{{\"joints\":{},\"inverseBindMatrices\":{},\"skeleton\":{}}}],"
      "\"materials\":{},",
      Joined(roots), Joined(nodes), Joined(meshes), Joined(joints), inverse, joints.front(),
      Joined(materials_));
  if (hides) json += R"("extensionsUsed":["KHR_node_visibility"],)";
  if (!clips.empty()) json += fmt::format("\"animations\":{},", Joined(clips));
  json += fmt::format("\"accessors\":{},\"bufferViews\":{},\"buffers\":[{{\"byteLength\":{}}}]}}",
                      Joined(accessors_), Joined(views_), binary_.size());
  while (json.size() % 4 != 0) json.push_back(' ');

  std::string out;
  const auto word = [&](std::size_t value) {
    const auto v = static_cast<std::uint32_t>(value);
    for (int k = 0; k < 4; ++k) out.push_back(static_cast<char>(v >> (8 * k) & 0xff));
  };
  word(0x46546c67);  // glTF 2.0, 4.4: header, then the JSON and the BIN chunk
  word(2);
  word(12 + 8 + json.size() + 8 + binary_.size());
  word(json.size());
  word(0x4e4f534a);
  out += json;
  word(binary_.size());
  word(0x004e4942);
  return out + binary_;
}

}  // namespace

std::string WriteGlb(const GlbScene& scene) { return Writer().Finish(scene); }

std::vector<Float3> SmoothNormals(std::span<const Float3> positions, std::span<const Index> triangles) {
  std::vector<Double3> sums(positions.size());
  const auto at = [&](Index i) { return Double3{positions[i][0], positions[i][1], positions[i][2]}; };
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const Index a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    const Double3 n = Cross(at(b) - at(a), at(c) - at(a));
    for (Index i : {a, b, c}) sums[i] = sums[i] + n;
  }
  std::vector<Float3> out;
  for (const Double3& sum : sums) {
    const double length = Length(sum);
    const Double3 n = length > 0 ? sum * (1 / length) : Double3{0, 0, 1};
    out.push_back({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
  }
  return out;
}

std::vector<Index> Triangulate(std::span<const std::array<int, 4>> quads) {
  std::vector<Index> out;
  for (const auto& q : quads) {
    const auto corner = [&](std::size_t k) { return static_cast<Index>(q[k]); };
    out.insert(out.end(), {corner(0), corner(1), corner(2)});
    if (q[2] != q[3]) out.insert(out.end(), {corner(0), corner(2), corner(3)});
  }
  return out;
}

Influences MakeInfluences(std::span<const double> weight_of_joint) {
  std::vector<std::size_t> order(weight_of_joint.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return weight_of_joint[a] > weight_of_joint[b]; });
  order.resize(std::min<std::size_t>(order.size(), 4));
  double sum = 0;
  for (std::size_t joint : order) sum += weight_of_joint[joint];
  Influences out;
  int rest = 4096;
  for (std::size_t k = order.size(); k-- > 0;) {  // the largest comes last and takes what is left
    const int share =
        k == 0 ? rest : static_cast<int>(std::floor(weight_of_joint[order[k]] / sum * 4096 + 0.5));
    rest -= share;
    out.joints[k] = share > 0 ? static_cast<std::uint16_t>(order[k]) : std::uint16_t{0};
    out.weights[k] = static_cast<float>(share) / 4096;
  }
  return out;
}

Float3 ToMetres(Double3 centimetres) {
  const Double3& p = centimetres;
  return {static_cast<float>(p.x * kMetres), static_cast<float>(p.y * kMetres),
          static_cast<float>(p.z * kMetres)};
}

std::array<std::uint8_t, 4> Color(Double3 linear) {
  const auto byte = [](double v) {
    return static_cast<std::uint8_t>(std::floor(255 * std::clamp(v, 0.0, 1.0) + 0.5));
  };
  return {byte(linear.x), byte(linear.y), byte(linear.z), 255};
}

}  // namespace kpsa::engine::scenes
