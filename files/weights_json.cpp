#include "files/weights_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "files/file.h"
#include "files/json_depth.h"
#include "files/quantity.h"

namespace kpsa::engine {
namespace {

using json = nlohmann::json;  // finds keys by their order; ordered_json looks at each
constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 30;

SourceLocation PlaceOfByte(const std::string& path, const std::vector<std::uint8_t>& text, std::size_t byte) {
  SourceLocation place{path, 1, 1};
  for (std::size_t i = 0; i + 1 < byte && i < text.size(); ++i) {
    place.column = text[i] == '\n' ? 1 : place.column + 1;
    place.line += text[i] == '\n';
  }
  return place;
}

// JSON libraries keep the last of equal keys and forget their order. (A callback of json::parse would tell
// them, too, but makes it look at all maps again after each.)
struct WeightKeys final : json::json_sax_t {
  std::optional<std::string> repeated;  // the first
  std::vector<std::string> maps;        // those of an object in the outermost one

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(json::number_integer_t) override { return true; }
  bool number_unsigned(json::number_unsigned_t) override { return true; }
  bool number_float(json::number_float_t, const std::string&) override { return true; }
  bool string(std::string&) override { return true; }
  bool binary(json::binary_t&) override { return true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool start_object(std::size_t) override {
    open_.emplace_back();
    return true;
  }
  bool end_object() override {
    open_.pop_back();
    return true;
  }
  bool key(std::string& name) override {
    if (open_.size() == 2) maps.push_back(name);
    if (!open_.back().insert(name).second && !repeated.has_value()) repeated = name;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const json::exception&) override { return false; }

 private:
  std::vector<std::set<std::string>> open_;
};

// Collects the errors of one file.
class Reader {
 public:
  Reader(const std::string& path, WeightFile* file) : path_(path), file_(file) {}

  // `names`: the maps' in the file's order.
  Status Read(const json& root, const std::vector<std::string>& names) {
    if (!root.is_object() || Text(root, "kpsa") != "weights") {
      Fail("is no weight file; expected {{\"kpsa\": \"weights\", ...}}");
      return std::move(status_);
    }
    CheckKeys(root, "", {"kpsa", "version", "mesh", "points", "maps"});
    if (const auto version = root.find("version"); version == root.end() || *version != 1) {
      Fail("version must be 1");
    }
    const std::optional<std::string> mesh = Text(root, "mesh");
    if (!mesh) Fail("mesh must be the name of a mesh node");
    file_->mesh = mesh.value_or("");
    const auto points = root.find("points");
    if (points == root.end() || !points->is_number_unsigned() || points->get<std::uint64_t>() >= kNoIndex) {
      Fail("points must be the number of points of the mesh, a whole number below {}", kNoIndex);
    } else {
      file_->points = points->get<std::size_t>();
    }
    const auto maps = root.find("maps");
    if (maps == root.end() || !maps->is_object()) {
      Fail("maps must be an object of weight maps");
    } else if (status_.ok()) {
      for (const std::string& name : names) ReadMap(name, maps->at(name));
    }
    return std::move(status_);
  }

 private:
  template <typename... Args>
  void Fail(fmt::format_string<Args...> format, Args&&... args) {
    constexpr std::size_t kMost = 20;
    if (status_.errors().size() >= kMost) return;
    status_.Append(Status::Invalid(format, std::forward<Args>(args)...).At({path_}));
  }

  static std::optional<std::string> Text(const json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_string()) return std::nullopt;
    return found->get<std::string>();
  }

  void CheckKeys(const json& object, const std::string& where, const std::vector<std::string>& known) {
    for (const auto& [key, value] : object.items()) {
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        Fail("{}unknown key \"{}\"{}", where, key, DidYouMean(key, known));
      }
    }
  }

  // A finite float32, or nullopt.
  static std::optional<float> Number(const json& value) {
    if (!value.is_number()) return std::nullopt;
    const double number = value.get<double>();
    if (!(std::fabs(number) <= std::numeric_limits<float>::max())) return std::nullopt;
    return static_cast<float>(number);
  }

  // A number or null as it is; what may be long by its kind.
  static std::string Short(const json& value) {
    return value.is_number() || value.is_null() ? value.dump()
                                                : fmt::format("an entry of type {}", value.type_name());
  }

  void ReadMap(const std::string& name, const json& in) {
    const std::string where = fmt::format("map \"{}\": ", name);
    if (!in.is_object()) return Fail("{}must be an object", where);
    CheckKeys(in, where, {"default", "indices", "values"});
    NamedWeights map;
    map.name = name;
    if (const auto found = in.find("default"); found != in.end()) {
      const std::optional<float> number = Number(*found);
      if (!number) return Fail("{}default must be a finite number", where);
      map.default_value = *number;
    }
    const json none = json::array();
    const json& indices = in.contains("indices") ? in["indices"] : none;
    const json& values = in.contains("values") ? in["values"] : none;
    if (!indices.is_array() || !values.is_array()) return Fail("{}indices and values must be arrays", where);
    if (indices.size() != values.size()) {
      return Fail("{}has {} indices and {} values; expected one value for each index", where, indices.size(),
                  values.size());
    }
    std::set<Index> seen;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      if (!indices[i].is_number_unsigned() || indices[i].get<std::uint64_t>() >= file_->points) {
        Fail("{}indices[{}] is {}, expected a point from 0 to {}", where, i, Short(indices[i]),
             static_cast<long long>(file_->points) - 1);
        continue;
      }
      const auto index = indices[i].get<Index>();
      if (!seen.insert(index).second) Fail("{}point {} occurs twice", where, index);
      const std::optional<float> value = Number(values[i]);
      if (!value) Fail("{}values[{}] is {}, expected a finite number", where, i, Short(values[i]));
      map.indices.push_back(index);
      map.values.push_back(value.value_or(0));
    }
    file_->maps.push_back(std::move(map));
  }

