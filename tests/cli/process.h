// Runs the kpsa program as a user does, or lines of shell, and gives what was printed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kpsa::engine {

inline const std::string kHello = KPSA_SCENES_DIR "/hello/hello.yaml";
inline const std::string kHelloGlb = KPSA_SCENES_DIR "/hello/hello.glb";

struct ProcessResult {
  int exit_code = -1;  // 128 + signal where one ended it; -1: it ran longer than the limit and was ended
  std::string out, err;
  std::uint64_t peak_bytes = 0;  // of memory
  std::size_t error_lines() const;
};

// limit_seconds: of processor time, or twenty times as long by the clock. Without a terminal; `environment` entries
// ("NO_COLOR=1") are added to the test's.
ProcessResult RunKpsa(const std::vector<std::string>& arguments, double limit_seconds = 60,
                      const std::string& folder = "", const std::vector<std::string>& environment = {});
// A line of shell, as /bin/sh runs it in the folder; its processor time is not that of what it starts.
ProcessResult RunShell(const std::string& line, double limit_seconds, const std::string& folder);
// Starts it, sends the signal (SIGINT) after the delay and once there is a file in the folder `where`, and waits.
ProcessResult RunKpsaInterrupted(const std::vector<std::string>& arguments, double delay_seconds,
                                 int signal = 2, const std::string& where = "");

}  // namespace kpsa::engine
