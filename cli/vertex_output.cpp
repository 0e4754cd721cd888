#include "cli/vertex_output.h"

#include <algorithm>

#include "cli/cache_look.h"
#include "cli/common.h"
#include "cli/output.h"
#include "files/npz.h"
#include "files/point_cache.h"
#include "gltf/blender_order.h"
#include "gltf/export.h"
#include "host/rig_frames.h"
#include "host/vertex_points.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMaxCacheBytes = std::uint64_t{4} << 30;
constexpr std::size_t kMostReasons = 4;  // why meshes have no joints, in notes

class NpzOutput final : public VertexOutput {
 public:
  NpzOutput(OutputPath path, NpzWriter writer, const Rig& rig)
      : path_(std::move(path)), writer_(std::move(writer)), rig_(rig), shown_(ShownMeshes(rig.scene)) {}

  Status Declare(const std::vector<double>& times) {
    KPSA_RETURN_IF_ERROR(writer_.Add("times", {times.size()}, times));
    for (const std::size_t m : shown_) {
      const CharacterMesh& mesh = rig_.scene.meshes[m];
      for (const OutputPrimitive& primitive : mesh.primitives) {
        const Result<NpzWriter::ArrayId> id =
            writer_.Declare(primitive.key, NpzType::kFloat32, {times.size(), primitive.vertex_count, 3});
        if (!id.ok()) return id.status();
        arrays_.push_back(*id);
      }
    }
    return Status();
  }

  Status Frame(std::span<const ConstPointsView> meshes) override {
    std::size_t array = 0;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      const CharacterMesh& mesh = rig_.scene.meshes[shown_[m]];
      for (const OutputPrimitive& primitive : mesh.primitives) {
        xyz_.resize(std::size_t{3} * primitive.vertex_count);
        Interleave(mesh.mesh(), meshes[m], primitive.first_vertex, primitive.vertex_count, xyz_.data());
        KPSA_RETURN_IF_ERROR(writer_.Append(arrays_[array++], xyz_));
      }
    }
    return Status();
  }

  Result<std::vector<std::string>> Finish() override {
    KPSA_RETURN_IF_ERROR(writer_.Finish());
    KPSA_RETURN_IF_ERROR(path_.Finish());
    return std::vector<std::string>();
  }
  std::vector<std::string> paths() const override { return {path_.is_stdout() ? "stdout" : path_.path()}; }

 private:
  OutputPath path_;
  NpzWriter writer_;
  const Rig& rig_;
  std::vector<std::size_t> shown_;
  std::vector<NpzWriter::ArrayId> arrays_;
  std::vector<float> xyz_;
};

class CacheOutput final : public VertexOutput {
 public:
  CacheOutput(std::string path, const Rig& rig, std::vector<double> times, const VertexOutputOptions& options)
      : path_(std::move(path)),
        suffix_(FileSuffix(path_)),
        rig_(rig),
        shown_(ShownMeshes(rig.scene)),
        options_(options) {
    cache_.times = std::move(times);
    cache_.fps = rig.fps;
    for (const std::size_t m : shown_) {
      const CharacterMesh& mesh = rig.scene.meshes[m];
      cache_.meshes.push_back({mesh.name, mesh.vertex_count, {}, mesh.mesh().data().triangle_vertices});
    }
    if (!one_file_a_mesh()) AddLook(rig, shown_, &cache_, &notes_);
  }
  bool one_file_a_mesh() const { return suffix_ == ".pc2" || suffix_ == ".mdd"; }

  Status Check() {
    std::uint64_t bytes = 0;
    for (const PointCacheMesh& mesh : cache_.meshes)
      bytes += std::uint64_t{12} * mesh.vertex_count * cache_.times.size();
    if (bytes > kMaxCacheBytes) {
      return Status::
          Usage("{} frames take {}, more than the {} that a {} file is given; expected fewer frames, or .npz",
                cache_.times.size(), ByteText(bytes), ByteText(kMaxCacheBytes), suffix_)
              .At({path_});
    }
    if (cache_.meshes.empty()) return Status::Invalid("has no mesh to write").At({rig_.path});
    for (const std::string& path : paths()) {
      KPSA_RETURN_IF_ERROR(CheckOutput(path, options_.force, {}));
      KPSA_RETURN_IF_ERROR(CheckNotInput(path, rig_.files));
    }
    for (PointCacheMesh& mesh : cache_.meshes)
      mesh.frames.reserve(3 * mesh.vertex_count * cache_.times.size());
    return Status();
  }

