#include "rig/build/writer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "base/text.h"
#include "rig/character/joint_roles.h"
#include "rig/build/rig_builder.h"
#include "rig/build/starter_training.h"

namespace kpsa::engine {
namespace {

constexpr double kGuessDegrees = 15;        // where no clip tells a range
constexpr double kLeastDegrees = 0.1;       // smaller motion is noise,
constexpr double kLeastBesides = 0.01;      // unless the joint turns about another axis
constexpr double kLeastTranslation = 1e-4;  // of the rest diagonal
constexpr double kLeastWeight = 0.01;
constexpr double kSpaceShare = 0.9;  // of the skin that the space's subtree carries
constexpr double kLargeMetres = 20;  // more is seldom meant
constexpr double kReach = 0.25;      // of a limb's length, that its target may go

MotionRange RoundedOut(MotionRange range, double step) {
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
  Writer(Rig* rig, const StarterOptions& options)
      : changed_(rig),
        rig_(*rig),
        character_(*rig->character),
        options_(options),
        roles_(JointRoles(character_)),
        motions_(character_.nodes.size()),
        carries_(character_.nodes.size(), 0.0),
        mush_(FreeName("mush")) {}

  Result<std::string> Write() {
    MeasureCarried();
    for (const gltf::Clip& clip : character_.clips) {
      clips_.push_back(MeasureClip(character_, clip));
      for (const auto& [node, motion] : clips_.back()) motions_[node].Add(motion);
    }
    limbs_ = FindLimbs(character_, roles_);
    WriteHead();
    WriteSkins();
    WriteControls();
    const Result<bool> accelerates = WriteAcceleration();
    if (!accelerates.ok()) return accelerates.status();
    return Title(*accelerates) + text_;
  }
  const std::string& remark() const { return remark_; }

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

  // A name that nothing else has.
  std::string FreeName(const std::string& wish) const {
    const auto taken = [&](const std::string& name) {
      return rig_.graph->FindNode(name).ok() ||
             std::any_of(character_.nodes.begin(), character_.nodes.end(),
                         [&](const gltf::Node& node) { return node.name == name; });
    };
    std::string name = wish;
    for (int i = 2; taken(name); ++i) name = fmt::format("{}{}", wish, i);
    return name;
  }
  const std::string& NameOf(Index node) const { return rig_.graph->name(rig_.scene.transforms[node]); }

  std::string Title(bool accelerates) const {
    Index points = 0;
    for (const CharacterMesh& mesh : rig_.scene.meshes) points += mesh.mesh().point_count();
    const auto several = [](std::size_t count, const char* one, const char* many) {
      return fmt::format("{} {}", Thousands(count), count == 1 ? one : many);
    };
    std::string text = fmt::format(
        "# A starter rig for {}: {}, {}, {}, {:.3g} m from corner to corner.\n"
        "# It works as it is: kpsa validate, eval, render{}. Comments say what to do next; take out the # "
        "where no space\n"
        "# follows it to try what is suggested there.\n"
        "# Lengths are in cm and angles in degrees; write 2mm or 0.1rad for anything else.\n",
        InComment(File()), several(rig_.scene.meshes.size(), "mesh", "meshes"),
        several(points, "point", "points"), several(character_.clips.size(), "clip", "clips"),
        rig_.rest_diagonal, accelerates ? ", train, bench" : "");
    if (rig_.rest_diagonal > kLargeMetres)
      text += "# So large a character may have been meant in cm: then read cm where metres are written.\n";
    return text;
  }
  std::string File() const {
    return options_.character.empty() ? std::filesystem::path(character_.path).filename().string()
                                      : options_.character;
  }

  void WriteHead() {
    std::vector<std::string> meshes;
    for (const std::size_t m : ShownMeshes(rig_.scene)) meshes.push_back(rig_.scene.meshes[m].name);
    text_ += fmt::format(
        "kpsa: 1\n"
        "units: {{length: cm, angle: deg}}\n"
        "character: {}\n",
        Quoted(File(), false));
    if (meshes.empty()) {
      remark_ = "the scene shows no mesh, so that there is nothing to accelerate";
      text_ += "# The scene shows no mesh: there is nothing to deform or to accelerate.\n";
      return;
    }
    text_ += fmt::format(
        "\nnodes:\n"
        "  # Smooths what the skin does to the surface. Other deformers: lattice, cluster, softMod, wire, "
        "wrap, "
        "... (kpsa nodes).\n"
        "  {}: {{type: deltaMush, iterations: {}}}\n",
        Quoted(mush_, false), options_.iterations);
    WriteCage();
    WriteLimbs();
    text_ += fmt::format(
        "\ndeform:\n"
        "  # gltf is the file's own morph targets and skin; deformers act in this order.{}\n"
        "  - meshes: {}\n"
        "    stack: [gltf, {}]\n",
        cage_.empty() ? "" : fmt::format(" {} would go before {}.", cage_, mush_), QuotedList(meshes),
        Quoted(mush_, true));
  }

  // A lattice about the jaw, where there is one that moves points.
  void WriteCage() {
    const Index jaw = FindJoint(character_, "jaw");
    if (jaw == kNoIndex || character_.nodes[jaw].parent == kNoIndex || !IsInfluence(jaw)) return;
    cage_ = FreeName("jawCage");
    text_ += fmt::format(
        "  # A cage about what the jaw moves; connect its points, as in chin.outValue -> "
        "{0}.points[1,0,2].y\n"
        "  #{0}: {{type: lattice, parent: {1}, divisions: [3, 3, 3], members: {{joint: {2}, above: "
        "0.05}}}}\n",
        cage_, Quoted(NameOf(character_.nodes[jaw].parent), true), Quoted(NameOf(jaw), true));
  }
  bool IsInfluence(Index node) const {
    return std::any_of(rig_.scene.meshes.begin(), rig_.scene.meshes.end(), [&](const CharacterMesh& mesh) {
      return std::find(mesh.influence_nodes.begin(), mesh.influence_nodes.end(),
                       rig_.scene.transforms[node]) != mesh.influence_nodes.end();
    });
  }

  std::string GoalOf(const Limb& limb) const {
    return FreeName(fmt::format("{}{}Goal", limb.part == BodyPart::kArm ? "hand" : "foot",
                                limb.side == BodySide::kLeft ? "L" : "R"));
  }
  void WriteLimbs() {
    if (limbs_.empty()) return;
    text_ +=
        "  # IK: the end of a limb follows its goal (blend: 0 is the clip alone); a poleVectorConstraint "
        "turns "
        "the elbow or knee.\n";
    for (const Limb& limb : limbs_) {
      const std::string goal = GoalOf(limb), end = Quoted(NameOf(limb.end), true);
      text_ += fmt::format(
          "  #{0}: {{type: transform, at: {1}}}\n"
          "  #{2}: {{type: ikHandle, start: {3}, mid: {4}, end: {1}, target: {0}.worldMatrix}}\n",
          goal, end, FreeName(goal + "Ik"), Quoted(NameOf(limb.start), true), Quoted(NameOf(limb.mid), true));
    }
  }
  // How far the goal may go, in each direction.
  void WriteGoals(const Limb& limb) {
    const auto place = [&](Index node) {
      Matrix4 world;
      for (Index i = node; i != kNoIndex; i = character_.nodes[i].parent)
        world = character_.nodes[i].LocalMatrix() * world;
      return TransformPoint(world, {});
    };
    const double length =
        Length(place(limb.mid) - place(limb.start)) + Length(place(limb.end) - place(limb.mid));
    const double reach = std::max(std::floor(kReach * length * 100), 0.1);
    for (const char axis : {'X', 'Y', 'Z'})
      text_ += fmt::format("  #{0}.translate{1}: {{min: {2}, max: {3}}}\n", GoalOf(limb), axis,
                           Rounded(-reach), Rounded(reach));
  }

  void WriteSkins() {
    std::vector<std::string> skins;
    for (const CharacterMesh& mesh : rig_.scene.meshes) {
      if (mesh.influences != nullptr) skins.push_back(rig_.graph->name(mesh.skin_cluster));
    }
    if (skins.empty()) return;
    text_ += fmt::format(
        "\n# Keeps the thickness of twisted limbs{}. Skin weights as files to edit: kpsa weights export\n"
        "#overrides:\n  #{}: dualQuaternion\n",
        skins.size() == 1 ? "" : ", here of one skin of several",
        Quoted(skins[0] + ".skinningMethod", false));
  }

  void AddControl(const std::string& node, const std::string& attribute, const PlugRef& plug,
                  MotionRange range) {
    const std::string name = node + "." + attribute;
    const Result<PlugRef> found = rig_.graph->FindPlug(name);
    if (!found.ok() || !(*found == plug)) {  // names with dots can hide each other
      group_->text += fmt::format("  # {} cannot be told from another plug by its name\n", InComment(name));
      return;
    }
    ++group_->controls;
    const double unit = plug.component < 0 ? 1 : attribute.starts_with("rotate") ? kPi / 180 : 0.01;
    controls_.push_back({plug, {range.min * unit, range.max * unit}});
    group_->text += fmt::format("  {}: {{min: {}, max: {}}}\n", Quoted(name, false), Rounded(range.min),
                                Rounded(range.max));
  }

  // Controls under one heading.
  struct Group {
    std::string title, text;
    int controls = 0;
  };
  static std::string Title(std::string title, BodySide side) {
    if (title[0] >= 'a' && title[0] <= 'z') title[0] = static_cast<char>(title[0] - 'a' + 'A');
    return side == BodySide::kMiddle ? title : fmt::format("{}, {}", title, SideName(side));
  }
  Group* GroupOf(const JointRole& role) {
    const int part = static_cast<int>(role.part), side = static_cast<int>(role.side);
    const bool arm = role.part == BodyPart::kArm || role.part == BodyPart::kFingers;
    // An arm and its fingers, then the other arm
    const int place = role.part == BodyPart::kOther ? 90
                      : arm                         ? 10 * static_cast<int>(BodyPart::kArm) + 2 * side
                                                    : 10 * part;
    Group& group = groups_[place + (arm ? part - static_cast<int>(BodyPart::kArm) : side)];
    group.title = Title(PartName(role.part), role.side);
    return &group;
  }

  // Whether any clip takes anything away from rest.
  bool AnyMotion() const {
    return std::any_of(motions_.begin(), motions_.end(), [&](const Motion& motion) {
      const auto beyond = [](double least) {
        return [least](const MotionRange& range) { return range.size() > least; };
      };
      return std::any_of(motion.rotate, motion.rotate + 3, beyond(kLeastDegrees)) ||
             std::any_of(motion.translate, motion.translate + 3,
                         beyond(kLeastTranslation * rig_.rest_diagonal)) ||
             std::any_of(motion.weights.begin(), motion.weights.end(), beyond(kLeastWeight));
    });
  }

  void WriteControls() {
    const bool guess = !AnyMotion();
    std::string heading =
        guess
            ? "\n# What may move, for animators and for training. The file has no clip that moves anything: "
              "these ranges are guesses, to be corrected.\ncontrols:\n"
            : "\n# What may move, for animators and for training: what the clips move, as far as they do "
              "(rounded outwards).\n"
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
        for (MotionRange& range : motion.rotate) range = {-kGuessDegrees, kGuessDegrees};
      }
      group_ = GroupOf(roles_[i]);
      bool moves = false;
      double turn = 0;
      for (const MotionRange& range : motion.rotate) turn = std::max(turn, range.size());
      const double least = turn >= kLeastDegrees ? kLeastBesides : kLeastDegrees;
      const auto add = [&](const char* attribute, int axis, MotionRange range) {
        moves = true;
        if (carries_[i] > 0)
          AddControl(name, fmt::format("{}{}", attribute, "XYZ"[axis]),
                     {node, def.FindAttribute(attribute), -1, axis}, range);
      };
      for (int axis = 0; axis < 3; ++axis) {
        const MotionRange& range = motion.rotate[axis];
        if (range.size() >= least) add("rotate", axis, RoundedOut(range, range.size() < 1 ? 0.1 : 1));
      }
      for (int axis = 0; axis < 3; ++axis) {
        const MotionRange& range = motion.translate[axis];
        if (range.size() > kLeastTranslation * rig_.rest_diagonal)
          add("translate", axis, RoundedOut({range.min * 100, range.max * 100}, step));
      }
      if (moves && !(carries_[i] > 0)) idle.push_back(name);
    }
    WriteExpressions();
    int place = 100;
    for (const std::size_t m : ShownMeshes(rig_.scene)) WriteWeights(rig_.scene.meshes[m], &place);
    std::erase_if(groups_, [](const auto& group) { return group.second.text.empty(); });
    for (const auto& [key, group] : groups_) control_count_ += group.controls;
    if (control_count_ > 0) text_ += heading;
    for (const auto& [key, group] : groups_) {
      if (groups_.size() > 1) text_ += fmt::format("  # {}\n", InComment(group.title));
      text_ += group.text;
    }
    if (control_count_ > 0 && !limbs_.empty()) text_ += "  # Goals of the IK above\n";
    for (const Limb& limb : limbs_) {
      if (control_count_ > 0) WriteGoals(limb);
    }
    if (!idle.empty())
      text_ += fmt::format("  # Moved by clips, but carrying no point: {}\n",
                           InComment(fmt::format("{}", fmt::join(idle, ", "))));
  }