  const std::string& path_;
  WeightFile* file_;
  Status status_;
};

// The fewest digits that the reader, which goes through double, reads back as the same float.
std::string FloatText(float value) {
  std::string text = fmt::format("{}", value);
  double read = 0;
  std::from_chars(text.data(), text.data() + text.size(), read);
  return static_cast<float>(read) == value ? text : NumberText(static_cast<double>(value));
}

std::vector<std::string> MapNames(const WeightFile& file) {
  std::vector<std::string> names;
  for (const NamedWeights& map : file.maps) names.push_back(map.name);
  return names;
}

}  // namespace

const NamedWeights* WeightFile::Find(std::string_view name) const {
  for (const NamedWeights& map : maps) {
    if (map.name == name) return &map;
  }
  return nullptr;
}

Result<WeightFile> ReadWeightFile(const std::string& path) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestFile);
  if (!bytes.ok()) return bytes.status();
  if (Status status = CheckJsonDepth(*bytes); !status.ok()) return std::move(status).At({path});
  try {
    WeightKeys keys;
    json::sax_parse(bytes->begin(), bytes->end(), &keys);  // what it cannot read, the next line says
    const json root = json::parse(bytes->begin(), bytes->end());
    if (keys.repeated.has_value())
      return Status::Invalid("the key \"{}\" is defined twice", *keys.repeated).At({path});
    WeightFile file;
    file.path = path;
    KPSA_RETURN_IF_ERROR(Reader(path, &file).Read(root, keys.maps));
    return file;
  } catch (const json::parse_error& error) {
    return Status::Invalid("is no valid JSON here (NaN and trailing commas are none)")
        .At(PlaceOfByte(path, *bytes, error.byte));
  } catch (const json::exception& error) {
    return Status::Invalid("is no valid weight file: {}", error.what()).At({path});
  }
}

std::vector<float> DenseWeights(const WeightFile& file, const NamedWeights& map) {
  std::vector<float> dense(file.points, map.default_value);
  for (std::size_t i = 0; i < map.indices.size(); ++i) dense[map.indices[i]] = map.values[i];
  return dense;
}

WeightReference SplitWeightReference(const std::string& text) {
  const std::size_t suffix = text.find(".json#");
  const std::size_t hash = suffix == std::string::npos ? text.rfind('#') : suffix + 5;
  if (hash == std::string::npos) return {text, std::nullopt};
  return {text.substr(0, hash), text.substr(hash + 1)};
}

Result<const NamedWeights*> FindWeights(const WeightFile& file, const std::string& path,
                                        const std::optional<std::string>& map) {
  const std::vector<std::string> names = MapNames(file);
  if (!map.has_value()) {
    if (names.size() == 1) return &file.maps[0];
    return Status::Invalid("\"{0}\": expected \"{0}#MAP\"; the file has the maps {1}", path,
                           fmt::join(names, ", "));
  }
  if (const NamedWeights* found = file.Find(*map); found != nullptr) return found;
  return Status::Invalid("{} has no map \"{}\"{}", path, *map, DidYouMean(*map, names));
}

std::optional<std::pair<Index, float>> FirstOutOfRange(const WeightFile& file, const NamedWeights& map) {
  const auto outside = [](float weight) { return !(weight >= 0 && weight <= 1); };
  std::optional<std::pair<Index, float>> first;
  const auto take = [&](Index point, float weight) {
    if (!first.has_value() || point < first->first) first.emplace(point, weight);
  };
  for (std::size_t i = 0; i < map.indices.size(); ++i) {
    if (outside(map.values[i])) take(map.indices[i], map.values[i]);
  }
  if (!outside(map.default_value)) return first;
  std::vector<Index> listed = map.indices;
  std::sort(listed.begin(), listed.end());
  Index point = 0;  // the first that is not listed
  while (point < listed.size() && listed[point] == point) ++point;
  if (point < file.points) take(point, map.default_value);
  return first;
}

std::string WeightFileText(const WeightFile& file) {
  const auto text_of = [](const json& value) {
    return value.dump(-1, ' ', false, json::error_handler_t::replace);
  };
  std::string text =
      fmt::format("{{\"kpsa\": \"weights\", \"version\": 1, \"mesh\": {}, \"points\": {},\n \"maps\": {{",
                  text_of(file.mesh), file.points);
  for (const NamedWeights& map : file.maps) {
    std::vector<std::string> values;
    for (float value : map.values) values.push_back(FloatText(value));
    text += fmt::format("{}\n  {}: {{\"default\": {}, \"indices\": [{}], \"values\": [{}]}}",
                        &map == file.maps.data() ? "" : ",", text_of(map.name), FloatText(map.default_value),
                        fmt::join(map.indices, ","), fmt::join(values, ","));
  }
  return text + "}}\n";
}

Status WriteWeightFile(const std::string& path, const WeightFile& file, bool force) {
  const std::string text = WeightFileText(file);
  return WriteFileAtomically(path, force, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace kpsa::engine
