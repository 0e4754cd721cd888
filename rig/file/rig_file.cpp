#include "rig/file/rig_file.h"

#include <filesystem>
#include <map>
#include <span>
#include <unordered_map>

#include "rig/file/sections.h"
#include "rig/file/templates.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxFiles = 256;
constexpr double kDefaultFps = 24;

// Reads a file and those that it includes, depth first, and merges them into one RigFile.
class Reader {
 public:
  Reader(RigFile* rig, YamlErrors* errors, std::optional<double> fps)
      : rig_(rig), errors_(errors), fps_(fps), templates_(rig, errors, Definer()) {}

  void ReadAll(const std::string& path) {
    Read(path, {path, 0, 0});
    if (rig_->complete) templates_.Expand();
  }

 private:
  void Read(const std::string& path, const SourceLocation& included_at) {
    std::error_code ignored;
    const std::string identity = std::filesystem::weakly_canonical(path, ignored).string();
    for (const Opened& open : open_) {
      if (open.identity == identity) {
        RefuseCycle(open, included_at);
        return;
      }
    }
    if (const auto it = read_.find(identity); it != read_.end()) {
      errors_->Append(Status::Invalid("\"{}\" is included twice: here and at {}", path, it->second.ToString())
                          .At(included_at));
      return;
    }
    if (read_.size() >= kMaxFiles) {
      if (read_.size() == kMaxFiles)
        errors_->Append(Status::Invalid("more than {} files are included", kMaxFiles).At(included_at));
      return;
    }
    read_.emplace(identity, included_at);
    Result<YamlNode> root = ReadYamlFile(path);
    if (!root.ok()) {
      rig_->complete = false;
      for (const Error& error : root.status().errors()) {
        const bool unread = error.where.line == 0 &&
                            included_at.line > 0;  // nothing of it: the place that asks for it says more
        errors_->Append(unread ? Status::Invalid("include: {} {}", path, error.message).At(included_at)
                               : Status(error));
      }
      return;
    }
    RigSource source;
    source.path = path;
    source.folder = std::filesystem::path(path).parent_path().string();
    source.included_at = included_at;
    source.units.fps = fps_.value_or(kDefaultFps);
    rig_->sources.push_back(std::move(source));
    open_.push_back({identity, path, included_at});
    ReadRoot(*root, static_cast<int>(rig_->sources.size()) - 1);
    open_.pop_back();
  }

  struct Opened {
    std::string identity, path;
    SourceLocation included_at;
  };

  void RefuseCycle(const Opened& first, const SourceLocation& included_at) {
    std::string chain = first.path;
    for (const Opened* open = &first + 1; open != open_.data() + open_.size(); ++open) {
      chain += fmt::format(" -> {} (at {})", open->path, open->included_at.ToString());
    }
    errors_->Append(
        Status::Invalid("includes form a cycle: {} -> {} (here)", chain, first.path).At(included_at));
  }

  void ReadRoot(const YamlNode& root, int source) {
    if (root.is_map() && root.Find("kpsa") == nullptr) {
      errors_->Add(root, "not a rig file: it must begin with \"kpsa: 1\"");
      return;
    }
    YamlMap map(root, "rig", errors_);
    if (!root.is_map()) return;
    const std::size_t before = errors_->count();
    ReadVersion(&map, errors_);
    if (errors_->count() != before) return;  // another version has other keys

    RigSource& here = rig_->sources[static_cast<std::size_t>(source)];
    // Units and frames a second first: all other numbers need them
    if (const YamlNode* node = map.Find("units")) ReadUnits(*node, &here.units, errors_);
    if (const YamlNode* node = map.Find("fps")) {
      double fps = 0;
      if (ReadNumber(*node, "fps", Unit::kNone, here.units, &fps, errors_)) {
        if (!(fps > 0)) {
          errors_->Add(*node, "fps: expected a number above 0, found {}", node->scalar);
        } else if (Define("fps", "fps", node->where())) {
          rig_->fps = fps;
          if (!fps_.has_value()) fps_ = fps;
          here.units.fps = *fps_;
        }
      }
    }
    if (const YamlNode* node = map.Find("character")) {
      RigString character{{}, node->where(), source};
      if (Define("character", "character", node->where()) &&
          ReadString(*node, "character", &character.text, errors_)) {
        auto file = ResolvePath(*rig_, source, character.text, *node, errors_);
        if (file.has_value()) {
          character.text = std::move(*file);
          rig_->character = std::move(character);
        }
      }
    }
    if (const YamlNode* node = map.Find("weld"); node != nullptr && Define("weld", "weld", node->where())) {
      ReadBool(*node, "weld", &rig_->weld, errors_);
    }
    if (const YamlNode* node = map.Find("plugins"); node != nullptr && !node->is_null()) {
      for (RigString& file : ReadFiles(*node, "plugins", source)) rig_->plugins.push_back(std::move(file));
    }
    if (const YamlNode* node = map.Find("include"); node != nullptr && !node->is_null()) {
      for (const RigString& file : ReadFiles(*node, "include", source)) Read(file.text, file.where);
    }

    // A section whose lines are all comments is empty
    const auto section = [&](const char* key) {
      const YamlNode* node = map.Find(key);
      return node == nullptr || node->is_null() ? nullptr : node;
    };
    SectionReader sections{rig_, errors_, source, Definer()};
    if (const YamlNode* node = section("nodes")) sections.ReadNodes(*node);
    if (const YamlNode* node = section("connections")) sections.ReadConnections(*node);
    if (const YamlNode* node = section("deform")) sections.ReadDeform(*node);
    if (const YamlNode* node = section("controls")) sections.ReadControls(*node);
    if (const YamlNode* node = section("accelerate")) sections.ReadAccelerate(*node);
    if (const YamlNode* node = section("overrides")) sections.ReadOverrides(*node);
    if (const YamlNode* node = section("variants")) sections.ReadVariants(*node);
    if (const YamlNode* node = section("templates")) templates_.ReadTemplates(*node, source);
    if (const YamlNode* node = section("use")) templates_.ReadUses(*node, source);
    if (const YamlNode* node = section("clips")) sections.ReadClips(*node);
    if (const YamlNode* node = section("references")) sections.ReadReferences(*node);
    map.RejectUnread();
  }

