// The rig that is viewed, while its author edits it: the last good version goes on, and what is wrong with a newer one
// is told.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/status.h"
#include "view/file_watch.h"
#include "view/live_rig.h"

namespace kpsa::engine {

class Session {
 public:
  struct State {
    std::int64_t serial = 0;       // counts changes of what follows
    std::uint64_t generation = 0;  // of the rig
    Status problems;               // of the newest version; none: all is well
    bool warnings = false;         // the newest version is shown, problems and all
  };
  // Loads the rig, and looks four times a second, on a thread of its own, whether the files that it was made of have
  // changed. Errors: those of the rig, and of its subspaces.
  static Result<std::unique_ptr<Session>> Open(LiveOptions options);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // All thread-safe. The rig stays as long as somebody holds it.
  std::shared_ptr<LiveRig> rig() const;
  // At once where the serial is another than `after`, else when it changes, or after so many seconds, or when Stop was
  // called.
  State WaitForChange(std::int64_t after, double seconds);
  void Stop();

 private:
  explicit Session(LiveOptions options) : options_(std::move(options)) {}
  void Follow();
  void Reload();

  LiveOptions options_;
  FileWatch watch_;  // of the thread that follows
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_ = false;
  std::shared_ptr<LiveRig> rig_;
  State state_;
  std::thread follower_;
};

}  // namespace kpsa::engine