  Status Frame(std::span<const ConstPointsView> meshes) override {
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      std::vector<float>& frames = cache_.meshes[m].frames;
      const std::size_t before = frames.size();
      frames.resize(before + 3 * cache_.meshes[m].vertex_count);
      Interleave(rig_.scene.meshes[shown_[m]].mesh(), meshes[m], 0, cache_.meshes[m].vertex_count,
                 frames.data() + before);
    }
    return Status();
  }

  Result<std::vector<std::string>> Finish() override {
    std::vector<std::string> notes = notes_;
    if (suffix_ == ".usda") {
      KPSA_RETURN_IF_ERROR(WriteUsda(path_, cache_, options_.force, &notes));
    } else if (suffix_ == ".glb") {
      KPSA_RETURN_IF_ERROR(FinishGlb(&notes));
    } else {
      for (std::size_t m = 0; m < cache_.meshes.size(); ++m) {
        CacheOptions options;
        options.force = options_.force;
        if (options_.blender) {
          options.axes = CacheAxes::kBlender;
          options.order = BlenderVertexOrder(
              rig_.character->meshes[rig_.character->nodes[rig_.scene.meshes[shown_[m]].gltf_node].mesh]);
        }
        const std::string path = CachePathForMesh(path_, cache_, m);
        KPSA_RETURN_IF_ERROR(suffix_ == ".pc2" ? WritePc2(path, cache_, m, options, &notes)
                                               : WriteMdd(path, cache_, m, options));
      }
    }
    return notes;
  }

  Status FinishGlb(std::vector<std::string>* notes) const {
    GlbOptions options;
    options.force = options_.force;
    options.only_scene = options_.skinned;
    if (options_.skins != nullptr) options.scene = &options_.skins->scene();
    const Result<GlbReport> report = WriteGlb(path_, cache_, options);
    if (!report.ok()) return report.status();
    std::size_t morphed = 0;
    for (std::size_t m = 0; m < report->reasons.size(); ++m) {
      if (report->reasons[m].empty() || ++morphed > kMostReasons) continue;
      notes->push_back(
          fmt::format("mesh \"{}\" goes without joints: it {}", cache_.meshes[m].name, report->reasons[m]));
    }
    if (morphed > kMostReasons) notes->push_back(fmt::format("so do {} more", morphed - kMostReasons));
    const auto skinned = static_cast<std::size_t>(report->skinned);
    std::vector<std::string> parts;
    if (skinned > 0)
      parts.push_back(fmt::format("{} by joints and the rig's own morph targets", Plural(skinned, "mesh")));
    if (skinned < cache_.meshes.size())
      parts.push_back(fmt::format("at most {} morph targets a mesh{}", report->morphed_targets,
                                  skinned > 0 ? " of the others" : ""));
    notes->push_back(fmt::format("{}; against the frames: max {}, RMS {} (diagonal {})",
                                 fmt::join(parts, ", "), LengthText(report->max_residual),
                                 LengthText(report->rms_residual), LengthText(report->diagonal)));
    if (report->most_joints > 4)
      notes->push_back(fmt::format(
          "up to {} joints move a vertex: programs that read four show something else", report->most_joints));
    if (report->least_weight < 0 || report->most_weight > 1)
      notes->push_back(fmt::format(
          "weights of morph targets go from {:.3g} to {:.3g}: some programs keep them within 0 to 1",
          report->least_weight, report->most_weight));
    return Status();
  }

  std::vector<std::string> paths() const override {
    if (!one_file_a_mesh()) return {path_};
    std::vector<std::string> paths;
    for (std::size_t m = 0; m < cache_.meshes.size(); ++m)
      paths.push_back(CachePathForMesh(path_, cache_, m));
    return paths;
  }

 private:
  std::string path_, suffix_;
  const Rig& rig_;
  std::vector<std::size_t> shown_;
  VertexOutputOptions options_;
  PointCache cache_;
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<std::string> VertexSuffixes() { return {".npz", ".pc2", ".mdd", ".glb", ".usda"}; }

Result<std::unique_ptr<VertexOutput>> CreateVertexOutput(const std::string& output, const Rig& rig,
                                                         std::vector<double> times,
                                                         const VertexOutputOptions& options) {
  if (output == "-" || FileSuffix(output) == ".npz") {
    KPSA_RETURN_IF_ERROR(CheckNotInput(output, rig.files));
    Result<OutputPath> path = OutputPath::Create(output);
    if (!path.ok()) return path.status();
    Result<NpzWriter> writer = NpzWriter::Create(path->path(), options.force || path->is_stdout());
    if (!writer.ok()) return AsUsage(writer.status());
    auto npz = std::make_unique<NpzOutput>(std::move(*path), std::move(*writer), rig);
    KPSA_RETURN_IF_ERROR(npz->Declare(times));
    return std::unique_ptr<VertexOutput>(std::move(npz));
  }
  KPSA_RETURN_IF_ERROR(CheckNotInput(output, rig.files));
  auto cache = std::make_unique<CacheOutput>(output, rig, std::move(times), options);
  KPSA_RETURN_IF_ERROR(cache->Check());
  return std::unique_ptr<VertexOutput>(std::move(cache));
}

}  // namespace kpsa::engine
