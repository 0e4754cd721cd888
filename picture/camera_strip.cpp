#include "picture/camera_strip.h"

#include "picture/caption.h"
#include "picture/rig_picture.h"
#include "picture/strips.h"

namespace kpsa::engine {

Result<std::vector<Image>> DrawCameraStrip(Rig* rig, Compiler* compiler, const CameraTake& take,
                                           const std::optional<AccelerationChoice>& acceleration,
                                           const std::vector<double>& times, const RigFrameOptions& options) {
  const Result<std::vector<CameraImage>> full = EvaluateCamera(*rig, compiler, take.view, times, options);
  if (!full.ok()) return full.status();
  const auto develop = [&](const CameraImage& image) {
    return Shrunk(Develop(image, take.exposure, take.layer), take.shrink);
  };
  std::vector<Image> images;
  if (!acceleration.has_value()) {
    for (std::size_t f = 0; f < times.size(); ++f) {
      images.push_back(develop((*full)[f]));
      DrawCaption(images.back(), Captions(*rig, times[f]));
    }
    return InRows(images);
  }
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(rig, compiler, *acceleration);
  if (!applied.ok()) return applied.status();
  Verdicts verdicts(*applied);
  const Result<std::vector<CameraImage>> fast =
      EvaluateCamera(*rig, compiler, AcceleratedView(take.view, *rig, *applied), times, options, &verdicts);
  if (!fast.ok()) return fast.status();
  const double tolerance = ShownTolerance(applied->front()), error_max = 4 * tolerance;
  for (std::size_t f = 0; f < times.size(); ++f) {
    const FrameDecision& decision = verdicts.records()[f].decision;
    std::vector<Image> row = {develop((*full)[f]), develop((*fast)[f]),
                              Shrunk(LightError((*full)[f], (*fast)[f], error_max), take.shrink)};
    DrawTitle(row[0], "full"), DrawTitle(row[1], PictureTitle(decision)), DrawTitle(row[2], "error");
    row.push_back(LegendPanel(row[0].height, {error_max, tolerance, false}));
    images.push_back(SideBySide(row));
    DrawCaption(images.back(), Captions(*rig, times[f], VerdictWord(decision)));
  }
  return images;
}

}  // namespace kpsa::engine
