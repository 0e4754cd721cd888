#include "kpsa/calibration_file.h"

#include <algorithm>
#include <cmath>

#include "kpsa/pose_kind.h"
#include "kpsa/subspace_tensors.h"

namespace kpsa::engine {
namespace {

constexpr char kNearClips[] = "calibrationNearClips";  // only where there are some
// What each patch costs, and what calibration says of patches.
constexpr char kPatchCosts[] = "patchCosts", kMiddles[] = "calibrationMiddles",
               kPatchCounts[] = "calibrationPatchCounts", kPatchPairs[] = "calibrationPatches",
               kPatchGuards[] = "calibrationPatchGuards";  // only where there are some

Status ReadPatches(const SafetensorsFile& file, Subspace* s) {
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  const std::size_t tiles = s->patches.tiles;
  const double share = s->patches.share;
  const bool blends_only = s->patches.blends_only;
  s->patches = MakePatchLayout(s->tiles_of_outputs());
  if (s->patches.tiles != tiles)
    return Status::Invalid("patches of {} tiles, expected {}", tiles, s->patches.tiles);
  s->patches.share = share;
  s->patches.blends_only = blends_only;
  KPSA_RETURN_IF_ERROR(Assign(file.Values<double>(kPatchCosts, {kAny}), &s->patches.costs));
  const Result<std::vector<double>> middles = file.Values<double>(kMiddles, {s->calibration.size()}),
                                    pairs = file.Values<double>(kPatchPairs, {kAny, 2});
  const Result<std::vector<std::uint32_t>> counts =
      file.Values<std::uint32_t>(kPatchCounts, {s->calibration.size()});
  for (const Status& status : {middles.status(), pairs.status(), counts.status()})
    KPSA_RETURN_IF_ERROR(status);
  std::vector<double> guards(pairs->size() / 2);
  if (file.tensors().contains(kPatchGuards))
    KPSA_RETURN_IF_ERROR(Assign(file.Values<double>(kPatchGuards, {pairs->size() / 2}), &guards));
  std::size_t next = 0;
  for (std::size_t i = 0; i < s->calibration.size(); ++i) {
    CalibrationPair& pair = s->calibration[i];
    pair.middle = (*middles)[i];
    pair.blends_only = blends_only;
    if ((*counts)[i] > kMaxPatches || next + (*counts)[i] > pairs->size() / 2)
      return Status::Invalid("calibration pose {} has {} patches", i, (*counts)[i]);
    pair.patches.reserve((*counts)[i]);
    for (std::size_t p = 0; p < (*counts)[i]; ++p, ++next)
      pair.patches.push_back({(*pairs)[2 * next], (*pairs)[2 * next + 1], guards[next]});
  }
  if (next != pairs->size() / 2)
    return Status::Invalid("{} patches of calibration poses belong to none", pairs->size() / 2 - next);
  return {};
}

void AddPatches(const Subspace& s, SafetensorsWriter* writer) {
  std::vector<double> middles, pairs, guards;
  std::vector<std::uint32_t> counts;
  for (const CalibrationPair& pair : s.calibration) {
    middles.push_back(pair.middle);
    counts.push_back(static_cast<std::uint32_t>(pair.patches.size()));
    for (const PatchPair& patch : pair.patches) {
      pairs.insert(pairs.end(), {patch.score, patch.error});
      guards.push_back(patch.guard);
    }
  }
  Add<double>(writer, kPatchCosts, s.patches.costs);
  Add<double>(writer, kMiddles, middles);
  Add<std::uint32_t>(writer, kPatchCounts, counts);
  writer->Add<double>(kPatchPairs, {pairs.size() / 2, 2}, pairs);
  if (std::ranges::any_of(guards, [](double guard) { return guard > 0; }))
    Add<double>(writer, kPatchGuards, guards);
}

}  // namespace

bool AnyNearClips(const Subspace& s) {
  return std::ranges::any_of(s.calibration, &CalibrationPair::near_clips);
}

Status ReadCalibration(const SafetensorsFile& file, Subspace* s) {
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  const Result<std::vector<double>> calibration = file.Values<double>("calibration", {kAny, 4});
  if (!calibration.ok()) return calibration.status();
  s->calibration.reserve(calibration->size() / 4);
  for (std::size_t i = 0; i + 3 < calibration->size(); i += 4) {
    const std::span<const double> row(calibration->data() + i, 4);
    const bool known = row[3] >= 0 && row[3] < kPoseKinds && row[3] == std::floor(row[3]);
    const int kind = known ? static_cast<int>(row[3]) : -1;  // refused below
    s->calibration.push_back({row[0], row[1], row[2], kind});
  }
  if (file.tensors().contains(kNearClips)) {
    const Result<std::vector<std::uint8_t>> near_clips =
        file.Values<std::uint8_t>(kNearClips, {s->calibration.size()});
    if (!near_clips.ok()) return near_clips.status();
    for (std::size_t i = 0; i < near_clips->size(); ++i) {
      const std::uint8_t flag = (*near_clips)[i];
      if (flag > 1 || (flag == 1 && s->calibration[i].kind != static_cast<int>(PoseKind::kSampled)))
        return Status::Invalid("calibration pose {} cannot be near clips ({})", i, flag);
      s->calibration[i].near_clips = flag == 1;
    }
  }
  return s->patches.tiles > 0 ? ReadPatches(file, s) : Status();
}

void AddCalibration(const Subspace& s, SafetensorsWriter* writer) {
  std::vector<double> calibration;
  for (const CalibrationPair& pair : s.calibration)
    calibration.insert(calibration.end(),
                       {pair.score, pair.error, pair.guard, static_cast<double>(pair.kind)});
  writer->Add<double>("calibration", {s.calibration.size(), 4}, calibration);
  if (AnyNearClips(s)) {
    std::vector<std::uint8_t> near_clips;
    for (const CalibrationPair& pair : s.calibration) near_clips.push_back(pair.near_clips);
    Add<std::uint8_t>(writer, kNearClips, near_clips);
  }
  if (s.patches.tiles > 0) AddPatches(s, writer);
}

void HashCalibration(const Subspace& s, Hasher* hasher) {
  const bool near_clips = AnyNearClips(s);
  for (const CalibrationPair& pair : s.calibration) {
    if (near_clips) hasher->Add(static_cast<std::uint8_t>(pair.near_clips));
    hasher->Add(pair.score);
    hasher->Add(pair.error);
    hasher->Add(pair.guard);
    hasher->Add(pair.kind);
    if (s.patches.tiles == 0) continue;
    hasher->Add(pair.middle);
    for (const PatchPair& patch : pair.patches) {
      hasher->Add(patch.score);
      hasher->Add(patch.error);
      if (patch.guard > 0) hasher->Add(patch.guard);
    }
  }
  if (s.patches.tiles > 0) hasher->Add(std::span<const double>(s.patches.costs));
}

}  // namespace kpsa::engine
