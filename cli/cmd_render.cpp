// kpsa render: pictures of a rig's meshes.
#include <algorithm>
#include <cmath>
#include <memory>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/png.h"
#include "picture/camera_strip.h"
#include "picture/strips.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxPictures = 24;

struct RenderFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> size, azimuth, elevation, turntable, error_scale, camera, exposure, layer,
      shrink, look_at, zoom, fit;
  bool no_textures = false;
  std::vector<std::string> meshes;
};

// A number above `least`, and at most `most`.
Result<double> ParseFactor(const char* what, const std::string& text, double least, double most) {
  const Result<double> read = ParseNumber(what, text);
  if (!read.ok()) return read.status();
  if (!(*read > least)) return Status::Usage("{} {}: expected a factor above {}", what, text, least);
  if (*read > most) return Status::Usage("{} {}: expected a factor of at most {}", what, text, most);
  return *read;
}

Result<StripView> ReadView(const RenderFlags& flags) {
  StripView view;
  view.meshes = flags.meshes;
  view.textures = !flags.no_textures;
  view.framing.fit = flags.fit;
  if (flags.size.has_value()) {
    const std::size_t x = flags.size->find('x');
    if (x == std::string::npos)
      return Status::Usage("--size \"{}\": expected WIDTHxHEIGHT, as in 480x600", *flags.size);
    const Result<int> width = ParseCount("--size", flags.size->substr(0, x), 16, 4096),
                      height = ParseCount("--size", flags.size->substr(x + 1), 16, 4096);
    if (!width.ok()) return width.status();
    if (!height.ok()) return height.status();
    view.options.width = *width, view.options.height = *height;
  }
  constexpr double kDegree = 3.14159265358979323846 / 180;
  for (const auto& [what, text, to] :
       {std::tuple{"--azimuth", &flags.azimuth, &view.framing.azimuth},
        std::tuple{"--elevation", &flags.elevation, &view.framing.elevation}}) {
    if (!text->has_value()) continue;
    const Result<double> degrees = ParseNumber(what, **text);
    if (!degrees.ok()) return degrees.status();
    if (std::abs(*degrees) > 360)
      return Status::Usage("{} {}: expected degrees from -360 to 360", what, **text);
    *to = *degrees * kDegree;
  }
  if (flags.look_at.has_value()) {
    const Result<Double3> place = ParsePlace("--look-at", *flags.look_at);
    if (!place.ok()) return place.status();
    view.framing.look_at = *place;
  }
  if (flags.zoom.has_value()) {
    const Result<double> zoom = ParseFactor("--zoom", *flags.zoom, 0, 1000);
    if (!zoom.ok()) return zoom.status();
    view.framing.zoom = *zoom;
  }
  if (flags.turntable.has_value()) {
    const Result<int> count = ParseCount("--turntable", *flags.turntable, 2, kMaxPictures);
    if (!count.ok()) return count.status();
    view.turntable = *count;
  }
  if (flags.error_scale.has_value()) {
    const Result<double> scale = ParseLength("--error-scale", *flags.error_scale);
    if (!scale.ok() || !(*scale > 0))
      return Status::Usage("--error-scale \"{}\": expected a length above 0, as in 1mm", *flags.error_scale);
    view.error_scale = *scale;
  }
  return view;
}

// What only one of the two ways of taking pictures knows.
Status CheckCameraFlags(const RenderFlags& flags) {
  if (!flags.camera.has_value()) {
    const char* const given = flags.exposure.has_value() ? "--exposure"
                              : flags.layer.has_value()  ? "--layer"
                              : flags.shrink.has_value() ? "--shrink"
                                                         : nullptr;
    if (given != nullptr) return Status::Usage("{} is of no use without --camera", given);
    return Status();
  }
  const char* const given = flags.size.has_value()          ? "--size"
                            : flags.azimuth.has_value()     ? "--azimuth"
                            : flags.elevation.has_value()   ? "--elevation"
                            : flags.turntable.has_value()   ? "--turntable"
                            : flags.error_scale.has_value() ? "--error-scale"
                            : flags.look_at.has_value()     ? "--look-at"
                            : flags.zoom.has_value()        ? "--zoom"
                            : flags.fit.has_value()         ? "--fit"
                            : !flags.meshes.empty()         ? "--mesh"
                                                            : nullptr;
  if (given != nullptr)
    return Status::Usage("{} is of no use with --camera, which says how a picture is taken", given);
  return Status();
}

