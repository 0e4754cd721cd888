// The .kpsa file: what is small as JSON in the metadata, all else as tensors. See kpsa/subspace.h and
// files/safetensors.h.
#include <span>

#include "files/safetensors.h"
#include "kpsa/calibration_file.h"
#include "kpsa/subspace.h"
#include "kpsa/subspace_digest.h"
#include "kpsa/subspace_header.h"
#include "kpsa/subspace_lists.h"
#include "kpsa/subspace_tensors.h"
#include "kpsa/tiles_file.h"

namespace kpsa::engine {
namespace {

constexpr char kLatent[] = "latent";

// Column by column: a row of the tensor is a mode.
Status ReadKeptModes(const SafetensorsFile& file, Subspace* s) {
  std::uint64_t rows = 0;
  for (const SubspaceOutput& output : s->outputs)
    rows += output.reconstructed() * static_cast<std::uint64_t>(s->components);
  const Result<std::vector<float>> values = file.Values<float>(kModes, {s->modes, rows});
  if (!values.ok()) return values.status();
  s->kept_modes = {rows, s->modes, *values};
  return {};
}

}  // namespace

Status WriteSubspace(const Subspace& s, const std::string& path) {
  KPSA_RETURN_IF_ERROR(ValidateSubspace(s));
  SafetensorsWriter writer;
  for (const auto& [key, text] : SubspaceHeader(s)) writer.SetMetadata(key, text);
  AddLists(s, &writer);
  Add<double>(&writer, "cueMean", s.cue_mean);
  Add<double>(&writer, "cueScale", s.cue_scale);
  Add<std::uint32_t>(&writer, "cueOffsets", s.soft_cache.offsets);
  Add<float>(&writer, "factor", s.soft_cache.factor.span());
  Add<float>(&writer, "leaveOneOut", s.soft_cache.leave_one_out);
  if (!s.latent.empty()) Add<float>(&writer, kLatent, s.latent);
  AddCalibration(s, &writer);
  AddTiles(s, &writer);
  if (!s.kept_modes.values.empty()) {
    writer.Add<float>(kModes, {s.kept_modes.columns, s.kept_modes.rows},
                      std::span<const float>(s.kept_modes.values));
    writer.SetMetadata(kModesDigest, ModesDigest(s));
  }
  const Result<SafetensorsFile> written = SafetensorsFile::Parse(writer.Serialize(), path);
  if (!written.ok()) return written.status();
  writer.SetMetadata(kDigest, FileDigest(*written));
  return writer.Write(path);
}

Result<int> SubspaceVersion(const SafetensorsFile& file) {
  const auto kind = file.metadata().find("kind");
  if (kind == file.metadata().end() || kind->second != kSubspaceKind) {
    return Status::Invalid("a file of tensors, but not a subspace (write one with `kpsa train`)");
  }
  const Result<std::string> version = file.Metadata("version");
  if (!version.ok()) return version.status();
  for (int v = kOldestVersion; v <= kSubspaceVersion; ++v) {
    if (*version == std::to_string(v)) return v;
  }
  return Status::Invalid(
      "the subspace has format version {}, this program reads versions {} to {}; train it again or use "
      "the program that wrote it",
      *version, kOldestVersion, kSubspaceVersion);
}

Result<Subspace> SubspaceContent(const SafetensorsFile& file, KeptModes modes) {
  const Result<int> version = SubspaceVersion(file);
  if (!version.ok()) return version.status();
  const bool has_json_lists = *version < kListsVersion;
  Subspace s;
  KPSA_RETURN_IF_ERROR(ReadSubspaceHeader(file, has_json_lists, &s));
  if (!has_json_lists) KPSA_RETURN_IF_ERROR(ReadLists(file, &s));
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  KPSA_RETURN_IF_ERROR(Assign(file.Values<double>("cueMean", {kAny}), &s.cue_mean));
  const std::uint64_t rows = s.rows();
  KPSA_RETURN_IF_ERROR(Assign(file.Values<double>("cueScale", {rows}), &s.cue_scale));
  KPSA_RETURN_IF_ERROR(
      Assign(file.Values<std::uint32_t>("cueOffsets", {s.cues.size() + 1}), &s.soft_cache.offsets));
  for (std::size_t k = 0; k <= s.cues.size(); ++k) {
    const Index offset = s.soft_cache.offsets[k];
    if (offset > rows || (k == 0 ? offset != 0 : offset < s.soft_cache.offsets[k - 1])) {
      return Status::Invalid("cue {} begins at row {} of {}", k, offset, rows);
    }
  }
  KPSA_RETURN_IF_ERROR(ReadAligned(file, "factor", &s.soft_cache.factor, false,
                                   s.score.measured > 0 ? s.soft_cache.factor_size() : kAny));
  KPSA_RETURN_IF_ERROR(Assign(file.Values<float>("leaveOneOut", {kAny}), &s.soft_cache.leave_one_out));
  if (file.tensors().contains(kLatent)) {
    KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(kLatent, {kAny}), &s.latent));
    if (rows == 0 || s.latent.empty() || s.latent.size() % rows != 0)
      return Status::Invalid("{} latent factors of {} rows", s.latent.size(), rows);
  }
  // What the file claims: where that is not its digest, ReadSubspace refuses it
  const Result<std::string> digest = file.Metadata(kDigest);
  KPSA_RETURN_IF_ERROR(ReadTiles(file, digest.ok() && !has_json_lists ? *digest : "", &s));
  KPSA_RETURN_IF_ERROR(ReadCalibration(file, &s));
  if (modes == KeptModes::kRead &&
      (file.tensors().contains(kModes) || file.metadata().contains(kModesDigest)))
    KPSA_RETURN_IF_ERROR(ReadKeptModes(file, &s));
  KPSA_RETURN_IF_ERROR(ValidateSubspace(s));
  return s;
}

namespace {

Status CheckDigests(const SafetensorsFile& file, KeptModes modes, const Subspace& s) {
  const Result<std::string> digest = file.Metadata(kDigest);
  if (!digest.ok()) return digest.status();
  const bool is_of_file = *SubspaceVersion(file) >= kListsVersion;
  if (*digest != (is_of_file ? FileDigest(file) : ContentDigest(s, file.metadata())))
    return Status::Invalid(
        "the file is damaged: its contents are not those that were written; train it again");
  if (modes == KeptModes::kSkip || !file.tensors().contains(kModes)) return {};
  const Result<std::string> of_modes = file.Metadata(kModesDigest);
  if (!of_modes.ok()) return of_modes.status();
  if (*of_modes != ModesDigest(s))
    return Status::Invalid("the file is damaged: its modes are not those that were written");
  return {};
}

}  // namespace

Result<Subspace> ReadSubspace(const std::string& path, KeptModes modes) {
  const Result<SafetensorsFile> file = SafetensorsFile::Read(path);
  if (!file.ok()) return file.status();
  Result<Subspace> subspace = SubspaceContent(*file, modes);
  if (!subspace.ok()) return Status(subspace.status()).At({path});
  if (Status status = CheckDigests(*file, modes, *subspace); !status.ok())
    return std::move(status).At({path});
  return subspace;
}

}  // namespace kpsa::engine
