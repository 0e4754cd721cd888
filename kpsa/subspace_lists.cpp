#include "kpsa/subspace_lists.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "files/json_depth.h"
#include "kpsa/name_table.h"
#include "kpsa/subspace_header.h"
#include "kpsa/subspace_tensors.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kAnyRows = SafetensorsFile::kAnySize;
constexpr char kMendsKey[] = "mends", kMendPointsKey[] = "mendPoints", kMendInnerKey[] = "mendInner",
               kMendMeansKey[] = "mendMeans", kMendMapsKey[] = "mendMaps";
constexpr char kCueKindsKey[] = "cueKinds", kCuesKey[] = "cues", kFactorsKey[] = "factors",
               kFactorCurvesKey[] = "factorCurves", kProductBoundsKey[] = "productBounds",
               kRangeNamesKey[] = "rangeNames", kRangesKey[] = "ranges", kRangePatchesKey[] = "rangePatches",
               kRangeReachKey[] = "rangeReach", kControlsKey[] = "controls",
               kSignatureNodesKey[] = "signatureNodes", kSignatureAttributesKey[] = "signatureAttributes",
               kTrainingKey[] = "training";

// Rows of numbers: a tensor [rows, columns].
template <typename T>
class Rows {
 public:
  explicit Rows(std::size_t columns) : columns_(columns) {}
  void Add(std::initializer_list<T> row) { values_.insert(values_.end(), row); }
  void AddTo(SafetensorsWriter* writer, const char* key) const {
    writer->Add<T>(key, {values_.size() / columns_, columns_}, values_);
  }
  Status Read(const SafetensorsFile& file, const char* key, std::uint64_t rows, std::size_t most = kMaxCues) {
    KPSA_RETURN_IF_ERROR(Assign(file.Values<T>(key, {rows, columns_}), &values_));
    if (size() > most) return Status::Invalid("\"{}\" has {} rows, expected at most {}", key, size(), most);
    return {};
  }
  std::size_t size() const { return values_.size() / columns_; }
  std::span<const T> operator[](std::size_t i) const {
    return std::span<const T>(values_).subspan(i * columns_, columns_);
  }

 private:
  std::size_t columns_;
  std::vector<T> values_;
};

// A cue: its kind, and of a point the stage, the joint, mesh and point; of a scalar its plug, the joint, 0 and 0; of a
// product "", the joint, the number of factors and 0.
void AddCues(const Subspace& s, NameNumbers* names, SafetensorsWriter* writer) {
  std::vector<std::uint8_t> kinds;
  Rows<std::uint32_t> cues(4), factors(1);
  Rows<double> curves(3), bounds(2);
  for (const CueDescription& cue : s.cues) {
    const bool of_point = cue.kind == CueDescription::Kind::kPoint;
    kinds.push_back(static_cast<std::uint8_t>(cue.kind));
    cues.Add({names->Of(of_point ? cue.stage : cue.plug), names->Of(cue.joint),
              of_point ? cue.mesh : static_cast<std::uint32_t>(cue.factors.size()),
              of_point ? cue.point : 0u});
    if (cue.kind != CueDescription::Kind::kProduct) continue;
    bounds.Add({cue.lo, cue.hi});
    for (const CueDescription::Factor& factor : cue.factors) {
      factors.Add({names->Of(factor.plug)});
      curves.Add({factor.curve.centre, factor.curve.scale, factor.curve.hinge ? 1.0 : 0.0});
    }
  }
  Add<std::uint8_t>(writer, kCueKindsKey, kinds);
  cues.AddTo(writer, kCuesKey);
  if (bounds.size() == 0) return;
  factors.AddTo(writer, kFactorsKey);
  curves.AddTo(writer, kFactorCurvesKey);
  bounds.AddTo(writer, kProductBoundsKey);
}

// The parts of products, which are taken one after the other.
struct Products {
  Rows<std::uint32_t> factors{1};
  Rows<double> curves{3}, bounds{2};
  std::size_t next = 0, next_factor = 0;

