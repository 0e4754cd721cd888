#include "io/rig_writer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "io/rig_builder.h"

namespace kpsa {
namespace {

constexpr double kGuessDegrees = 15;        // where no clip tells a range
constexpr double kLeastDegrees = 0.1;       // smaller motion is noise,
constexpr double kLeastBesides = 0.01;      // unless the joint turns about another axis
constexpr double kLeastTranslation = 1e-4;  // of the rest diagonal
constexpr double kSpaceShare = 0.9;         // of the skin that the space's subtree carries

struct Range {
  double min = 0, max = 0;  // rest is always inside
  void Add(double value) {
    min = std::min(min, value);
    max = std::max(max, value);
  }
  double size() const { return std::max(-min, max); }
};

// What the clips do to one glTF node, relative to its rest.
struct Motion {
  Range rotate[3];     // degrees
  Range translate[3];  // metres, in the rest pose's axes
  std::vector<Range> weights;
};

Range RoundedOut(Range range, double step) {
  // A step more or less is decided with some slack: 0.30000000000000004 stays 0.3
  return {std::floor(range.min / step + 1e-6) * step, std::ceil(range.max / step - 1e-6) * step};
}

std::string Rounded(double value) { return NumberText(std::round(value * 1e9) / 1e9); }

// A plain YAML scalar where that is safe in any context, else a double-quoted one.
std::string Quoted(const std::string& text, bool in_flow) {
  const auto safe = [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '.' || c == '-' || c == '@' || (!in_flow && (c == '[' || c == ']'));
  };
  const bool letter_first = !text.empty() && ((text[0] >= 'a' && text[0] <= 'z') ||
                                              (text[0] >= 'A' && text[0] <= 'Z') || text[0] == '_');
  if (letter_first && std::all_of(text.begin(), text.end(), safe)) return text;
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string QuotedList(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + Quoted(name, true);
  return "[" + text + "]";
}

// A comment holds one line.
std::string InComment(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return text;
}

class Writer {
 public:
  Writer(const Rig& rig, const StarterOptions& options)
      : rig_(rig),
        character_(*rig.character),
        options_(options),
        motions_(character_.nodes.size()),
        carries_(character_.nodes.size(), 0.0) {}

  std::string Write() {
    MeasureCarried();
    for (const gltf::Clip& clip : character_.clips) {
      for (const gltf::Channel& channel : clip.channels) Measure(channel);
    }
    WriteHead();
    WriteControls();
    WriteAcceleration();
    return std::move(text_);
  }

 private:
  // By node: the share of all points that it and its descendants move.
  void MeasureCarried() {
    std::map<Index, Index> gltf_of_node;
    for (Index i = 0; i < rig_.scene.transforms.size(); ++i) gltf_of_node[rig_.scene.transforms[i].index] = i;
    double total = 0;
    for (const CharacterMesh& mesh : rig_.scene.meshes) {
      total += mesh.mesh().point_count();
      if (mesh.influences == nullptr) {
        carries_[mesh.gltf_node] += mesh.mesh().point_count();
        continue;
      }
      for (std::size_t i = 0; i < mesh.influences->joints().size(); ++i) {
        carries_[gltf_of_node[mesh.influence_nodes[mesh.influences->joints()[i]].index]] +=
            mesh.influences->weights()[i];
      }
    }
    for (auto it = character_.order.rbegin(); it != character_.order.rend(); ++it) {
      if (character_.nodes[*it].parent != kNoIndex) carries_[character_.nodes[*it].parent] += carries_[*it];
    }
    for (double& share : carries_) share = total > 0 ? share / total : 0;
  }

  void Measure(const gltf::Channel& channel) {
    const gltf::Node& node = character_.nodes[channel.node];
    Motion& motion = motions_[channel.node];
    const auto width = static_cast<std::size_t>(channel.components);
    const bool cubic = channel.interpolation == gltf::Interpolation::kCubicSpline;
    const Matrix4 rest_inverse = InverseOrIdentity(node.LocalMatrix());
    for (std::size_t k = 0; k < channel.times.size(); ++k) {
      const double* value = &channel.values[(cubic ? 3 * k + 1 : k) * width];
      switch (channel.path) {
        case gltf::Path::kRotation: {
          const Quaternion now{value[0], value[1], value[2], value[3]};
          const Matrix4 relative =
              RotationFromQuaternion(Conjugate(Normalized(node.rotation)) * Normalized(now));
          const Double3 angles = EulerFromRotation(relative, RotateOrder::kXyz);
          for (int i = 0; i < 3; ++i) motion.rotate[i].Add(angles[i] * 180 / kPi);
          break;
        }
        case gltf::Path::kTranslation: {
          const Double3 offset = TransformPoint(rest_inverse, {value[0], value[1], value[2]});
          for (int i = 0; i < 3; ++i) motion.translate[i].Add(offset[i]);
          break;
        }
        case gltf::Path::kScale:
          break;
        case gltf::Path::kWeights:
          motion.weights.resize(std::max(motion.weights.size(), width));
          for (std::size_t i = 0; i < width; ++i) motion.weights[i].Add(value[i]);
          break;
      }
    }
  }

  void WriteHead() {
    std::vector<std::string> meshes;
    Index points = 0;
    for (const CharacterMesh& mesh : rig_.scene.meshes) {
      meshes.push_back(mesh.name);
      points += mesh.mesh().point_count();
    }
    const std::string file = options_.character.empty()
                                 ? std::filesystem::path(character_.path).filename().string()
                                 : options_.character;
    text_ += fmt::format(
        "# A starter rig for {}: {} meshes, {} points, {} clips, {:.3g} m from corner to corner.\n"
        "# Lengths are in cm and angles in degrees here; write 2mm or 0.1rad for anything else.\n"
        "kpsa: 1\n"
        "units: {{length: cm, angle: deg}}\n"
        "character: {}\n",
        InComment(file), meshes.size(), points, character_.clips.size(), rig_.rest_diagonal,
        Quoted(file, false));
    if (meshes.empty()) {
      text_ += "# The scene shows no mesh: there is nothing to deform or to accelerate.\n";
      return;
    }
    text_ += fmt::format(
        "\nnodes:\n"
        "  # Smooths what the skin does to the surface. Other deformers: lattice, cluster, softMod, wire "
        "(`kpsa nodes`).\n"
        "  mush: {{type: deltaMush, iterations: {}}}\n"
        "\ndeform:\n"
        "  # gltf is the file's own morph targets and skin; deformers act in this order.\n"
        "  - meshes: {}\n"
        "    stack: [gltf, mush]\n",
        options_.iterations, QuotedList(meshes));
  }

  void AddControl(const std::string& node, const std::string& attribute, const PlugRef& plug, Range range) {
    const std::string name = node + "." + attribute;
    const Result<PlugRef> found = rig_.graph->FindPlug(name);
    if (!found.ok() || !(*found == plug)) {  // names with dots can hide each other
      text_ += fmt::format("  # {} cannot be told from another plug by its name\n", InComment(name));
      return;
    }
    if (control_count_++ == 0) text_ += heading_;
    text_ += fmt::format("  {}: {{min: {}, max: {}}}\n", Quoted(name, false), Rounded(range.min),
                         Rounded(range.max));
  }

  void WriteControls() {
    const bool guess = character_.clips.empty();
    heading_ = guess ? "\n# What may move, for animators and for training. The file has no clips: these "
                       "ranges are guesses.\ncontrols:\n"
                     : "\n# What may move, for animators and for training: what the clips move, as far as "
                       "they move it (rounded outwards).\n"
                       "# Each is on top of the rest pose or of the clip that plays.\ncontrols:\n";
    const double step =
        std::pow(10.0, std::floor(std::log10(std::max(rig_.rest_diagonal, 1e-6) * 100 / 500)));  // cm
    std::vector<std::string> idle;
    for (Index i = 0; i < character_.nodes.size(); ++i) {
      Motion& motion = motions_[i];
      const NodeId node = rig_.scene.transforms[i];
      const std::string& name = rig_.graph->name(node);
      const NodeDef& def = rig_.graph->def(node);
      if (guess && carries_[i] > 0 && IsJoint(i)) {
        for (Range& range : motion.rotate) range = {-kGuessDegrees, kGuessDegrees};
      }
      bool moves = false;
      double turn = 0;
      for (const Range& range : motion.rotate) turn = std::max(turn, range.size());
      const double least = turn >= kLeastDegrees ? kLeastBesides : kLeastDegrees;
      for (int axis = 0; axis < 3; ++axis) {
        const std::string letter(1, "XYZ"[axis]);
        const bool rotates = motion.rotate[axis].size() >= least;
        const bool shifts = motion.translate[axis].size() > kLeastTranslation * rig_.rest_diagonal;
        moves = moves || rotates || shifts;
        if (!(carries_[i] > 0)) continue;
        if (rotates)
          AddControl(name, "rotate" + letter, {node, def.FindAttribute("rotate"), -1, axis},
                     RoundedOut(motion.rotate[axis], motion.rotate[axis].size() < 1 ? 0.1 : 1));
        if (shifts) {
          const Range in_cm{motion.translate[axis].min * 100, motion.translate[axis].max * 100};
          AddControl(name, "translate" + letter, {node, def.FindAttribute("translate"), -1, axis},
                     RoundedOut(in_cm, step));
        }
      }
      if (moves && !(carries_[i] > 0)) idle.push_back(name);
    }
    WriteExpressions();
    for (const CharacterMesh& mesh : rig_.scene.meshes) WriteWeights(mesh);
    if (!idle.empty())
      text_ += fmt::format("  # Moved by clips, but carrying no point: {}\n",
                           InComment(fmt::format("{}", fmt::join(idle, ", "))));
  }

  void WriteExpressions() {
    if (rig_.scene.expressions.version == 0) return;
    const int weight = rig_.graph->def(rig_.scene.expressions).FindAttribute("weight");
    for (std::size_t e = 0; e < character_.expressions.size(); ++e) {
      if (character_.expressions[e].binds.empty()) continue;
      AddElement(rig_.graph->name(rig_.scene.expressions), "weight", character_.expressions[e].name,
                 {rig_.scene.expressions, weight, static_cast<int>(e), -1}, {0, 1});
    }
  }

  // Whether expressions move the target, which is then no control of its own.
  bool IsExpressed(const CharacterMesh& mesh, std::size_t target) const {
    if (mesh.morph_weights.version == 0) return false;
    const int targets = rig_.graph->def(mesh.morph_weights).FindAttribute("targets");
    const auto& list =
        rig_.graph->FindValue({mesh.morph_weights, targets, -1, -1})->get<std::vector<std::int64_t>>();
    return std::find(list.begin(), list.end(), static_cast<std::int64_t>(target)) != list.end();
  }

  // By its name, or where that names something else, by its number.
  void AddElement(const std::string& node, const std::string& array, const std::string& name,
                  const PlugRef& plug, Range range) {
    std::string attribute = array + "[" + name + "]";
    const Result<PlugRef> by_name = rig_.graph->FindPlug(node + "." + attribute);
    if (!by_name.ok() || !(*by_name == plug)) attribute = fmt::format("{}[{}]", array, plug.element);
    AddControl(node, attribute, plug, range);
  }

  void WriteWeights(const CharacterMesh& mesh) {
    if (mesh.geometry.targets == nullptr) return;
    const int weight = rig_.graph->def(mesh.weights_node()).FindAttribute("weight");
    const auto& targets = mesh.geometry.targets->targets();
    std::vector<Range> ranges = motions_[mesh.gltf_node].weights;
    const bool still = ranges.empty();  // no clip moves any
    if (still) ranges.assign(targets.size(), {0, 1});
    for (std::size_t k = 0; k < targets.size() && k < ranges.size(); ++k) {
      if (ranges[k].size() < 0.01 || (still && IsExpressed(mesh, k))) continue;
      AddElement(rig_.graph->name(mesh.transform), "weight", targets[k].name,
                 {mesh.weights_node(), weight, static_cast<int>(k), -1}, RoundedOut(ranges[k], 0.1));
    }
  }

  bool IsJoint(Index node) const {
    for (const gltf::Skin& skin : character_.skins) {
      if (std::find(skin.joints.begin(), skin.joints.end(), node) != skin.joints.end()) return true;
    }
    return false;
  }

  // The deepest transform that carries nearly everything: in its space only what deforms is left to learn.
  std::optional<std::string> Space() const {
    std::optional<Index> best;
    for (Index i :
         character_.order) {  // parents first: later ones are deeper along the one chain that qualifies
      if (carries_[i] >= kSpaceShare && character_.nodes[i].mesh == kNoIndex) best = i;
    }
    if (!best.has_value()) return std::nullopt;
    return rig_.graph->name(rig_.scene.transforms[*best]);
  }

  void WriteAcceleration() {
    if (rig_.scene.meshes.empty() || control_count_ == 0) return;
    std::vector<std::string> points, train, test;
    for (const CharacterMesh& mesh : rig_.scene.meshes) points.push_back(mesh.name + "@mush");
    for (const CharacterClip& clip : rig_.scene.clips) {
      std::vector<std::string>& to = test.empty() ? test : train;
      if (std::find(test.begin(), test.end(), clip.id) == test.end() &&
          std::find(train.begin(), train.end(), clip.id) == train.end()) {
        to.push_back(clip.id);
      }
    }
    const std::string stem = std::filesystem::path(character_.path).stem().string();
    // 0.3 % of the size or a bit less, as one round number: what lets most frames of a face be hits
    const double raw = rig_.rest_diagonal * 1000 * 0.003;
    const double power = std::pow(10.0, std::floor(std::log10(std::max(raw, 1e-9))));
    const double tolerance = power * (raw >= 5 * power ? 5 : raw >= 2 * power ? 2 : 1);
    text_ += fmt::format("\naccelerate:\n  {}:\n", Quoted(stem.empty() ? "character" : stem, false));
    text_ += fmt::format("    points: {}  # up to and including that stage; later stages run exactly\n",
                         QuotedList(points));
    if (const std::optional<std::string> space = Space()) {
      text_ += fmt::format("    space: {}  # the transform in whose space the points are learned\n",
                           Quoted(*space, false));
    }
    text_ += fmt::format("    subspace: {}  # `kpsa train` writes it\n",
                         Quoted(options_.subspace.empty() ? stem + ".kpsa" : options_.subspace, false));
    text_ += fmt::format("    tolerance: {}mm  # the largest error of a point that is accepted\n",
                         Rounded(tolerance));
    text_ += "    violationRate: 3%  # of frames that may exceed it\n";
    text_ += fmt::format("    train: {{{}samples: {}}}  # clips, and poses drawn from the controls\n",
                         train.empty() ? "" : "clips: " + QuotedList(train) + ", ", options_.samples);
    if (!test.empty())
      text_ += fmt::format("    test: {{clips: {}}}  # never trained on; what `kpsa bench` runs\n",
                           QuotedList(test));
  }

  const Rig& rig_;
  const gltf::Character& character_;
  const StarterOptions& options_;
  std::vector<Motion> motions_;  // by glTF node
  std::vector<double> carries_;  // by glTF node
  std::string text_, heading_;
  int control_count_ = 0;
};

}  // namespace

Result<std::string> StarterRig(const NodeRegistry& registry, const std::string& character_path,
                               const StarterOptions& options) {
  RigOptions rig_options;
  rig_options.rest = true;
  Result<Rig> rig = LoadRig(registry, character_path, rig_options);
  if (!rig.ok()) return rig.status();
  return Writer(*rig, options).Write();
}

}  // namespace kpsa
