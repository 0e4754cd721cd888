#include "rig/file/sections.h"

#include <algorithm>
#include <map>

namespace kpsa::engine {
namespace {

constexpr std::int64_t kMaxSamples = 1'000'000, kMaxKeyPoints = 100'000;

}  // namespace

bool SectionReader::CheckMap(const YamlNode& node, const char* section) const {
  return node.is_map() || errors->Add(node, "{}: expected a map, found {}", section, node.kind_name());
}

bool SectionReader::ReadNames(const YamlNode& node, const std::string& what,
                              std::vector<RigString>* names) const {
  names->clear();
  if (node.is_scalar()) {
    names->push_back({node.scalar, node.where(), source});
    return true;
  }
  if (!node.is_sequence())
    return errors->Add(node, "{}: expected a list of names, found {}", what, node.kind_name());
  bool good = true;
  for (const YamlNode& item : node.items) {
    std::string text;
    good = ReadString(item, what, &text, errors) && good;
    if (item.is_scalar()) names->push_back({text, item.where(), source});
  }
  return good;
}

void SectionReader::ReadNodes(const YamlNode& node) {
  if (!CheckMap(node, "nodes")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    const YamlNode& body = node.items[i];
    if (key.scalar.empty() || key.scalar.size() > 1024) {
      errors->Add(key, "a node needs a name of at most 1024 bytes");
      continue;
    }
    const std::string name = scope() + key.scalar;
    if (!define("node", name, key.where())) continue;
    const std::string what = fmt::format("node \"{}\"", name);
    if (!body.is_map()) {
      errors->Add(body, "{}: expected a map with its type, found {}", what, body.kind_name());
      continue;
    }
    RigNode rig_node;
    rig_node.name = name;
    rig_node.where = key.where();
    rig_node.source = source;
    const YamlNode* type = body.Find("type");
    if (type == nullptr) {
      errors->Add(key, "{}: the key \"type\" is missing", what);
      continue;
    }
    if (!ReadString(*type, what + ": type", &rig_node.type, errors)) continue;
    rig_node.type_node = *type;
    for (std::size_t k = 0; k < body.keys.size(); ++k) {
      if (body.keys[k].scalar != "type")
        rig_node.attributes.push_back({body.keys[k].scalar, body.keys[k], body.items[k], source});
    }
    rig->nodes.push_back(std::move(rig_node));
  }
}

void SectionReader::ReadConnections(const YamlNode& node) {
  if (!node.is_sequence()) {
    errors->Add(node, "connections: expected a list of \"a.x -> b.y\", found {}", node.kind_name());
    return;
  }
  for (const YamlNode& item : node.items) {
    RigConnection connection;
    connection.where = item.where();
    connection.source = source;
    if (item.is_map()) {  // {from: a.x, to: b.y, override: true}
      YamlMap map(item, "connection", errors);
      const YamlNode* from = map.Required("from");
      const YamlNode* to = map.Required("to");
      const YamlNode* override_clip = map.Find("override");
      map.RejectUnread();
      if (from == nullptr || to == nullptr) continue;
      bool good = ReadString(*from, "from", &connection.from, errors);
      good = ReadString(*to, "to", &connection.to, errors) && good;
      if (override_clip != nullptr)
        good = ReadBool(*override_clip, "override", &connection.override_clip, errors) && good;
      if (!good) continue;
    } else {
      std::string text;
      if (!ReadString(item, "connections", &text, errors)) continue;
      constexpr std::string_view kArrow = " -> ";
      const std::size_t arrow = text.find(kArrow);
      if (arrow == std::string::npos || text.find(kArrow, arrow + 1) != std::string::npos) {
        errors->Add(item,
                    "\"{}\": expected one connection, \"source.attribute -> destination.attribute\" with "
                    "spaces around ->",
                    text);
        continue;
      }
      connection.from = text.substr(0, arrow);
      connection.to = text.substr(arrow + kArrow.size());
    }
    rig->connections.push_back(std::move(connection));
  }
}

void SectionReader::ReadDeform(const YamlNode& node) {
  if (!node.is_sequence()) {
    errors->Add(node, "deform: expected a list of {{meshes: [...], stack: [...]}}, found {}",
                node.kind_name());
    return;
  }
  for (const YamlNode& item : node.items) {
    const std::size_t before = errors->count();
    YamlMap map(item, "deform", errors);
    if (!item.is_map()) continue;
    RigDeform deform;
    deform.where = item.where();
    deform.source = source;
    const YamlNode* meshes = map.Find("meshes");
    const YamlNode* points = map.Find("points");
    if (const YamlNode* stack = map.Required("stack")) ReadNames(*stack, "stack", &deform.stack);
    map.RejectUnread();
    if ((meshes == nullptr) == (points == nullptr)) {
      errors->Add(item, "deform: expected either \"meshes\" or \"points\"");
      continue;
    }
    if (meshes != nullptr) ReadNames(*meshes, "meshes", &deform.meshes);
    if (points != nullptr) {
      deform.points = RigString{{}, points->where(), source};
      if (ReadString(*points, "points", &deform.points->text, errors))
        define("the stack of", scope() + deform.points->text, points->where());
    }
    std::map<std::string, SourceLocation> seen;
    for (const RigString& deformer : deform.stack) {
      const auto [it, added] = seen.emplace(deformer.text, deformer.where);
      if (added) continue;
      errors->Append(
          Status::Invalid("\"{}\" is in this stack twice: first at {}", deformer.text, it->second.ToString())
              .At(deformer.where));
    }
    if (errors->count() == before) rig->deform.push_back(std::move(deform));
  }
}

void SectionReader::ReadControls(const YamlNode& node) {
  if (!CheckMap(node, "controls")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    if (!define("control", scope() + key.scalar, key.where())) continue;
    YamlMap map(node.items[i], fmt::format("control \"{}\"", key.scalar), errors);
    const YamlNode* min = map.Required("min");
    const YamlNode* max = map.Required("max");
    map.RejectUnread();
    if (min != nullptr && max != nullptr)
      rig->controls.push_back({{key.scalar, key.where(), source}, *min, *max});
  }
}

void SectionReader::ReadAcceleratePoints(const YamlNode& node, RigAccelerateEntry* accelerate) const {
  std::vector<RigString> names;
  ReadNames(node, "points", &names);
  if (names.empty()) errors->Add(node, "points: name at least one mesh@stage");
  for (const RigString& name : names) {
    // Names may hold an @, too: the builder, who knows the meshes, looks again
    const std::size_t at =
        name.text.size() < 3 ? std::string::npos : name.text.rfind('@', name.text.size() - 2);
    if (at == std::string::npos || at == 0) {
      errors->Append(Status::Invalid("points \"{}\": expected mesh@stage, as in head_mesh@skin", name.text)
                         .At(name.where));
      continue;
    }
    RigAccelerateEntry::Points points{name.text.substr(0, at), name.text.substr(at + 1), name.where};
    for (const RigAccelerateEntry::Points& other : accelerate->points) {
      if (other.mesh == points.mesh) {
        errors->Append(Status::Invalid("points of \"{}\" are named twice: first at {}", points.mesh,
                                       other.where.ToString())
                           .At(name.where));
      }
    }
    accelerate->points.push_back(std::move(points));
  }
}

void SectionReader::ReadAccelerate(const YamlNode& node) {
  if (!CheckMap(node, "accelerate")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    if (!define("accelerate", key.scalar, key.where())) continue;
    auto accelerate = Declared<RigAccelerateEntry>(key);
    YamlMap map(node.items[i], fmt::format("accelerate \"{}\"", key.scalar), errors);
    const YamlNode* colors = map.Find("colors");
    if (const YamlNode* points = colors == nullptr ? map.Required("points") : map.Find("points")) {
      if (colors != nullptr) errors->Add(*points, "points: either points or colors");
      ReadAcceleratePoints(*points, &accelerate);
    }
    if (colors != nullptr) {
      ReadNames(*colors, "colors", &accelerate.colors);
      if (accelerate.colors.empty())
        errors->Add(*colors, "colors: name at least one plug, as in gi.irradiance");
    }
    if (const YamlNode* space = map.Find("space")) {
      accelerate.space = RigString{{}, space->where(), source};
      ReadString(*space, "space", &accelerate.space->text, errors);
    }
    if (const YamlNode* path = map.Find("subspace");
        path != nullptr && ReadString(*path, "subspace", &accelerate.subspace, errors)) {
      accelerate.subspace =
          ResolvePath(*rig, source, accelerate.subspace, *path, errors, FileUse::kWritten).value_or("");
    }
    double number = 0;
    if (const YamlNode* tolerance = map.Find("tolerance");
        tolerance != nullptr &&
        ReadNumber(*tolerance, "tolerance", colors != nullptr ? Unit::kNone : Unit::kLength, units(), &number,
                   errors)) {
      if (number > 0) {
        accelerate.tolerance = number;
      } else {
        errors->Add(*tolerance, "tolerance: expected a {} above 0, found {}",
                    colors != nullptr ? "number" : "length", tolerance->scalar);
      }
    }
    if (const YamlNode* rate = map.Find("violationRate");
        rate != nullptr &&
        ReadNumber(*rate, "violationRate", Unit::kNone, units(), &accelerate.violation_rate, errors)) {
      if (accelerate.violation_rate < 0 || accelerate.violation_rate > 1) {
        errors->Add(*rate, "violationRate: expected 0% to 100%, found {}", rate->scalar);
      }
    }
    if (const YamlNode* train = map.Find("train")) {
      YamlMap train_map(*train, "train", errors);
      if (const YamlNode* clips = train_map.Find("clips"))
        ReadNames(*clips, "clips", &accelerate.train_clips);
      std::int64_t count = 0;
      if (const YamlNode* samples = train_map.Find("samples");
          samples != nullptr && ReadInteger(*samples, "samples", 0, kMaxSamples, &count, errors))
        accelerate.train_samples = count;
      if (const YamlNode* points = train_map.Find("keyPoints"))
        ReadInteger(*points, "keyPoints", 1, kMaxKeyPoints, &accelerate.key_points, errors);
      if (const YamlNode* poses = train_map.Find("heldOut"))
        ReadInteger(*poses, "heldOut", 20, kMaxSamples, &accelerate.calibration_poses, errors);
      train_map.RejectUnread();
    }
    if (const YamlNode* test = map.Find("test")) {
      YamlMap test_map(*test, "test", errors);
      if (const YamlNode* clips = test_map.Find("clips")) ReadNames(*clips, "clips", &accelerate.test_clips);
      test_map.RejectUnread();
    }
    map.RejectUnread();
    for (const RigString& clip : accelerate.test_clips) {
      for (const RigString& train : accelerate.train_clips) {
        if (train.text != clip.text) continue;
        errors->Append(Status::Invalid("clip \"{}\" is trained on at {}: test clips must be others",
                                       clip.text, train.where.ToString())
                           .At(clip.where));
      }
    }
    rig->accelerate.push_back(std::move(accelerate));
  }
}

void SectionReader::ReadOverrides(const YamlNode& node) {
  if (!CheckMap(node, "overrides")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    if (define("override", key.scalar, key.where())) {
      rig->overrides.push_back({{key.scalar, key.where(), source}, node.items[i]});
    }
  }
}

void SectionReader::ReadVariants(const YamlNode& node) {
  if (!CheckMap(node, "variants")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const std::string& name = node.keys[i].scalar;
    const YamlNode& body = node.items[i];
    const std::string what = fmt::format("variant \"{}\"", name);
    auto variant = std::find_if(rig->variants.begin(), rig->variants.end(),
                                [&](const RigVariant& v) { return v.name == name; });
    if (variant == rig->variants.end()) variant = rig->variants.insert(variant, {name, {}});
    if (body.is_null()) continue;
    if (!body.is_map()) {
      errors->Add(body, "{}: expected a map of plugs and values, found {}", what, body.kind_name());
      continue;
    }
    for (std::size_t k = 0; k < body.keys.size(); ++k) {
      const YamlNode& key = body.keys[k];
      if (define(what + ", override", key.scalar, key.where()))
        variant->overrides.push_back({{key.scalar, key.where(), source}, body.items[k]});
    }
  }
}

}  // namespace kpsa::engine