  // A file or a list of them, each resolved.
  std::vector<RigString> ReadFiles(const YamlNode& node, const char* key, int source) {
    std::vector<RigString> files;
    if (!node.is_scalar() && !node.is_sequence()) {
      errors_->Add(node, "{}: expected a list of files, found {}", key, node.kind_name());
      return files;
    }
    const std::span<const YamlNode> items =
        node.is_scalar() ? std::span(&node, 1) : std::span<const YamlNode>(node.items);
    for (const YamlNode& item : items) {
      std::string file;
      if (!ReadString(item, key, &file, errors_)) continue;
      if (auto resolved = ResolvePath(*rig_, source, file, item, errors_)) {
        files.push_back({std::move(*resolved), item.where(), source});
      } else {
        rig_->complete = false;
      }
    }
    return files;
  }

  // Notes where a key was defined; false and an error that names both places if it was defined before.
  bool Define(const std::string& section, const std::string& key, const SourceLocation& where) {
    const auto [it, added] = defined_.emplace(section + '\n' + key, where);
    if (added) return true;
    errors_->Append(
        Status::Invalid("{} is defined twice: here and at {}",
                        section == key ? fmt::format("\"{}\"", key) : fmt::format("{} \"{}\"", section, key),
                        it->second.ToString())
            .At(where));
    return false;
  }

  TemplateReader::Define Definer() {
    return [this](const std::string& section, const std::string& key, const SourceLocation& where) {
      return Define(section, key, where);
    };
  }

  RigFile* rig_;
  YamlErrors* errors_;
  std::optional<double> fps_;
  TemplateReader templates_;
  std::vector<Opened> open_;
  std::map<std::string, SourceLocation> read_;
  std::unordered_map<std::string, SourceLocation> defined_;
};

}  // namespace

std::optional<std::string> ResolvePath(const RigFile& rig, int source, const std::string& path,
                                       const YamlNode& at, YamlErrors* errors, FileUse use) {
  const std::filesystem::path folder = rig.sources[static_cast<std::size_t>(source)].folder;
  TrustedFolders trusted = rig.trusted;
  if (use == FileUse::kRead) {
    if (std::filesystem::path(path).is_absolute() && WithoutLinksAndDots(path).has_value()) return path;
    trusted.Add(folder.string());  // of a part that was named by an absolute path
  }
  Result<std::string> file =
      trusted.Check((folder / path).string());  // an absolute path takes the place of both
  if (!errors->Add(at, file.status())) return std::nullopt;
  return std::move(*file);
}

void ReadUnits(const YamlNode& node, FileUnits* units, YamlErrors* errors) {
  YamlMap map(node, "units", errors);
  std::string name;
  if (const YamlNode* length = map.Find("length");
      length != nullptr && ReadString(*length, "units.length", &name, errors)) {
    errors->Add(*length, units->SetLength(name));
  }
  if (const YamlNode* angle = map.Find("angle");
      angle != nullptr && ReadString(*angle, "units.angle", &name, errors)) {
    errors->Add(*angle, units->SetAngle(name));
  }
  map.RejectUnread();
}

void ReadVersion(YamlMap* map, YamlErrors* errors) {
  const YamlNode* node = map->Required("kpsa");
  std::int64_t version = 0;
  if (node == nullptr || !ReadInteger(*node, "kpsa", 1, 1'000'000, &version, errors)) return;
  if (version > 1) {
    errors->Add(*node, "the file is of version {}, newer than this kpsa, which reads version 1", version);
  }
}

Status ReadRigFile(const std::string& path, std::optional<double> fps, RigFile* rig, bool part,
                   const TrustedFolders* trusted) {
  *rig = RigFile();
  if (trusted != nullptr) {
    rig->trusted = *trusted;
  } else {
    Result<TrustedFolders> own = TrustedFolders::OfRig(path, {});
    if (!own.ok()) return own.status();
    rig->trusted = std::move(*own);
  }
  YamlErrors errors;
  Reader(rig, &errors, fps).ReadAll(path);
  for (RigSource& source : rig->sources) source.units.fps = fps.value_or(rig->fps.value_or(kDefaultFps));
  if (errors.ok() && !part && !rig->character.has_value() && rig->references.empty()) {
    errors.Append(
        Status::Invalid("the rig names no character: add \"character: FILE.glb\"").At({path, 1, 1}));
  }
  return errors.Take();
}

}  // namespace kpsa::engine
