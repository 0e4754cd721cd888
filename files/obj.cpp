#include "files/obj.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>
#include <string_view>

#include "base/types.h"
#include "files/file.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMaxObjBytes = std::uint64_t{1} << 30;
constexpr std::size_t kMostQuoted = 40;  // of a word that is wrong, in messages

// Statements that say nothing of where vertices are.
constexpr std::string_view kPassedOver[] = {
    "vt",       "vn",       "vp",        "l",    "p",     "s",     "usemtl", "mtllib", "usemap",
    "maplib",   "mg",       "bevel",     "lod",  "deg",   "bmat",  "step",   "cstype", "curv",
    "curv2",    "surf",     "parm",      "trim", "hole",  "scrv",  "sp",     "end",    "con",
    "c_interp", "d_interp", "trace_obj", "fo",   "ctech", "stech", "call",   "csh",    "shadow_obj"};

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\\'; }

// The next word of a line; empty at its end. A backslash at the end of a line goes on in the next one.
std::string_view NextWord(std::string_view* line) {
  std::size_t begin = 0;
  while (begin < line->size() && IsBlank((*line)[begin])) ++begin;
  std::size_t end = begin;
  while (end < line->size() && !IsBlank((*line)[end])) ++end;
  const std::string_view word = line->substr(begin, end - begin);
  line->remove_prefix(end);
  return word;
}

// What is left of a line: a name, which may have blanks.
std::string Rest(std::string_view line) {
  while (!line.empty() && IsBlank(line.front())) line.remove_prefix(1);
  while (!line.empty() && IsBlank(line.back())) line.remove_suffix(1);
  return std::string(line);
}

class ObjReader {
 public:
  explicit ObjReader(const std::string& path) : path_(path) {}

  Result<std::vector<ObjShape>> Read(std::string_view text) {
    int number = 1;
    while (!text.empty()) {
      int lines = 0;
      std::size_t end = 0;
      for (;; ++end) {
        end = std::min(text.find('\n', end), text.size());
        ++lines;
        std::size_t last = end;
        if (last > 0 && text[last - 1] == '\r') --last;
        if (end == text.size() || last == 0 || text[last - 1] != '\\') break;
      }
      const Status status = ReadLine(text.substr(0, end));
      if (!status.ok()) return Status(status).At({path_, number, 0});
      text.remove_prefix(std::min(end + 1, text.size()));
      number += lines;
    }
    return Finish();
  }

 private:
  Status ReadLine(std::string_view line) {
    const std::string_view word = NextWord(&line);
    if (word.empty() || word.front() == '#') return {};
    if (word == "v") return ReadVertex(line);
    if (word == "o") {
      objects_ = true;
      shapes_.push_back({Rest(line), {}});
    } else if (word == "g") {
      group_ = Rest(line);
    } else if (word == "f") {
      faces_ = true;
      // Exporters write the group of the faces after their vertices, and none or "default" before these
      if (!objects_ && !shapes_.empty() && shapes_.back().name.empty()) shapes_.back().name = group_;
    } else if (std::find(std::begin(kPassedOver), std::end(kPassedOver), word) == std::end(kPassedOver)) {
      return Status::Invalid("\"{}\" is no statement of an .obj file", word.substr(0, kMostQuoted));
    }
    return {};
  }

  Status ReadVertex(std::string_view line) {
    if (shapes_.empty() || (!objects_ && faces_ && !group_.empty())) shapes_.push_back({"", {}});
    faces_ = false;
    std::vector<float>& positions = shapes_.back().positions;
    if (positions.size() / 3 >= kNoIndex - 1) return Status::Invalid("there are too many vertices");
    for (int i = 0; i < 3; ++i) {
      std::string_view word = NextWord(&line);
      if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
      double value = 0;
      const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      const bool number = !word.empty() && stop == word.data() + word.size() && error == std::errc();
      const auto single = static_cast<float>(value);
      if (!number || !std::isfinite(single)) {
        return Status::Invalid("a vertex needs three finite numbers, found \"{}\"",
                               word.substr(0, kMostQuoted));
      }
      positions.push_back(single);
    }
    return {};
  }

  Result<std::vector<ObjShape>> Finish() {
    std::erase_if(shapes_, [](const ObjShape& shape) { return shape.positions.empty(); });
    if (shapes_.empty()) return Status::Invalid("has no vertices").At({path_});
    if (shapes_.size() == 1) shapes_[0].name = std::filesystem::path(path_).stem().string();
    std::set<std::string> names;
    for (const ObjShape& shape : shapes_) {
      if (!names.insert(shape.name).second)
        return Status::Invalid("two of its objects are named \"{}\"", shape.name).At({path_});
    }
    return std::move(shapes_);
  }

  const std::string& path_;
  std::vector<ObjShape> shapes_;
  std::string group_;
  bool objects_ = false;  // there are `o` lines
  bool faces_ = false;    // since the last vertex
};

}  // namespace

Result<std::vector<ObjShape>> ReadObj(const std::string& path) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kMaxObjBytes);
  if (!bytes.ok()) return bytes.status();
  return ObjReader(path).Read({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

}  // namespace kpsa::engine
