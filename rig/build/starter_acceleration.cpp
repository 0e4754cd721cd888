#include "rig/build/starter_acceleration.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "base/text.h"
#include "rig/build/starter_text.h"
#include "rig/build/starter_training.h"

namespace kpsa::engine {
namespace {

void Remark(StarterAcceleration* out, const char* sentence) {
  out->remark = sentence;
  out->text += fmt::format("\n# No accelerate section: {}.\n", sentence);
}

std::string LengthOf(double metres) {
  if (metres >= 1) return Rounded(metres) + "m";
  return metres >= 0.01 ? Rounded(metres * 100) + "cm" : Rounded(metres * 1000) + "mm";
}

// The parts of a clip as clips of the rig, added to what trains and tests.
void WriteParts(const StarterCharacter& in, const StarterTraining& training, std::vector<std::string>* train,
                std::vector<std::string>* test, std::string* text) {
  if (training.parts.empty()) return;
  *text += fmt::format(
      "\n# {} alone moves the points: parts of it train and others test, with gaps in between, as "
      "neighbouring\n"
      "# frames are nearly the same.\n"
      "clips:\n",
      InComment(training.cut));
  for (const ClipPart& part : training.parts) {
    std::vector<std::string>* list = part.test ? test : train;
    std::string name;
    for (int i = 1; name.empty() || in.character.FindClip(name) != kNoIndex ||
                    std::find(list->begin(), list->end(), name) != list->end();
         ++i) {
      name = fmt::format("{}_{}{}", training.cut, part.test ? "test" : "train", i);
    }
    list->push_back(name);
    *text += fmt::format("  {}: {{layers: [{{clip: {}}}], frames: [{}, {}]}}\n", Quoted(name, false),
                         Quoted(training.cut, true), part.first, part.last);
  }
}

std::string ToleranceText(const StarterCharacter& in, const StarterTraining& training) {
  const double by_size = kToleranceOfSize * in.rig.rest_diagonal,
               by_motion = kToleranceOfMotion * training.motion;
  const auto about = [](double metres) {
    const double unit = metres > 0 ? std::pow(10.0, std::floor(std::log10(metres)) - 2) : 1;
    return LengthOf(std::round(metres / unit) * unit);
  };
  const std::string from =
      training.motion > 0 && by_motion < by_size
          ? fmt::format("{:.3g} % of how far {} move what moves most (RMS {})", kToleranceOfMotion * 100,
                        training.by_clips ? "the clips" : "controls", about(training.motion))
          : fmt::format("{:.3g} % of the size ({})", kToleranceOfSize * 100, about(in.rig.rest_diagonal));
  return fmt::format("    tolerance: {}  # the largest error of a point that is accepted: {}, rounded\n",
                     LengthOf(StarterTolerance(in.rig.rest_diagonal, training.motion)), from) +
         "    # kpsa bench says which tolerance would hit how often, and how fast that is\n";
}

}  // namespace

Result<StarterAcceleration> WriteAcceleration(const StarterCharacter& in, const StarterControls& controls,
                                              const std::string& mush, const StarterOptions& options,
                                              Rig* rig) {
  StarterAcceleration out;
  if (in.rig.scene.meshes.empty()) return out;
  if (controls.controls.empty()) {
    Remark(&out,
           "nothing of it moves, no clip, joint or morph target, so that there is nothing to accelerate");
    return out;
  }
  const std::optional<NodeId> space = in.Space();
  const Result<StarterTraining> training = ChooseTraining(rig, space, in.clips, controls.controls);
  if (!training.ok()) return training.status();
  if (!training->deforms) {
    Remark(&out, "it only moves as a whole and never deforms, so that there is nothing to accelerate");
    return out;
  }
  out.accelerates = true;
  std::vector<std::string> train = training->train, test = training->test;
  WriteParts(in, *training, &train, &test, &out.text);
  const std::string stem = std::filesystem::path(in.character.path).stem().string();
  std::vector<std::string> points;
  for (const std::size_t m : ShownMeshes(in.rig.scene))
    points.push_back(in.rig.scene.meshes[m].name + "@" + mush);
  out.text += fmt::format(
      "\n# What kpsa train learns and kpsa bench measures. More clips and wider controls make it hold for "
      "more "
      "poses.\n"
      "accelerate:\n  {}:\n",
      Quoted(stem.empty() ? "character" : stem, false));
  out.text += fmt::format("    points: {}  # up to and including that stage; later stages run exactly\n",
                          QuotedList(points));
  if (space.has_value()) {
    out.text +=
        fmt::format("    space: {}  # what carries nearly all points; motion in its space is learned\n",
                    Quoted(in.rig.graph->name(*space), false));
  }
  out.text += fmt::format("    subspace: {}  # kpsa train writes it\n",
                          Quoted(options.subspace.empty() ? stem + ".kpsa" : options.subspace, false));
  out.text += ToleranceText(in, *training);
  out.text += "    violationRate: 3%  # of frames that may exceed it\n";
  const int samples = options.samples.value_or(StarterSamples(controls.controls.size(), training->frames));
  out.text += fmt::format("    train: {{{}samples: {}}}  # clips, and poses drawn from {} control{}\n",
                          train.empty() ? "" : "clips: " + QuotedList(train) + ", ", samples,
                          Thousands(controls.controls.size()), controls.controls.size() == 1 ? "" : "s");
  if (!training->still.empty())
    out.text += fmt::format("    # Clips that move no point, and train nothing: {}\n",
                            InComment(fmt::format("{}", fmt::join(training->still, ", "))));
  if (test.empty()) {
    out.remark = "no clip moves its points: controls alone train it, and kpsa bench has the rest pose only";
    out.text +=
        "    # No clip moves the points, so that there is none to test on; kpsa bench takes the rest "
        "pose\n";
    return out;
  }
  const char* why = !training->parts.empty() ? ""
                    : train.empty()          ? ": the only one that moves the points, and short"
                                             : ": of those that move the points well, the one that goes "
                                               "least beyond the others";
  out.text += fmt::format("    test: {{clips: {}}}  # never trained on; what kpsa bench runs{}\n",
                          QuotedList(test), why);
  return out;
}

}  // namespace kpsa::engine