  Status Read(const SafetensorsFile& file) {
    if (!file.tensors().contains(kProductBoundsKey)) return {};
    KPSA_RETURN_IF_ERROR(factors.Read(file, kFactorsKey, kAnyRows, 2 * kMaxCues));
    KPSA_RETURN_IF_ERROR(curves.Read(file, kFactorCurvesKey, factors.size(), 2 * kMaxCues));
    return bounds.Read(file, kProductBoundsKey, kAnyRows);
  }
  Status Take(std::size_t count, NameTable* names, CueDescription* cue) {
    if (next == bounds.size() || count > factors.size() - next_factor)
      return Status::Invalid("there are {} products of {} factors, and cues with more", bounds.size(),
                             factors.size());
    cue->lo = bounds[next][0], cue->hi = bounds[next][1];
    ++next;
    for (; count > 0; --count, ++next_factor) {
      const std::span<const double> curve = curves[next_factor];
      if (curve[2] != 0 && curve[2] != 1)
        return Status::Invalid("factor {} is neither a hinge nor none: {}", next_factor, curve[2]);
      cue->factors.push_back({"", {curve[0], curve[1], curve[2] != 0}});
      KPSA_RETURN_IF_ERROR(names->Take(factors[next_factor][0], &cue->factors.back().plug));
    }
    return {};
  }
};

Status ReadCues(const SafetensorsFile& file, NameTable* names, Subspace* s) {
  Rows<std::uint32_t> cues(4);
  KPSA_RETURN_IF_ERROR(cues.Read(file, kCuesKey, kAnyRows));
  const Result<std::vector<std::uint8_t>> kinds = file.Values<std::uint8_t>(kCueKindsKey, {cues.size()});
  if (!kinds.ok()) return kinds.status();
  Products products;
  KPSA_RETURN_IF_ERROR(products.Read(file));
  s->cues.reserve(cues.size());
  for (std::size_t k = 0; k < cues.size(); ++k) {
    using Kind = CueDescription::Kind;
    CueDescription& cue = s->cues.emplace_back();
    const std::span<const std::uint32_t> row = cues[k];
    if ((*kinds)[k] > static_cast<std::uint8_t>(Kind::kProduct))
      return Status::Invalid("cue {} is of kind {}, expected 0 (point), 1 (scalar) or 2 (product)", k,
                             (*kinds)[k]);
    cue.kind = static_cast<Kind>((*kinds)[k]);
    KPSA_RETURN_IF_ERROR(names->Take(row[0], cue.kind == Kind::kPoint ? &cue.stage : &cue.plug));
    KPSA_RETURN_IF_ERROR(names->Take(row[1], &cue.joint));
    if (cue.kind == Kind::kPoint) cue.mesh = row[2], cue.point = row[3];
    if (cue.kind == Kind::kProduct) KPSA_RETURN_IF_ERROR(products.Take(row[2], names, &cue));
  }
  if (products.next != products.bounds.size() || products.next_factor != products.factors.size())
    return Status::Invalid("there are {} products of {} factors, and cues with fewer", products.bounds.size(),
                           products.factors.size());
  return {};
}

void AddRanges(const Subspace& s, NameNumbers* names, SafetensorsWriter* writer) {
  std::vector<std::uint32_t> plugs;
  Rows<double> ranges(3), reach(2);
  std::vector<std::uint64_t> patches;
  for (const TrainedRange& range : s.ranges) {
    plugs.push_back(names->Of(range.plug));
    ranges.Add({range.lo, range.hi, range.ramp});
    reach.Add({range.rest, range.reach});
    patches.push_back(range.patches);
  }
  Add<std::uint32_t>(writer, kRangeNamesKey, plugs);
  ranges.AddTo(writer, kRangesKey);
  Add<std::uint64_t>(writer, kRangePatchesKey, patches);
  if (std::isfinite(s.activity_limit)) reach.AddTo(writer, kRangeReachKey);
}

