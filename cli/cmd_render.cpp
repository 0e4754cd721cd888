// kpsa render: pictures of a rig's meshes.
#include <algorithm>
#include <cmath>
#include <memory>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/png.h"
#include "kpsa/kpsa_node.h"
#include "picture/camera_picture.h"
#include "picture/rig_picture.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxPictures = 24;

struct RenderFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> size, azimuth, elevation, turntable, error_scale, camera, exposure, layer,
      shrink;
};

struct View {
  RenderOptions options;
  double azimuth = 0.45, elevation = 0.12;  // radians
  int turntable = 0;                        // pictures all around; 0: none
  std::optional<double> error_scale;        // metres at the top of the heat map
};

Result<View> ReadView(const RenderFlags& flags) {
  View view;
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
  for (const auto& [what, text, to] : {std::tuple{"--azimuth", &flags.azimuth, &view.azimuth},
                                       std::tuple{"--elevation", &flags.elevation, &view.elevation}}) {
    if (!text->has_value()) continue;
    const Result<double> degrees = ParseNumber(what, **text);
    if (!degrees.ok()) return degrees.status();
    if (std::abs(*degrees) > 360)
      return Status::Usage("{} {}: expected degrees from -360 to 360", what, **text);
    *to = *degrees * kDegree;
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

CommandResult WritePicture(const RenderFlags& flags, const Image& picture) {
  KPSA_RETURN_IF_ERROR(WritePng(*flags.output, flags.force, picture.width, picture.height, picture.rgb));
  if (!flags.quiet) Say(fmt::format("{}: {} x {}", *flags.output, picture.width, picture.height));
  return 0;
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
                                                            : nullptr;
  if (given != nullptr)
    return Status::Usage("{} is of no use with --camera, which says how a picture is taken", given);
  return Status();
}

// What the scale of an error goes by: the tolerance in force, or the trained one where any error may pass;
// above 0, as errors are divided by it.
double ShownTolerance(const AppliedSubspace& applied) {
  return std::max(applied.tolerance < kAnyError ? applied.tolerance : applied.subspace->tolerance, 1e-7);
}

// Pictures through a camera of the rig, six in a row.
Result<std::vector<Image>> CameraRows(Rig& rig, Compiler* compiler, const RenderFlags& flags,
                                      const std::vector<double>& times, const RigFrameOptions& options) {
  const Result<CameraView> view = FindCamera(rig, *flags.camera);
  if (!view.ok()) return Status(view.status()).At({"--camera " + *flags.camera});
  double exposure = 1;
  if (flags.exposure.has_value()) {
    const Result<double> read = ParseNumber("--exposure", *flags.exposure);
    if (!read.ok()) return read.status();
    if (!(*read > 0)) return Status::Usage("--exposure {}: expected a factor above 0", *flags.exposure);
    exposure = *read;
  }
  CameraLayer layer = CameraLayer::kAll;
  if (flags.layer.has_value()) {
    if (*flags.layer != "all" && *flags.layer != "direct" && *flags.layer != "indirect")
      return Status::Usage("--layer {}: expected all, direct or indirect", *flags.layer);
    layer = *flags.layer == "direct"     ? CameraLayer::kDirect
            : *flags.layer == "indirect" ? CameraLayer::kIndirect
                                         : layer;
  }
  int shrink = 1;
  if (flags.shrink.has_value()) {
    const auto least = static_cast<int>(std::min(view->width, view->height));
    const Result<int> times = ParseCount("--shrink", *flags.shrink, 1, least);
    if (!times.ok()) return times.status();
    shrink = *times;
  }
  const Result<std::vector<CameraImage>> full = EvaluateCamera(rig, compiler, *view, times, options);
  if (!full.ok()) return full.status();
  std::vector<Image> rows, row;
  if (flags.acceleration.wanted()) {
    const Result<std::vector<AppliedSubspace>> applied =
        ApplyAcceleration(&rig, compiler, flags.acceleration);
    if (!applied.ok()) return applied.status();
    Verdicts verdicts(*applied);
    const Result<std::vector<CameraImage>> fast =
        EvaluateCamera(rig, compiler, AcceleratedView(*view, rig, *applied), times, options, &verdicts);
    if (!fast.ok()) return fast.status();
    for (std::size_t f = 0; f < times.size(); ++f) {
      const double error_max = 4 * ShownTolerance(applied->front());
      Image error = LightError((*full)[f], (*fast)[f], error_max);
      std::vector<Image> three = {Develop((*full)[f], exposure, layer), Develop((*fast)[f], exposure, layer),
                                  std::move(error)};
      for (Image& image : three) image = Shrunk(image, shrink);
      DrawTitle(three[0], "full"), DrawTitle(three[1], PictureTitle(verdicts.records()[f].decision));
      DrawTitle(three[2], fmt::format("error, 0 .. {:.3g}", error_max));
      rows.push_back(SideBySide(three));
    }
    return rows;
  }
  for (const CameraImage& picture : *full) {
    row.push_back(Shrunk(Develop(picture, exposure, layer), shrink));
    if (row.size() == 6) rows.push_back(SideBySide(row)), row.clear();
  }
  if (!row.empty()) rows.push_back(SideBySide(row));
  return rows;
}

CommandResult Render(const RenderFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  KPSA_RETURN_IF_ERROR(CheckCameraFlags(flags));
  const Result<View> view = ReadView(flags);
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
  Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  const bool chosen = flags.frames.has_value() || flags.times.has_value();
  if (!chosen && !flags.acceleration.wanted()) *times = {(*times)[times->size() / 2]};
  const std::size_t most = view->turntable > 0 ? 1 : flags.acceleration.wanted() ? 8 : kMaxPictures;
  if (chosen && times->size() > most)
    return Status::Usage("{} frames are more than the {} of one picture", times->size(), most);

  const InterruptScope interruptible;
  RigFrameOptions frame_options;
  frame_options.threads = *threads;
  frame_options.watch = InterruptWatch();
  Compiler compiler;
  if (flags.camera.has_value()) {
    const Result<std::vector<Image>> taken = CameraRows(rig, &compiler, flags, *times, frame_options);
    if (!taken.ok()) return taken.status();
    return WritePicture(flags, StackRows(*taken));
  }
  Result<std::vector<Pose>> full = EvaluatePoses(rig, &compiler, *times, frame_options);
  if (!full.ok()) return full.status();
  std::vector<Image> rows;
  const auto add = [&](Result<Image> image) -> Status {
    if (!image.ok()) return image.status();
    rows.push_back(std::move(*image));
    return Interrupted() ? InterruptedStatus() : Status();
  };
  if (flags.acceleration.wanted()) {
    const Result<std::vector<AppliedSubspace>> applied =
        ApplyAcceleration(&rig, &compiler, flags.acceleration);
    if (!applied.ok()) return applied.status();
    Verdicts verdicts(*applied);
    Result<std::vector<Pose>> fast = EvaluatePoses(rig, &compiler, *times, frame_options, &verdicts);
    if (!fast.ok()) return fast.status();
    std::vector<std::size_t> frames(times->size());
    std::size_t worst = 0;
    for (std::size_t f = 0; f < frames.size(); ++f) {
      frames[f] = f;
      if (WorstDistance((*full)[f], (*fast)[f]) > WorstDistance((*full)[worst], (*fast)[worst])) worst = f;
    }
    if (!chosen) frames = {worst};
    const Camera camera = FramePoses(rig, chosen ? *full : std::vector<Pose>{(*full)[worst]}, view->options,
                                     view->azimuth, view->elevation);
    for (std::size_t f : frames) {
      RenderInput exact = MakeInput(rig, (*full)[f]), emitted = MakeInput(rig, (*fast)[f]);
      exact.scalar_max = emitted.scalar_max = view->error_scale.value_or(ShownTolerance(applied->front()));
      const RenderDots dots = KeyPoints(*applied, (*full)[f]);
      KPSA_RETURN_IF_ERROR(add(RenderComparison(exact, emitted, camera, view->options, &dots,
                                                PictureTitle(verdicts.records()[f].decision))));
    }
    if (!flags.quiet && !chosen)
      Say(fmt::format("the frame with the largest error, at {:.4g} s: {}", (*times)[worst],
                      LengthText(WorstDistance((*full)[worst], (*fast)[worst]))));
  } else if (view->turntable > 0) {
    const Result<std::vector<Image>> images =
        RenderTurntable(MakeInput(rig, full->front()), view->turntable, view->elevation, view->options);
    if (!images.ok()) return images.status();
    rows.push_back(SideBySide(*images));
  } else {
    const Camera camera = FramePoses(rig, *full, view->options, view->azimuth, view->elevation);
    std::vector<Image> row;
    for (const Pose& pose : *full) {
      Result<Image> image = RenderMesh(MakeInput(rig, pose), camera, view->options);
      if (!image.ok()) return image.status();
      if (Interrupted()) return InterruptedStatus();
      row.push_back(std::move(*image));
      if (row.size() == 6) rows.push_back(SideBySide(row)), row.clear();
    }
    if (!row.empty()) rows.push_back(SideBySide(row));
  }
  return WritePicture(flags, StackRows(rows));
}

}  // namespace

void AddRenderCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<RenderFlags>();
  CLI::App* command =
      AddCommand(program, "render", "Pictures: full, or full, key points, accelerated and error side by side",
                 "The middle of the clip, or with a subspace the frame with the largest error, unless "
                 "--frames or --times choose.\n"
                 "Examples:\n"
                 "  kpsa render head.glb --clip face_talk --frames 0:120:24 -o talk.png\n"
                 "  kpsa render head.yaml --accelerate -o error.png\n"
                 "  kpsa render head.yaml --rest --turntable 8 -o around.png\n"
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
  AddOption(command, "--turntable", "N", &flags->turntable, "N pictures from all around");
  AddOption(command, "--error-scale", "LENGTH", &flags->error_scale,
            "error at the top of the heat map; the tolerance if not given");
  AddOption(command, "--camera", "NAME", &flags->camera,
            "a camera of the rig: direct light from its lights, and what its indirectIllumination says");
  AddOption(command, "--exposure", "FACTOR", &flags->exposure, "of a camera's picture; 1 if not given");
  AddOption(command, "--layer", "all|direct|indirect", &flags->layer,
            "of a camera's picture; all if not given");
  AddOption(command, "--shrink", "N", &flags->shrink,
            "a camera's picture N times smaller: each pixel is the mean of N x N");
  AddThreadsFlag(command, flags.get());
  AddQuietFlag(command, flags.get());
}

}  // namespace kpsa::engine
