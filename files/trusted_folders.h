// Which files may be opened because another file names them: those within folders that are trusted, wherever `..` and
// symbolic links lead. Who can write into a trusted folder while files are looked at and opened can still swap a link
// in between; nothing here is against that.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

// A file of this name, whatever it holds, makes its folder a project: rigs below may name all that is in it.
inline constexpr const char* kProjectFile = "kpsa.project";

class TrustedFolders {
 public:
  TrustedFolders() = default;  // none
  // Those of a rig, or of a part or a character that is opened by itself: its folder, the innermost project around
  // that, `others`, and the folders of KPSA_TRUST, written as in PATH, as far as they are there. Errors, of usage: one
  // of `others` is no folder. `word`: what messages call that one names such a folder with.
  static Result<TrustedFolders> OfRig(const std::string& path, const std::vector<std::string>& others,
                                      const std::string& word = "trust");

  // False where it is no folder that can be looked into; "" is the current one.
  bool Add(const std::string& folder);
  // Whether what the path leads to, which need not be there yet, is within one of them. Not where a link
  // leads nowhere.
  bool Hold(const std::string& path) const;
  // The path, or why it may not be opened: it leads out of the folders. An error without a place.
  Result<std::string> Check(std::string path) const;

 private:
  std::vector<std::string> folders_;  // without links, the rig's own first
  std::string word_;
};

// Without links and `..`, as far as it is there; nothing where a link leads nowhere, or a zero byte is in it.
std::optional<std::string> WithoutLinksAndDots(const std::string& path);

}  // namespace kpsa::engine