  void WriteExpressions() {
    if (rig_.scene.expressions.version == 0) return;
    const int weight = rig_.graph->def(rig_.scene.expressions).FindAttribute("weight");
    group_ = &groups_[99];
    group_->title = "Expressions";
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
                  const PlugRef& plug, MotionRange range) {
    std::string attribute = array + "[" + name + "]";
    const Result<PlugRef> by_name = rig_.graph->FindPlug(node + "." + attribute);
    if (!by_name.ok() || !(*by_name == plug)) attribute = fmt::format("{}[{}]", array, plug.element);
    AddControl(node, attribute, plug, range);
  }

  void WriteWeights(const CharacterMesh& mesh, int* place) {
    const int first = *place;
    *place += 3;  // sides
    if (mesh.geometry.targets == nullptr) return;
    const int weight = rig_.graph->def(mesh.weights_node()).FindAttribute("weight");
    const auto& targets = mesh.geometry.targets->targets();
    std::vector<MotionRange> ranges = motions_[mesh.gltf_node].weights;
    const bool still = std::none_of(ranges.begin(), ranges.end(), [](const MotionRange& range) {
      return range.size() >= kLeastWeight;
    });  // no clip moves any
    if (still) ranges.assign(targets.size(), {0, 1});
    for (std::size_t k = 0; k < targets.size() && k < ranges.size(); ++k) {
      if (ranges[k].size() < kLeastWeight || (still && IsExpressed(mesh, k))) continue;
      const PlugRef plug{mesh.weights_node(), weight, static_cast<int>(k), -1};
      const BodySide side = SideOfName(targets[k].name);
      group_ = &groups_[first + static_cast<int>(side)];
      group_->title = Title("Shapes of " + mesh.name, side);
      const std::string& node = rig_.graph->name(mesh.transform);
      AddElement(node, "weight", targets[k].name, plug, RoundedOut(ranges[k], 0.1));
    }
  }