// How a picture is taken through a camera of the rig.
Result<CameraTake> ReadTake(const Rig& rig, const RenderFlags& flags, std::vector<std::string>* notes) {
  CameraTake take;
  Result<CameraView> view = FindCamera(rig, *flags.camera);
  if (!view.ok()) return Status(view.status()).At({"--camera " + *flags.camera});
  take.view = std::move(*view);
  take.view.look = std::make_shared<const RigLook>(LookOf(rig, take.view.meshes, !flags.no_textures, notes));
  if (flags.exposure.has_value()) {
    const Result<double> read = ParseFactor("--exposure", *flags.exposure, 0, 1e30);
    if (!read.ok()) return read.status();
    take.exposure = *read;
  }
  if (flags.layer.has_value()) {
    if (*flags.layer != "all" && *flags.layer != "direct" && *flags.layer != "indirect")
      return Status::Usage("--layer {}: expected all, direct or indirect", *flags.layer);
    take.layer = *flags.layer == "direct"     ? CameraLayer::kDirect
                 : *flags.layer == "indirect" ? CameraLayer::kIndirect
                                              : CameraLayer::kAll;
  }
  if (flags.shrink.has_value()) {
    const auto least = static_cast<int>(std::min(take.view.width, take.view.height));
    const Result<int> times = ParseCount("--shrink", *flags.shrink, 1, least);
    if (!times.ok()) return times.status();
    take.shrink = *times;
  }
  return take;
}

CommandResult Render(const RenderFlags& flags) {
  const bool accelerated = flags.acceleration.wanted();
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, accelerated));
  KPSA_RETURN_IF_ERROR(CheckCameraFlags(flags));
  const Result<StripView> view = ReadView(flags);
  if (!view.ok()) return view.status();
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  if (!flags.output.has_value() || *flags.output == "-")
    return Status::Usage("expected -o with a name that ends in .png");
  KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".png"}));
  const ThreadLimit limit(*threads);
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  if (accelerated && !flags.clip.has_value() && !flags.rest && !(*open)->pose_time.has_value())
    KPSA_RETURN_IF_ERROR(PlayTestClip(&rig));
  Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  const bool chosen = flags.frames.has_value() || flags.times.has_value();
  const bool worst = !chosen && accelerated && !flags.camera.has_value();
  if (!chosen && !worst) *times = {(*times)[times->size() / 2]};
  const std::size_t most = view->turntable > 0 ? 1 : accelerated ? 8 : kMaxPictures;
  if (chosen && times->size() > most)
    return Status::Usage("{} frames are more than the {} of one picture", times->size(), most);

  const InterruptScope interruptible;
  RigFrameOptions options;
  options.threads = *threads;
  options.watch = InterruptWatch();
  Compiler compiler;
  std::optional<AccelerationChoice> choice;
  if (accelerated) choice = ChoiceOf(flags.acceleration);
  std::vector<std::string> notes;
  Result<std::vector<Image>> rows = std::vector<Image>();
  if (flags.camera.has_value()) {
    const Result<CameraTake> take = ReadTake(rig, flags, &notes);
    if (!take.ok()) return take.status();
    rows = DrawCameraStrip(&rig, &compiler, *take, choice, *times, options);
  } else if (accelerated) {
    Result<ComparedFrames> compared =
        CompareFrames(&rig, &compiler, *choice, *times, !worst, *view, options, &notes);
    if (!compared.ok()) return compared.status();
    if (worst && !flags.quiet)
      Say(fmt::format("the frame with the largest error, at {:.4g} s: {}", (*times)[compared->worst],
                      LengthText(compared->error)));
    rows = std::move(compared->rows);
  } else {
    rows = DrawStrip(rig, &compiler, *times, *view, options, &notes);
  }
  if (!rows.ok()) return rows.status();
  if (Interrupted()) return InterruptedStatus();
  const Image picture = StackRows(*rows);
  KPSA_RETURN_IF_ERROR(WritePng(*flags.output, flags.force, picture.width, picture.height, picture.rgb));
  constexpr std::size_t kMostNotes = 20;
  for (std::size_t i = 0; i < std::min(notes.size(), kMostNotes) && !flags.quiet; ++i)
    Say("warning: " + notes[i]);
  if (notes.size() > kMostNotes && !flags.quiet)
    Say(fmt::format("warning: ... and {} more", notes.size() - kMostNotes));
  if (!flags.quiet) Say(fmt::format("{}: {} x {}", *flags.output, picture.width, picture.height));
  return 0;
}

}  // namespace

void AddRenderCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<RenderFlags>();
  CLI::App* command =
      AddCommand(program, "render", "Pictures: full, or full, key points, accelerated and error side by side",
                 "The middle of the clip, or with a subspace the frame of the test clip with the largest "
                 "error, unless --frames or --times choose.\n"
                 "Examples:\n"
                 "  kpsa render head.glb --clip face_talk --frames 0:120:24 -o talk.png\n"
                 "  kpsa render head.yaml --accelerate -o error.png\n"
                 "  kpsa render head.yaml --rest --turntable 8 -o around.png\n"
                 "  kpsa render human.glb --fit face --zoom 0.8 -o face.png\n"
                 "  kpsa render room.yaml --camera front -o room.png",
                 chosen, [flags] { return Render(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddOutputFlags(command, flags.get(), "the picture, .png");
  AddAccelerationFlags(command, &flags->acceleration);
  AddOption(command, "--size", "WxH", &flags->size, "of one picture, pixels; 480x600 if not given");
  AddOption(command, "--azimuth", "DEG", &flags->azimuth,
            "of the camera: 0 from the front, positive to the character's left");
  AddOption(command, "--elevation", "DEG", &flags->elevation, "of the camera above the horizon");
  AddRepeated(command, "--mesh", "NAME", &flags->meshes,
              "a mesh that is drawn, instead of all that are shown; may be repeated");
  AddOption(command, "--fit", "face|NAME", &flags->fit,
            "fill the picture with the face, or with what a joint moves, a material covers or a mesh is");
  AddOption(command, "--look-at", "X,Y,Z", &flags->look_at, "the middle of the picture, metres");
  AddOption(command, "--zoom", "FACTOR", &flags->zoom, "larger (2) or smaller (0.5); 1 if not given");
  AddSwitch(command, "--no-textures", &flags->no_textures, "base colours alone, without their textures");
  AddOption(command, "--turntable", "N", &flags->turntable, "N pictures from all around");
  AddOption(command, "--error-scale", "LENGTH", &flags->error_scale,
            "error at the top of the heat map; the tolerance if not given");
  AddOption(
      command, "--camera", "NAME", &flags->camera,
      "a camera of the rig: direct light from its lights (one at the camera where it has none), and what its "
      "indirectIllumination says");
  AddOption(command, "--exposure", "FACTOR", &flags->exposure, "of a camera's picture; 1 if not given");
  AddOption(command, "--layer", "all|direct|indirect", &flags->layer,
            "of a camera's picture; all if not given");
  AddOption(command, "--shrink", "N", &flags->shrink,
            "a camera's picture N times smaller: each pixel is the mean of N x N");
  AddThreadsFlag(command, flags.get());
  AddQuietFlag(command, flags.get());
}

}  // namespace kpsa::engine
