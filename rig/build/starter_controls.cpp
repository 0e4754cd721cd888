#include "rig/build/starter_controls.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "rig/build/starter_text.h"

namespace kpsa::engine {
namespace {

constexpr double kGuessDegrees = 15;    // where no clip tells a range
constexpr double kLeastBesides = 0.01;  // degrees, of a joint that turns about another axis
constexpr double kReach = 0.25;         // of a limb's length, that its target may go

class ControlWriter {
 public:
  explicit ControlWriter(const StarterCharacter& character) : in_(character) {}

  StarterControls Write() {
    const bool guess = !in_.AnyMotion();
    std::string heading =
        guess
            ? "\n# What may move, for animators and for training. The file has no clip that moves anything: "
              "these ranges are guesses, to be corrected.\ncontrols:\n"
            : "\n# What may move, for animators and for training: what the clips move, as far as they do "
              "(rounded outwards).\n"
              "# Each is on top of the rest pose or of the clip that plays.\ncontrols:\n";
    const double step =
        std::pow(10.0, std::floor(std::log10(std::max(in_.rig.rest_diagonal, 1e-6) * 100 / 500)));  // cm
    std::vector<std::string> idle;
    for (Index i = 0; i < in_.character.nodes.size(); ++i) {
      Motion motion = in_.motions[i];
      const NodeId node = in_.rig.scene.transforms[i];
      const std::string& name = in_.rig.graph->name(node);
      const NodeDef& def = in_.rig.graph->def(node);
      if (guess && in_.carries[i] > 0 && in_.IsJoint(i)) {
        for (MotionRange& range : motion.rotate) range = {-kGuessDegrees, kGuessDegrees};
      }
      group_ = GroupOf(in_.roles[i]);
      bool moves = false;
      double turn = 0;
      for (const MotionRange& range : motion.rotate) turn = std::max(turn, range.size());
      const double least = turn >= kLeastDegrees ? kLeastBesides : kLeastDegrees;
      const auto add = [&](const char* attribute, int axis, MotionRange range) {
        moves = true;
        if (in_.carries[i] > 0)
          AddControl(name, fmt::format("{}{}", attribute, "XYZ"[axis]),
                     {node, def.FindAttribute(attribute), -1, axis}, range);
      };
      for (int axis = 0; axis < 3; ++axis) {
        const MotionRange& range = motion.rotate[axis];
        if (range.size() >= least) add("rotate", axis, RoundedOut(range, range.size() < 1 ? 0.1 : 1));
      }
      for (int axis = 0; axis < 3; ++axis) {
        const MotionRange& range = motion.translate[axis];
        if (range.size() > kLeastTranslation * in_.rig.rest_diagonal)
          add("translate", axis, RoundedOut({range.min * 100, range.max * 100}, step));
      }
      for (int axis = 0; axis < 3; ++axis) {
        const MotionRange& range = motion.scale[axis];
        if (range.size() >= kLeastScale) {
          const MotionRange grown = RoundedOut({range.min + 1, range.max + 1}, 0.01);
          add("scale", axis, {std::max(grown.min, 0.01), grown.max});
        }
      }
      if (moves && !(in_.carries[i] > 0)) idle.push_back(name);
    }
    WriteExpressions();
    int place = 100;
    for (const std::size_t m : ShownMeshes(in_.rig.scene)) WriteWeights(in_.rig.scene.meshes[m], &place);
    std::erase_if(groups_, [](const auto& group) { return group.second.text.empty(); });
    const bool any = !out_.controls.empty();
    if (any) out_.text += heading;
    for (const auto& [key, group] : groups_) {
      if (groups_.size() > 1) out_.text += fmt::format("  # {}\n", InComment(group.title));
      out_.text += group.text;
    }
    if (any && !in_.limbs.empty()) out_.text += "  # Goals of the IK above\n";
    for (const Limb& limb : in_.limbs) {
      if (any) WriteGoals(limb);
    }
    if (!idle.empty())
      out_.text += fmt::format("  # Moved by clips, but carrying no point: {}\n",
                               InComment(fmt::format("{}", fmt::join(idle, ", "))));
    return std::move(out_);
  }