Status ReadRanges(const SafetensorsFile& file, NameTable* names, Subspace* s) {
  Rows<double> ranges(3);
  KPSA_RETURN_IF_ERROR(ranges.Read(file, kRangesKey, kAnyRows));
  const Result<std::vector<std::uint32_t>> plugs =
      file.Values<std::uint32_t>(kRangeNamesKey, {ranges.size()});
  if (!plugs.ok()) return plugs.status();
  const Result<std::vector<std::uint64_t>> patches =
      file.Values<std::uint64_t>(kRangePatchesKey, {ranges.size()});
  if (!patches.ok()) return patches.status();
  Rows<double> reach(2);
  const bool has_reach = std::isfinite(s->activity_limit);
  if (has_reach) KPSA_RETURN_IF_ERROR(reach.Read(file, kRangeReachKey, ranges.size()));
  s->ranges.reserve(ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const std::span<const double> row = ranges[i];
    s->ranges.push_back({"", row[0], row[1], row[2], (*patches)[i]});
    if (has_reach) s->ranges.back().rest = reach[i][0], s->ranges.back().reach = reach[i][1];
    KPSA_RETURN_IF_ERROR(names->Take((*plugs)[i], &s->ranges.back().plug));
    if ((*patches)[i] == 0)
      return Status::Invalid("the trained range of \"{}\" speaks of no patch", s->ranges.back().plug);
  }
  return {};
}

// A node: its name, its digest, and how many attributes are its; an attribute: its name and its digest.
void AddRig(const TrainedRig& rig, NameNumbers* names, SafetensorsWriter* writer) {
  std::vector<std::uint32_t> controls;
  Rows<std::uint32_t> nodes(3), attributes(2);
  for (const std::string& control : rig.controls) controls.push_back(names->Of(control));
  for (const auto& [name, node] : rig.signature) {
    nodes.Add({names->Of(name), names->Of(node.node), static_cast<std::uint32_t>(node.attributes.size())});
    for (const auto& [attribute, digest] : node.attributes)
      attributes.Add({names->Of(attribute), names->Of(digest)});
  }
  Add<std::uint32_t>(writer, kControlsKey, controls);
  nodes.AddTo(writer, kSignatureNodesKey);
  attributes.AddTo(writer, kSignatureAttributesKey);
}

Status ReadRig(const SafetensorsFile& file, NameTable* names, TrainedRig* rig) {
  constexpr std::size_t kMost = 16 * kMaxCues;
  Rows<std::uint32_t> controls(1), nodes(3), attributes(2);
  const Result<std::vector<std::uint32_t>> listed = file.Values<std::uint32_t>(kControlsKey, {kAnyRows});
  if (!listed.ok()) return listed.status();
  for (const std::uint32_t control : *listed)
    KPSA_RETURN_IF_ERROR(names->Take(control, &rig->controls.emplace_back()));
  KPSA_RETURN_IF_ERROR(nodes.Read(file, kSignatureNodesKey, kAnyRows, kMost));
  KPSA_RETURN_IF_ERROR(attributes.Read(file, kSignatureAttributesKey, kAnyRows, kMost));
  std::size_t next = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::string name, attribute, digest;
    NodeSignature node;
    KPSA_RETURN_IF_ERROR(names->Take(nodes[i][0], &name));
    KPSA_RETURN_IF_ERROR(names->Take(nodes[i][1], &node.node));
    if (nodes[i][2] > attributes.size() - next)
      return Status::Invalid("node \"{}\" of the trained rig has {} attributes, {} are left", name,
                             nodes[i][2], attributes.size() - next);
    for (const std::size_t end = next + nodes[i][2]; next < end; ++next) {
      KPSA_RETURN_IF_ERROR(names->Take(attributes[next][0], &attribute));
      KPSA_RETURN_IF_ERROR(names->Take(attributes[next][1], &digest));
      node.attributes.emplace_hint(node.attributes.end(), attribute, digest);
    }
    rig->signature.emplace_hint(rig->signature.end(), std::move(name), std::move(node));
  }
  if (next != attributes.size())
    return Status::Invalid("{} attributes of the trained rig belong to no node", attributes.size() - next);
  return {};
}

Status ReadTraining(const SafetensorsFile& file, std::string* training) {
  const Result<std::vector<std::uint8_t>> text = file.Values<std::uint8_t>(kTrainingKey, {kAnyRows});
  if (!text.ok()) return text.status();
  training->assign(text->begin(), text->end());
  const bool is_object = training->starts_with('{') && CheckJsonDepth(*text, kDeepestEntry).ok() &&
                         nlohmann::json::accept(*training);
  return is_object ? Status() : Status::Invalid("\"{}\" is not a JSON object", kTrainingKey);
}

