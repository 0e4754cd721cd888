// Where results go: a file chosen by its suffix, or stdout. Everything that can be refused is refused before
// any work: an existing file without --force, a folder, a place that cannot be written, an output that is an
// input.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "files/suffix.h"

namespace kpsa::engine {

// All refusals for an output at `path` with one of the suffixes (".npz", ...; empty: any). "-" is stdout and
// passes.
Status CheckOutput(const std::string& path, bool force, const std::vector<std::string>& suffixes);
// Refuses an output that is one of the inputs, also under another name.
Status CheckNotInput(const std::string& path, std::span<const std::string> inputs);

// A path for a writer that wants one: the output itself, or for "-" a temporary file whose bytes Finish
// copies to stdout. The temporary file is removed in any case.
class OutputPath {
 public:
  static Result<OutputPath> Create(const std::string& output);
  OutputPath(OutputPath&& other) noexcept;
  OutputPath& operator=(OutputPath&&) = delete;
  OutputPath(const OutputPath&) = delete;
  ~OutputPath();
  const std::string& path() const { return path_; }
  bool is_stdout() const { return stdout_; }
  Status Finish();

 private:
  OutputPath() = default;
  std::string path_;
  bool stdout_ = false;
};

// Writes text to the output, "-" being stdout.
Status WriteText(const std::string& output, bool force, const std::string& text);

}  // namespace kpsa::engine
