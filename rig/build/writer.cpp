#include "rig/build/writer.h"

#include <filesystem>

#include "base/quantity_text.h"
#include "rig/build/starter_acceleration.h"
#include "rig/build/starter_stack.h"
#include "rig/build/starter_text.h"
#include "rig/build/starter_training.h"

namespace kpsa::engine {
namespace {

constexpr double kLargeMetres = 20;  // more is seldom meant

std::string TitleOf(const StarterCharacter& in, const std::string& file, bool accelerates) {
  Index points = 0;
  for (const CharacterMesh& mesh : in.rig.scene.meshes) points += mesh.mesh().point_count();
  std::string text = fmt::format(
      "# A starter rig for {}: {}, {}, {}, {:.3g} m from corner to corner.\n"
      "# It works as it is: kpsa validate, eval, render{}. Comments say what to do next; take out the # "
      "where no space\n"
      "# follows it to try what is suggested there.\n"
      "# Lengths are in cm and angles in degrees; write 2mm or 0.1rad for anything else.\n",
      InComment(file), Plural(in.rig.scene.meshes.size(), "mesh"), Plural(points, "point"),
      Plural(in.character.clips.size(), "clip"), in.rig.rest_diagonal, accelerates ? ", train, bench" : "");
  if (in.rig.rest_diagonal > kLargeMetres)
    text += "# So large a character may have been meant in cm: then read cm where metres are written.\n";
  return text;
}

}  // namespace

Result<std::string> StarterRig(const NodeRegistry& registry, const std::string& character_path,
                               const StarterOptions& options, std::string* remark) {
  RigOptions rig_options;
  rig_options.rest = true;
  Result<Rig> rig = LoadRig(registry, character_path, rig_options);
  if (!rig.ok()) return rig.status();
  rig->fps = rig->units.fps = FramesOfKeys(rig->character->clips);
  const std::string file = options.character.empty()
                               ? std::filesystem::path(rig->character->path).filename().string()
                               : options.character;
  const StarterCharacter character(*rig);
  const StarterStack stack = WriteStack(character, file, options.iterations);
  const StarterControls controls = WriteControls(character);
  const Result<StarterAcceleration> acceleration =
      WriteAcceleration(character, controls, stack.mush, options, &*rig);
  if (!acceleration.ok()) return Status(acceleration.status()).At({character_path});
  if (remark != nullptr) *remark = acceleration->remark.empty() ? stack.remark : acceleration->remark;
  return TitleOf(character, file, acceleration->accelerates) + stack.text + controls.text +
         acceleration->text;
}

}  // namespace kpsa::engine
