#include "io/weight_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_set>

#include "io/file.h"

namespace kpsa {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMaxBytes = 256u << 20;
constexpr int kMaxDepth = 5;

struct Refusal {
  std::string message;
};

// The parsed text; throws Refusal for duplicate keys and too deep nesting, Json::exception for bad syntax.
Json Parse(std::string_view text) {
  std::vector<std::unordered_set<std::string>> keys(kMaxDepth + 2);
  const auto watch = [&](int depth, Json::parse_event_t event, Json& value) {
    using Event = Json::parse_event_t;
    if ((event == Event::object_start || event == Event::array_start)) {
      if (depth >= kMaxDepth) throw Refusal{fmt::format("nested deeper than {} levels", kMaxDepth)};
      keys[static_cast<std::size_t>(depth) + 1].clear();
    }
    if (event == Event::key) {
      const std::string key = value.get<std::string>();
      if (!keys[static_cast<std::size_t>(std::min(depth, kMaxDepth))].insert(key).second) {
        throw Refusal{fmt::format("the key \"{}\" is there twice", key)};
      }
    }
    return true;
  };
  return Json::parse(text.begin(), text.end(), watch);
}

const Json& Member(const Json& object, const char* key, const std::string& what) {
  const auto it = object.find(key);
  if (it == object.end()) throw Refusal{fmt::format("{}: the key \"{}\" is missing", what, key)};
  return *it;
}

void RejectOthers(const Json& object, const std::vector<std::string>& known, const std::string& what) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw Refusal{fmt::format("{}: unknown key \"{}\"{}; the keys are {}", what, key, DidYouMean(key, known), fmt::join(known, ", "))};
  }
}

float Weight(const Json& value, const std::string& what) {
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!(std::abs(number) <= std::numeric_limits<float>::max())) {
    throw Refusal{fmt::format("{}: expected a finite number, found {}", what, value.dump().substr(0, 40))};
  }
  return static_cast<float>(number);
}

Index WholeNumber(const Json& value, Index limit, const std::string& what) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= limit) {
    throw Refusal{fmt::format("{}: expected a whole number below {}, found {}", what, limit, value.dump().substr(0, 40))};
  }
  return static_cast<Index>(value.get<std::uint64_t>());
}

WeightFile::Map ReadMap(const std::string& name, const Json& json, Index points) {
  const std::string what = fmt::format("map \"{}\"", name);
  if (!json.is_object()) throw Refusal{what + ": expected an object"};
  RejectOthers(json, {"default", "indices", "values"}, what);
  WeightFile::Map map;
  map.name = name;
  if (const auto it = json.find("default"); it != json.end()) map.default_value = Weight(*it, what + ".default");
  const Json& indices = Member(json, "indices", what);
  const Json& values = Member(json, "values", what);
  if (!indices.is_array() || !values.is_array()) throw Refusal{what + ": indices and values are lists"};
  if (indices.size() != values.size()) {
    throw Refusal{fmt::format("{} has {} indices and {} values", what, indices.size(), values.size())};
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    map.indices.push_back(WholeNumber(indices[i], points, fmt::format("{}.indices[{}]", what, i)));
    map.values.push_back(Weight(values[i], fmt::format("{}.values[{}]", what, i)));
  }
  std::vector<Index> sorted = map.indices;
  std::sort(sorted.begin(), sorted.end());
  if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end()) {
    throw Refusal{fmt::format("{}.indices: {} is there twice", what, *twice)};
  }
  return map;
}

WeightFile ReadRoot(const Json& root, const std::string& path) {
  if (!root.is_object()) throw Refusal{"expected an object with \"kpsa\": \"weights\""};
  const Json& kind = Member(root, "kpsa", "weight file");
  if (kind != "weights") throw Refusal{"not a weight file: \"kpsa\" is to be \"weights\""};
  const Json& version = Member(root, "version", "weight file");
  if (version != 1) {
    throw Refusal{fmt::format("the file is of version {}; this kpsa reads version 1", version.dump().substr(0, 20))};
  }
  RejectOthers(root, {"kpsa", "version", "mesh", "points", "maps"}, "weight file");
  WeightFile file;
  file.path = path;
  const Json& mesh = Member(root, "mesh", "weight file");
  if (!mesh.is_string()) throw Refusal{"mesh: expected a name"};
  file.mesh = mesh.get<std::string>();
  file.points = WholeNumber(Member(root, "points", "weight file"), kNoIndex, "points");
  const Json& maps = Member(root, "maps", "weight file");
  if (!maps.is_object()) throw Refusal{"maps: expected an object"};
  for (const auto& [name, map] : maps.items()) file.maps.push_back(ReadMap(name, map, file.points));
  return file;
}

}  // namespace

const WeightFile::Map* WeightFile::Find(std::string_view name) const {
  for (const Map& map : maps) {
    if (map.name == name) return &map;
  }
  return nullptr;
}

std::vector<std::string> WeightFile::Names() const {
  std::vector<std::string> names;
  for (const Map& map : maps) names.push_back(map.name);
  return names;
}

std::vector<float> WeightFile::Dense(const Map& map) const {
  std::vector<float> dense(points, map.default_value);
  for (std::size_t i = 0; i < map.indices.size(); ++i) dense[map.indices[i]] = map.values[i];
  return dense;
}

Result<WeightFile> ParseWeightFile(std::string_view text, const std::string& path) {
  try {
    return ReadRoot(Parse(text), path);
  } catch (const Refusal& refusal) {
    return Status::Invalid("{}", refusal.message).At({path, 0, 0});
  } catch (const Json::parse_error& error) {
    const std::string_view before = text.substr(0, std::min(error.byte, text.size()));
    const int line = 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'));
    return Status::Invalid("no valid JSON: {}", error.what()).At({path, line, 0});
  } catch (const std::exception& error) {
    return Status::Invalid("no valid JSON: {}", error.what()).At({path, 0, 0});
  }
}

Result<WeightFile> ReadWeightFile(const std::string& path) {
  Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kMaxBytes);
  if (!bytes.ok()) return bytes.status();
  return ParseWeightFile({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path);
}

}  // namespace kpsa
