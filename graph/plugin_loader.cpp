#include "graph/plugin_loader.h"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "base/thrown.h"
#include "graph/plugin.h"

namespace kpsa::engine {
namespace {

// What the system says, without the path that begins it.
std::string LoadError(const std::string& path) {
  const char* said = ::dlerror();
  std::string text = said == nullptr ? "unknown reason" : said;
  if (text.starts_with(path + ": ")) text.erase(0, path.size() + 2);
  return text;
}

// The system's loader maps what the headers of a library promise and dies of a file that was cut short.
// Whatever else is wrong it tells by itself.
Status CheckComplete(const std::string& path, std::uint64_t size) {
  std::ifstream file(path, std::ios::binary);
  ElfW(Ehdr) header;
  if (!file.read(reinterpret_cast<char*>(&header), sizeof(header)) ||
      std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_phentsize != sizeof(ElfW(Phdr)))
    return Status();
  std::uint64_t needed = 0;
  for (int i = 0; i < header.e_phnum; ++i) {
    ElfW(Phdr) segment;
    file.seekg(static_cast<std::streamoff>(header.e_phoff + static_cast<std::uint64_t>(i) * sizeof(segment)));
    if (!file.read(reinterpret_cast<char*>(&segment), sizeof(segment)))
      return Status::Invalid("its headers are cut short");
    if (segment.p_type != PT_LOAD) continue;
    if (segment.p_filesz > size || segment.p_offset > size - segment.p_filesz)
      needed = std::max<std::uint64_t>(needed, segment.p_filesz > ~segment.p_offset
                                                   ? ~std::uint64_t{0}
                                                   : segment.p_offset + segment.p_filesz);
  }
  if (needed > size) return Status::Invalid("it has {} bytes of at least {}", size, needed);
  return Status();
}

template <typename Function>
Function* FindFunction(void* library, const char* name) {
  return reinterpret_cast<Function*>(::dlsym(library, name));
}

}  // namespace

void PluginLoader::RefuseOthers(std::string reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  refusal_ = std::move(reason);
}

Status PluginLoader::Load(const std::string& path) {
  std::error_code failed;
  const std::filesystem::path canonical = std::filesystem::canonical(path, failed);
  if (failed) return Status::Invalid("plugin \"{}\": {}", path, failed.message());
  if (!std::filesystem::is_regular_file(canonical, failed))
    return Status::Invalid("plugin \"{}\": expected a shared library, found no regular file", path);
  const std::string identity = canonical.string();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (std::find(loaded_.begin(), loaded_.end(), identity) != loaded_.end()) return Status();
  if (!refusal_.empty()) return Status::Invalid("plugin \"{}\" is not loaded: {}", path, refusal_);

  const std::uint64_t size = std::filesystem::file_size(canonical, failed);
  if (const Status complete = failed ? Status() : CheckComplete(identity, size); !complete.ok())
    return Status::Invalid("plugin \"{}\" cannot be loaded: {}; expected a shared library of nodes", path,
                           complete.errors().front().message);

  // This code may be in a library that was loaded for its loader alone (a Python module): plugins look for its
  // symbols among those of all
  static const char here = 0;
  if (Dl_info own; ::dladdr(&here, &own) != 0 && own.dli_fname != nullptr)
    (void)::dlopen(own.dli_fname, RTLD_NOW | RTLD_NOLOAD | RTLD_GLOBAL);
  void* const library = ::dlopen(identity.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    return Status::Invalid("plugin \"{}\" cannot be loaded: {}; expected a shared library of nodes", path,
                           LoadError(identity));
  const auto abi = FindFunction<int()>(library, "kpsa_plugin_abi");
  const auto add = FindFunction<void(NodeRegistry&)>(library, "kpsa_register");
  if (abi == nullptr || add == nullptr)
    return Status::Invalid("plugin \"{}\" exports no {}: expected a library that says KPSA_PLUGIN", path,
                           abi == nullptr ? "kpsa_plugin_abi" : "kpsa_register");
  if (const int version = abi(); version != kPluginAbi)
    return Status::Invalid(
        "plugin \"{}\" is of ABI version {}, expected {}: compile it with the headers of this kpsa", path,
        version, kPluginAbi);

  NodeRegistry added;
  try {
    add(added);
  } catch (...) {
    return Status::Invalid("plugin \"{}\" failed to register its node types: {}", path, ThrownText());
  }
  KPSA_RETURN_IF_ERROR(Add(std::move(added), path));
  loaded_.push_back(identity);
  return Status();
}

Status PluginLoader::Add(NodeRegistry&& added) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return Add(std::move(added), "");
}

Status PluginLoader::Add(NodeRegistry&& added, const std::string& of) {
  const std::string begin = of.empty() ? "" : fmt::format("plugin \"{}\"", of);
  if (const Status problems = added.status(); !problems.ok()) {
    Status refused;
    for (const Error& error : problems.errors())
      refused.Append(Status::Invalid("{}{}{}", begin, of.empty() ? "" : ": ", error.message));
    return refused;
  }
  for (const std::string& name : added.Names()) {
    if (registry_->Find(name) == nullptr) continue;
    const auto from = origin_.find(name);
    return Status::Invalid("{} the node type \"{}\", which {} has already; expected a new name",
                           of.empty() ? "the program adds" : begin + " registers", name,
                           from == origin_.end()  ? "kpsa itself"
                           : from->second.empty() ? "the program"
                                                  : fmt::format("plugin \"{}\"", from->second));
  }
  for (const std::string& name : added.Names()) origin_[name] = of;
  registry_->Take(std::move(added));
  return Status();
}

}  // namespace kpsa::engine