  bool IsJoint(Index node) const {
    for (const gltf::Skin& skin : character_.skins) {
      if (std::find(skin.joints.begin(), skin.joints.end(), node) != skin.joints.end()) return true;
    }
    return false;
  }

  // The deepest transform that carries nearly everything: in its space only what deforms is left to learn.
  std::optional<NodeId> Space() const {
    std::optional<NodeId> best;
    for (Index i :
         character_.order) {  // parents first: later ones are deeper along the one chain that qualifies
      if (carries_[i] >= kSpaceShare && character_.nodes[i].mesh == kNoIndex) best = rig_.scene.transforms[i];
    }
    return best;
  }

  // Whether there is anything to accelerate.
  Result<bool> WriteAcceleration() {
    if (rig_.scene.meshes.empty()) return false;
    if (control_count_ == 0) {
      Remark("nothing of it moves, no clip, joint or morph target, so that there is nothing to accelerate");
      return false;
    }
    const std::optional<NodeId> space = Space();
    const Result<StarterTraining> training = ChooseTraining(changed_, space, clips_, controls_);
    if (!training.ok()) return training.status();
    if (!training->deforms) {
      Remark("it only moves as a whole and never deforms, so that there is nothing to accelerate");
      return false;
    }
    std::vector<std::string> train = training->train, test = training->test;
    WriteParts(*training, &train, &test);
    const std::string stem = std::filesystem::path(character_.path).stem().string();
    std::vector<std::string> points;
    for (const std::size_t m : ShownMeshes(rig_.scene))
      points.push_back(rig_.scene.meshes[m].name + "@" + mush_);
    text_ += fmt::format(
        "\n# What kpsa train learns and kpsa bench measures. More clips and wider controls make it hold for "
        "more "
        "poses.\n"
        "accelerate:\n  {}:\n",
        Quoted(stem.empty() ? "character" : stem, false));
    text_ += fmt::format("    points: {}  # up to and including that stage; later stages run exactly\n",
                         QuotedList(points));
    if (space.has_value()) {
      text_ +=
          fmt::format("    space: {}  # what carries nearly all points; motion in its space is learned\n",
                      Quoted(rig_.graph->name(*space), false));
    }
    text_ += fmt::format("    subspace: {}  # kpsa train writes it\n",
                         Quoted(options_.subspace.empty() ? stem + ".kpsa" : options_.subspace, false));
    WriteTolerance(*training);
    text_ += "    violationRate: 3%  # of frames that may exceed it\n";
    const int samples = options_.samples.value_or(StarterSamples(controls_.size(), training->frames));
    text_ += fmt::format("    train: {{{}samples: {}}}  # clips, and poses drawn from {} control{}\n",
                         train.empty() ? "" : "clips: " + QuotedList(train) + ", ", samples,
                         Thousands(controls_.size()), controls_.size() == 1 ? "" : "s");
    if (!training->still.empty())
      text_ += fmt::format("    # Clips that move no point, and train nothing: {}\n",
                           InComment(fmt::format("{}", fmt::join(training->still, ", "))));
    if (test.empty()) {
      remark_ = "no clip moves its points: controls alone train it, and kpsa bench has the rest pose only";
      text_ +=
          "    # No clip moves the points, so that there is none to test on; kpsa bench takes the rest "
          "pose\n";
      return true;
    }
    const char* why = !training->parts.empty() ? ""
                      : train.empty()          ? ": the only one that moves the points, and short"
                                               : ": of those that move the points well, the one that goes "
                                                 "least beyond the others";
    text_ += fmt::format("    test: {{clips: {}}}  # never trained on; what kpsa bench runs{}\n",
                         QuotedList(test), why);
    return true;
  }
  void Remark(const char* sentence) {
    remark_ = sentence;
    text_ += fmt::format("\n# No accelerate section: {}.\n", sentence);
  }