 private:
  // Controls under one heading.
  struct Group {
    std::string title, text;
  };
  void AddControl(const std::string& node, const std::string& attribute, const PlugRef& plug,
                  MotionRange range) {
    const std::string name = node + "." + attribute;
    const Result<PlugRef> found = in_.rig.graph->FindPlug(name);
    if (!found.ok() || !(*found == plug)) {  // names with dots can hide each other
      group_->text += fmt::format("  # {} cannot be told from another plug by its name\n", InComment(name));
      return;
    }
    const double unit = attribute.starts_with("rotate")      ? kPi / 180
                        : attribute.starts_with("translate") ? 0.01
                                                             : 1;
    out_.controls.push_back({plug, {range.min * unit, range.max * unit}});
    group_->text += fmt::format("  {}: {{min: {}, max: {}}}\n", Quoted(name, false), Rounded(range.min),
                                Rounded(range.max));
  }

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

  void WriteExpressions() {
    if (in_.rig.scene.expressions.version == 0) return;
    const int weight = in_.rig.graph->def(in_.rig.scene.expressions).FindAttribute("weight");
    group_ = &groups_[99];
    group_->title = "Expressions";
    for (std::size_t e = 0; e < in_.character.expressions.size(); ++e) {
      if (in_.character.expressions[e].binds.empty()) continue;
      AddElement(in_.rig.graph->name(in_.rig.scene.expressions), "weight", in_.character.expressions[e].name,
                 {in_.rig.scene.expressions, weight, static_cast<int>(e), -1}, {0, 1});
    }
  }

  // Whether expressions move the target, which is then no control of its own.
  bool IsExpressed(const CharacterMesh& mesh, std::size_t target) const {
    if (mesh.morph_weights.version == 0) return false;
    const int targets = in_.rig.graph->def(mesh.morph_weights).FindAttribute("targets");
    const auto& list =
        in_.rig.graph->FindValue({mesh.morph_weights, targets, -1, -1})->get<std::vector<std::int64_t>>();
    return std::find(list.begin(), list.end(), static_cast<std::int64_t>(target)) != list.end();
  }

  // By its name, or where that names something else, by its number.
  void AddElement(const std::string& node, const std::string& array, const std::string& name,
                  const PlugRef& plug, MotionRange range) {
    std::string attribute = array + "[" + name + "]";
    const Result<PlugRef> by_name = in_.rig.graph->FindPlug(node + "." + attribute);
    if (!by_name.ok() || !(*by_name == plug)) attribute = fmt::format("{}[{}]", array, plug.element);
    AddControl(node, attribute, plug, range);
  }

  void WriteWeights(const CharacterMesh& mesh, int* place) {
    const int first = *place;
    *place += 3;  // sides
    if (mesh.geometry.targets == nullptr) return;
    const int weight = in_.rig.graph->def(mesh.weights_node()).FindAttribute("weight");
    const auto& targets = mesh.geometry.targets->targets();
    std::vector<MotionRange> ranges = in_.motions[mesh.gltf_node].weights;
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
      const std::string& node = in_.rig.graph->name(mesh.transform);
      AddElement(node, "weight", targets[k].name, plug, RoundedOut(ranges[k], 0.1));
    }
  }

  // How far the goal may go, in each direction.
  void WriteGoals(const Limb& limb) {
    const auto place = [&](Index node) {
      Matrix4 world;
      for (Index i = node; i != kNoIndex; i = in_.character.nodes[i].parent)
        world = in_.character.nodes[i].LocalMatrix() * world;
      return TransformPoint(world, {});
    };
    const double length =
        Length(place(limb.mid) - place(limb.start)) + Length(place(limb.end) - place(limb.mid));
    const double reach = std::max(std::floor(kReach * length * 100), 0.1);
    for (const char axis : {'X', 'Y', 'Z'})
      out_.text += fmt::format("  #{0}.translate{1}: {{min: {2}, max: {3}}}\n", in_.GoalOf(limb), axis,
                               Rounded(-reach), Rounded(reach));
  }

  const StarterCharacter& in_;
  StarterControls out_;
  std::map<int, Group> groups_;  // by their place in the file
  Group* group_ = nullptr;       // that controls are added to
};

}  // namespace

StarterControls WriteControls(const StarterCharacter& character) { return ControlWriter(character).Write(); }

}  // namespace kpsa::engine
