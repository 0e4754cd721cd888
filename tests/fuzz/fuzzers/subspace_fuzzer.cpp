// Trained subspaces. A file's digest would end all but the first step: it is mended here, so that what the numbers lead
// to is reached: frames are measured, judged and reconstructed.
#include <cmath>

#include "files/safetensors.h"
#include "kpsa/subspace.h"
#include "kpsa/subspace_digest.h"
#include "tests/fuzz/fuzzer.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostPoints = 200'000;

// Poses of all kinds, as cues measure them. Who judges a miss that is not finite reconstructs nothing.
void Use(const Subspace& s) {
  std::size_t points = 0;
  for (const SubspaceOutput& output : s.outputs) points += output.points;
  if (points > kMostPoints || s.rows() > 4096) return;
  SubspaceScratch scratch(s);
  std::vector<float> doubts(s.tile_count());
  std::vector<double> scores(s.patches.patches);
  SoftCacheThreshold threshold;
  threshold.tau = 1;
  for (const double amount : {0.0, 1.0, -3.0, 1e30, HUGE_VAL}) {
    std::vector<double> raw(s.rows());
    for (std::size_t j = 0; j < raw.size(); ++j) raw[j] = s.cue_mean[j] + amount * static_cast<double>(j % 3);
    Measure(s, raw, &scratch);
    const Verdict verdict = Judge(s, threshold, &scratch);
    Require(verdict.full_weight >= 0 && verdict.full_weight <= 1, "a share that is none");
    if (verdict.hit) Reached("hit");
    if (s.doubt_inputs() > 0) Reached("products");
    if (s.patches.tiles > 0) Reached("patches");
    if (s.of_inner()) Reached("inner points");
    if (s.of_inner() && !s.outputs[0].stepped.empty())
      Reached(s.outputs[0].stepped.starts.empty() ? "inner points of some tiles"
                                                  : "inner points of some points");
    for (const TileMend& mend : s.mends) {
      Matrix4 joint;
      (void)s.tiles[mend.output].JointOf(mend.tile, scratch.y.data(), &joint);
      Reached("mends");
    }
    if (s.patches.tiles > 0)
      (void)JudgePatches(s, threshold, scratch.y.span(), scratch.g.span(), scratch.t.span(), doubts, scores);
    if (verdict.reason == MissReason::kNotFinite) continue;
    for (std::size_t output = 0; output < s.outputs.size(); ++output) {
      PointBuffer buffer(s.outputs[output].reconstructed(), s.components);
      s.tiles[output].Reconstruct(scratch.inputs(), buffer.view());
    }
  }
}

}  // namespace

KPSA_FUZZER(subspace) {
  const auto* begin = reinterpret_cast<const std::byte*>(bytes.data());
  const Result<SafetensorsFile> file = SafetensorsFile::Parse(std::span(begin, bytes.size()), "fuzzed");
  if (!file.ok()) return RequireRefusal(file.status());
  const Result<Subspace> content = SubspaceContent(*file, KeptModes::kRead);
  if (!content.ok()) return RequireRefusal(content.status());
  Reached("content");
  // Written again it has the digests of what it says; it reads back as that, and has the same bytes from then on
  const std::string path = FuzzedFile("fuzzed.kpsa", {}), again = FuzzedFile("again.kpsa", {});
  const Status written = WriteSubspace(*content, path);
  Require(written.ok(), "what was read cannot be written: " + written.ToString());
  const Result<Subspace> mended = ReadSubspace(path, KeptModes::kRead);
  Require(mended.ok(), "what was written cannot be read: " + mended.status().ToString());
  Require(WriteSubspace(*mended, again).ok() && TemporaryFolder::Read(path) == TemporaryFolder::Read(again),
          "what was written reads back as something else");
  Use(*mended);
}

}  // namespace kpsa::engine