  // The parts of a clip as clips of the rig, added to what trains and tests.
  void WriteParts(const StarterTraining& training, std::vector<std::string>* train,
                  std::vector<std::string>* test) {
    if (training.parts.empty()) return;
    text_ += fmt::format(
        "\n# {} alone moves the points: parts of it train and others test, with gaps in between, as "
        "neighbouring\n"
        "# frames are nearly the same.\n"
        "clips:\n",
        InComment(training.cut));
    for (const ClipPart& part : training.parts) {
      std::vector<std::string>* list = part.test ? test : train;
      std::string name;
      for (int i = 1; name.empty() || character_.FindClip(name) != kNoIndex ||
                      std::find(list->begin(), list->end(), name) != list->end();
           ++i) {
        name = fmt::format("{}_{}{}", training.cut, part.test ? "test" : "train", i);
      }
      list->push_back(name);
      text_ += fmt::format("  {}: {{layers: [{{clip: {}}}], frames: [{}, {}]}}\n", Quoted(name, false),
                           Quoted(training.cut, true), part.first, part.last);
    }
  }

  void WriteTolerance(const StarterTraining& training) {
    const double by_size = kToleranceOfSize * rig_.rest_diagonal,
                 by_motion = kToleranceOfMotion * training.motion;
    const auto about = [](double metres) {
      const double unit = metres > 0 ? std::pow(10.0, std::floor(std::log10(metres)) - 2) : 1;
      return LengthOf(std::round(metres / unit) * unit);
    };
    const std::string from =
        training.motion > 0 && by_motion < by_size
            ? fmt::format("{:.3g} % of how far {} move what moves most (RMS {})", kToleranceOfMotion * 100,
                          training.by_clips ? "the clips" : "controls", about(training.motion))
            : fmt::format("{:.3g} % of the size ({})", kToleranceOfSize * 100, about(rig_.rest_diagonal));
    text_ += fmt::format(
        "    tolerance: {}  # the largest error of a point that is accepted: {}, rounded\n",
        LengthOf(StarterTolerance(rig_.rest_diagonal, training.motion)), from);
    text_ += "    # kpsa bench says which tolerance would hit how often, and how fast that is\n";
  }
  static std::string LengthOf(double metres) {
    if (metres >= 1) return Rounded(metres) + "m";
    return metres >= 0.01 ? Rounded(metres * 100) + "cm" : Rounded(metres * 1000) + "mm";
  }
  Rig* changed_;  // rig_, for clips to play while motion is measured
  const Rig& rig_;
  const gltf::Character& character_;
  const StarterOptions& options_;
  std::vector<JointRole> roles_;  // by glTF node
  std::vector<Limb> limbs_;
  std::vector<ClipMotion> clips_;
  std::vector<Motion> motions_;  // of all clips, by glTF node
  std::vector<ControlPlug> controls_;
  std::vector<double> carries_;  // by glTF node
  std::string mush_, cage_;      // names; "": there is no cage
  std::string text_, remark_;
  std::map<int, Group> groups_;  // by their place in the file
  Group* group_ = nullptr;       // that controls are added to
  int control_count_ = 0;
};

}  // namespace

Result<std::string> StarterRig(const NodeRegistry& registry, const std::string& character_path,
                               const StarterOptions& options, std::string* remark) {
  RigOptions rig_options;
  rig_options.rest = true;
  Result<Rig> rig = LoadRig(registry, character_path, rig_options);
  if (!rig.ok()) return rig.status();
  Writer writer(&*rig, options);
  Result<std::string> text = writer.Write();
  if (!text.ok()) return Status(text.status()).At({character_path});
  if (remark != nullptr) *remark = writer.remark();
  return text;
}

}  // namespace kpsa::engine