// Of each mend: output, tile, points, inner points, numbers of its map.
void AddMends(const Subspace& s, SafetensorsWriter* writer) {
  std::vector<std::uint32_t> sizes, points, inner;
  std::vector<float> means, maps;
  for (const TileMend& mend : s.mends) {
    for (const std::size_t size : {std::size_t{mend.output}, std::size_t{mend.tile}, mend.points.size(),
                                   mend.inner.size(), mend.map.size()})
      sizes.push_back(static_cast<std::uint32_t>(size));
    points.insert(points.end(), mend.points.begin(), mend.points.end());
    inner.insert(inner.end(), mend.inner.begin(), mend.inner.end());
    means.insert(means.end(), mend.mean.begin(), mend.mean.end());
    maps.insert(maps.end(), mend.map.begin(), mend.map.end());
  }
  Add<std::uint32_t>(writer, kMendsKey, sizes);
  Add<std::uint32_t>(writer, kMendPointsKey, points);
  Add<std::uint32_t>(writer, kMendInnerKey, inner);
  Add<float>(writer, kMendMeansKey, means);
  Add<float>(writer, kMendMapsKey, maps);
}

// Takes as many numbers from the front of a list; false where it has fewer.
template <typename T>
bool Take(std::size_t count, std::span<const T>* from, std::vector<T>* to) {
  if (count > from->size()) return false;
  to->assign(from->begin(), from->begin() + static_cast<std::ptrdiff_t>(count));
  *from = from->subspan(count);
  return true;
}

Status ReadMends(const SafetensorsFile& file, Subspace* s) {
  if (!file.tensors().contains(kMendsKey)) return {};
  std::vector<std::uint32_t> sizes, points, inner;
  std::vector<float> means, maps;
  for (const auto& [key, list] :
       {std::pair{kMendsKey, &sizes}, {kMendPointsKey, &points}, {kMendInnerKey, &inner}})
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(key, {kAnyRows}), list));
  for (const auto& [key, list] : {std::pair{kMendMeansKey, &means}, {kMendMapsKey, &maps}})
    KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(key, {kAnyRows}), list));
  std::span<const std::uint32_t> of_points(points), of_inner(inner);
  std::span<const float> of_means(means), of_maps(maps);
  bool fits = sizes.size() % 5 == 0 && sizes.size() / 5 <= kMaxMends;
  for (std::size_t i = 0; fits && i < sizes.size(); i += 5) {
    TileMend& mend = s->mends.emplace_back();
    mend.output = sizes[i], mend.tile = sizes[i + 1];
    fits = Take(sizes[i + 2], &of_points, &mend.points) && Take(sizes[i + 3], &of_inner, &mend.inner) &&
           Take(3 * std::size_t{sizes[i + 3]}, &of_means, &mend.mean) &&
           Take(sizes[i + 4], &of_maps, &mend.map);
  }
  if (!fits || !of_points.empty() || !of_inner.empty() || !of_means.empty() || !of_maps.empty())
    return Status::Invalid("the sizes of mended tiles are not those of {} points and {} numbers",
                           points.size(), maps.size());
  return {};
}

}  // namespace

void AddLists(const Subspace& s, SafetensorsWriter* writer) {
  NameNumbers names;
  AddCues(s, &names, writer);
  AddRanges(s, &names, writer);
  AddRig(s.rig, &names, writer);
  if (!s.mends.empty()) AddMends(s, writer);
  names.AddTo(writer);
  Add<std::uint8_t>(writer, kTrainingKey,
                    {reinterpret_cast<const std::uint8_t*>(s.training.data()), s.training.size()});
}

Status ReadLists(const SafetensorsFile& file, Subspace* s) {
  Result<NameTable> names = NameTable::Read(file);
  if (!names.ok()) return names.status();
  KPSA_RETURN_IF_ERROR(ReadCues(file, &*names, s));
  KPSA_RETURN_IF_ERROR(ReadRanges(file, &*names, s));
  KPSA_RETURN_IF_ERROR(ReadRig(file, &*names, &s->rig));
  KPSA_RETURN_IF_ERROR(ReadMends(file, s));
  return ReadTraining(file, &s->training);
}

}  // namespace kpsa::engine
