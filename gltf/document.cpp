#include "gltf/document.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <limits>

#include "files/file.h"
#include "files/json_depth.h"
#include "files/trusted_folders.h"

namespace kpsa::engine::gltf {
namespace {

constexpr std::uint64_t kLargestJson = std::uint64_t{512} << 20;

std::uint32_t ReadUint32(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return bytes[offset] | bytes[offset + 1] << 8 | bytes[offset + 2] << 16 |
         static_cast<std::uint32_t>(bytes[offset + 3]) << 24;
}

int HexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// %XX sequences; a stray % stays as it is.
std::string PercentDecoded(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexValue(text[i + 1]) >= 0 && HexValue(text[i + 2]) >= 0) {
      decoded += static_cast<char>(16 * HexValue(text[i + 1]) + HexValue(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

int Base64Value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

bool HasScheme(std::string_view uri) {
  const std::size_t colon = uri.find_first_of(":/?#");
  return colon != std::string_view::npos && colon > 0 && uri[colon] == ':';
}

// Schemes are written in either case (RFC 3986, 3.1).
bool HasPrefixIgnoringCase(std::string_view text, std::string_view prefix) {
  return text.size() >= prefix.size() &&
         std::equal(prefix.begin(), prefix.end(), text.begin(),
                    [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

std::string Shortened(const std::string& text) {
  return text.size() <= 80 ? text : text.substr(0, 77) + "...";
}

Result<std::vector<std::uint8_t>> LoadBuffer(const BufferSource& source, bool is_first,
                                             const Container& container, const std::string& folder) {
  std::vector<std::uint8_t> bytes;
  if (source.is_fallback) return bytes;
  if (source.has_uri) {
    Result<std::vector<std::uint8_t>> read = ReadUri(source.uri, folder, kLargestFile);
    if (!read.ok()) return read.status();
    bytes = std::move(*read);
  } else if (is_first && container.is_binary) {
    bytes.assign(container.binary.begin(), container.binary.end());
  } else {
    return bytes;  // data of an extension; an error only where it is read
  }
  if (bytes.size() < source.byte_length) {
    return Status::Invalid("holds {} bytes, byteLength says {}", bytes.size(), source.byte_length);
  }
  bytes.resize(static_cast<std::size_t>(source.byte_length));
  return bytes;
}

// Nothing is left in the text that would make tinygltf look at a file; should it try, it finds none.
tinygltf::FsCallbacks NoFiles() {
  tinygltf::FsCallbacks callbacks = {};
  callbacks.FileExists = [](const std::string&, void*) { return false; };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&, void*) {
    return false;
  };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  return callbacks;
}

bool SkipImage(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int,
               void*) {
  return true;
}

Status ParseModel(const std::string& text, tinygltf::Model* model) {
  std::string error, warning;
  try {
    tinygltf::TinyGLTF loader;
    loader.SetFsCallbacks(NoFiles());
    loader.SetImageLoader(&SkipImage, nullptr);
    if (loader.LoadASCIIFromString(model, &error, &warning, text.data(), static_cast<unsigned>(text.size()),
                                   "")) {
      return {};
    }
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  for (char& c : error) {
    if (c == '\n') c = ' ';
  }
  while (!error.empty() && error.back() == ' ') error.pop_back();
  return Status::Invalid("is no valid glTF: {}", error);
}

}  // namespace

Status Budget::TakeMemory(std::uint64_t bytes, const std::string& what) {
  if (bytes > memory) {
    return Status::Invalid("{} would need {} bytes, far more than the file's own data can fill", what, bytes);
  }
  memory -= bytes;
  return {};
}

Status Budget::TakeWork(std::uint64_t bytes, const std::string& what) {
  if (bytes > work) {
    return Status::Invalid("{} would decode {} bytes more, far more than the file's own data", what, bytes);
  }
  work -= bytes;
  return {};
}

Result<Container> SplitContainer(std::span<const std::uint8_t> bytes) {
  Container container;
  if (bytes.size() < 4 || std::memcmp(bytes.data(), "glTF", 4) != 0) {
    std::size_t i = bytes.size() >= 3 && bytes[0] == 0xef && bytes[1] == 0xbb && bytes[2] == 0xbf ? 3 : 0;
    while (i < bytes.size() && (bytes[i] == ' ' || bytes[i] == '\t' || bytes[i] == '\n' || bytes[i] == '\r'))
      ++i;
    if (bytes.empty()) return Status::Invalid("is empty, expected glTF");
    if (i == bytes.size() || bytes[i] != '{') {
      return Status::Invalid(
          "is no glTF file: it starts neither with \"glTF\" (.glb) nor with a brace (.gltf)");
    }
    container.json = bytes;
    return container;
  }
  container.is_binary = true;
  if (bytes.size() < 12) return Status::Invalid("is truncated: {} bytes, a .glb header has 12", bytes.size());
  if (const std::uint32_t version = ReadUint32(bytes, 4); version != 2) {
    return Status::Invalid("is a .glb container of version {}, expected 2", version);
  }
  if (const std::uint32_t length = ReadUint32(bytes, 8); length != bytes.size()) {
    return Status::Invalid("is {}: its header says {} bytes, it has {}",
                           length > bytes.size() ? "truncated" : "damaged", length, bytes.size());
  }
  bool has_json = false, has_binary = false;
  for (std::size_t offset = 12; offset < bytes.size();) {
    if (bytes.size() - offset < 8)
      return Status::Invalid("is damaged: a .glb chunk header is cut at byte {}", offset);
    const std::uint32_t length = ReadUint32(bytes, offset), type = ReadUint32(bytes, offset + 4);
    offset += 8;
    if (length > bytes.size() - offset) {
      return Status::Invalid("is damaged: the .glb chunk at byte {} says {} bytes, {} are left", offset - 8,
                             length, bytes.size() - offset);
    }
    if (type == 0x4e4f534a && !has_json) {
      container.json = bytes.subspan(offset, length);
      has_json = true;
    } else if (type == 0x004e4942 && !has_binary) {
      container.binary = bytes.subspan(offset, length);
      has_binary = true;
    }
    if (!has_json) return Status::Invalid("is damaged: the first .glb chunk must be JSON");
    offset += length;
  }
  if (!has_json) return Status::Invalid("is damaged: a .glb file without a JSON chunk");
  return container;
}

Result<std::vector<std::uint8_t>> DecodeDataUri(const std::string& uri) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos) return Status::Invalid("the data URI has no comma");
  const std::string_view header = std::string_view(uri).substr(0, comma),
                         data = std::string_view(uri).substr(comma + 1);
  std::vector<std::uint8_t> bytes;
  if (!header.ends_with(";base64")) {
    const std::string decoded = PercentDecoded(data);
    bytes.assign(decoded.begin(), decoded.end());
    return bytes;
  }
  bytes.reserve(data.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (std::size_t i = 0; i < data.size() && data[i] != '='; ++i) {
    const int value = Base64Value(data[i]);
    if (value < 0)
      return Status::Invalid("the data URI has an invalid base64 character at byte {}", comma + 1 + i);
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    if (++count % 4 != 0) continue;
    bytes.insert(bytes.end(), {static_cast<std::uint8_t>(bits >> 16), static_cast<std::uint8_t>(bits >> 8),
                               static_cast<std::uint8_t>(bits)});
  }
  if (count % 4 == 1) return Status::Invalid("the data URI's base64 text is cut");
  if (count % 4 == 2) bytes.push_back(static_cast<std::uint8_t>(bits >> 4));
  if (count % 4 == 3) {
    bytes.insert(bytes.end(), {static_cast<std::uint8_t>(bits >> 10), static_cast<std::uint8_t>(bits >> 2)});
  }
  return bytes;
}

Result<std::string> RelativePathOfUri(const std::string& uri) {
  if (HasScheme(uri)) {
    return Status::Invalid(
        "\"{}\" is no relative URI; only files in the document's folder and data URIs are read",
        Shortened(uri));
  }
  const std::string path = PercentDecoded(uri);
  if (path.empty()) return Status::Invalid("the URI is empty");
  if (path.find('\0') != std::string::npos) return Status::Invalid("the URI holds a zero byte");
  const std::filesystem::path normal = std::filesystem::path(path).lexically_normal();
  if (normal.is_absolute() || *normal.begin() == "..") {
    return Status::Invalid("\"{}\" leaves the document's folder; move the file beside the document",
                           Shortened(uri));
  }
  return normal.string();
}

Result<std::vector<std::uint8_t>> ReadUri(const std::string& uri, const std::string& folder,
                                          std::uint64_t most) {
  if (HasPrefixIgnoringCase(uri, "data:")) return DecodeDataUri(uri);
  const Result<std::string> relative = RelativePathOfUri(uri);
  if (!relative.ok()) return relative.status();
  const std::string path = (std::filesystem::path(folder) / *relative).string();
  TrustedFolders beside;
  beside.Add(folder);
  if (!beside.Hold(path)) {
    return Status::Invalid("\"{}\" leaves the document's folder by a symbolic link; move the file there",
                           Shortened(uri));
  }
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error))
    return Status::Invalid("\"{}\" is not a file", Shortened(uri));
  Result<std::vector<std::uint8_t>> read = ReadFileBytes(path, most);
  if (!read.ok()) return Status::Invalid("\"{}\" {}", Shortened(uri), read.status().errors().front().message);
  return read;
}

Result<Document> LoadDocument(std::span<const std::uint8_t> bytes, const std::string& folder) {
  Result<Container> container = SplitContainer(bytes);
  if (!container.ok()) return container.status();
  if (container->json.size() > kLargestJson) {
    return Status::Invalid("has {} bytes of JSON, at most {} are read", container->json.size(), kLargestJson);
  }
  KPSA_RETURN_IF_ERROR(CheckJsonDepth(container->json));
  Result<ReducedJson> reduced = ReduceJson(container->json);
  if (!reduced.ok()) return reduced.status();

  Document document;
  auto model = std::make_shared<tinygltf::Model>();
  KPSA_RETURN_IF_ERROR(ParseModel(reduced->text, model.get()));
  document.target_names = std::move(reduced->target_names);
  document.no_view = reduced->no_view;
  document.hidden = std::move(reduced->hidden);
  document.vrm = std::move(reduced->vrm);
  document.warnings = std::move(reduced->warnings);
  std::uint64_t total = bytes.size();
  for (std::size_t i = 0; i < reduced->buffers.size(); ++i) {
    Result<std::vector<std::uint8_t>> buffer = LoadBuffer(reduced->buffers[i], i == 0, *container, folder);
    if (!buffer.ok()) {
      return Status::Invalid("buffers[{}]: {}", i, buffer.status().errors().front().message);
    }
    total += buffer->size();
    if (total > kLargestFile) return Status::Invalid("has more than {} bytes of buffers", kLargestFile);
    document.buffers.push_back(std::move(*buffer));
  }
  document.budget.memory = (std::uint64_t{256} << 20) + 32 * total;
  document.budget.work = (std::uint64_t{4} << 30) + 64 * total;
  KPSA_RETURN_IF_ERROR(Decompress(reduced->meshopt, reduced->draco, model.get(), &document));
  document.model = std::move(model);
  return document;
}

Result<Character> LoadGltfFromMemory(std::span<const std::uint8_t> bytes, const std::string& folder,
                                     const std::string& name) {
  const auto located = [&](Status status) { return std::move(status).At({name}); };
  try {
    Result<Document> document = LoadDocument(bytes, folder);
    if (!document.ok()) return located(document.status());
    Character character;
    character.path = name;
    for (const auto read : {&ReadMeshes, &ReadScene, &ReadSkins, &ReadClips, &ReadVrm}) {
      if (Status status = read(*document, &character); !status.ok()) return located(std::move(status));
    }
    for (Index m = 0; m < character.materials.size(); ++m)
      character.materials[m].file = name, character.materials[m].index = m;
    return character;
  } catch (const std::bad_alloc&) {
    return located(Status::Invalid("does not fit into memory"));
  } catch (const std::length_error&) {
    return located(Status::Invalid("does not fit into memory"));
  }
}

Result<Character> LoadGltf(const std::string& path) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestFile);
  if (!bytes.ok()) return bytes.status();
  return LoadGltfFromMemory(*bytes, std::filesystem::path(path).parent_path().string(), path);
}

}  // namespace kpsa::engine::gltf
