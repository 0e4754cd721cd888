#include "view/session.h"

#include <chrono>
#include <utility>

#include "base/thrown.h"

namespace kpsa::engine {
namespace {

constexpr std::chrono::milliseconds kLookEvery{250};

// Loading runs beside the server, where nobody catches what escapes.
Result<std::shared_ptr<LiveRig>> LoadOrTell(const LiveOptions& options, std::uint64_t generation) {
  try {
    return LiveRig::Load(options, generation, true);
  } catch (...) {
    return Status::Invalid("{}", ThrownText()).At({options.opener.path});
  }
}

}  // namespace

Result<std::unique_ptr<Session>> Session::Open(LiveOptions options) {
  std::unique_ptr<Session> session(new Session(std::move(options)));
  session->watch_.Add({session->options_.opener.path});
  Result<std::shared_ptr<LiveRig>> rig = LiveRig::Load(session->options_, 1, false);
  if (!rig.ok()) return rig.status();
  session->rig_ = std::move(*rig);
  session->state_.generation = 1;
  session->watch_.Add(session->rig_->files());
  session->follower_ = std::thread([raw = session.get()] { raw->Follow(); });
  return session;
}

Session::~Session() {
  Stop();
  if (follower_.joinable()) follower_.join();
}

void Session::Stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  stop_ = true;
  changed_.notify_all();
}

std::shared_ptr<LiveRig> Session::rig() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return rig_;
}

Session::State Session::WaitForChange(std::int64_t after, double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                    [&] { return stop_ || state_.serial != after; });
  return state_;
}

void Session::Follow() {
  bool changing = false;
  std::unique_lock<std::mutex> lock(mutex_);
  while (!changed_.wait_for(lock, kLookEvery, [&] { return stop_; })) {
    lock.unlock();
    // What changes from look to look is still being written
    if (watch_.Look())
      changing = true;
    else if (std::exchange(changing, false))
      Reload();
    lock.lock();
  }
}

void Session::Reload() {
  const Result<std::shared_ptr<LiveRig>> loaded = LoadOrTell(options_, rig()->generation() + 1);
  if (loaded.ok()) {
    watch_.Keep((*loaded)->files());
  } else {
    // A file that is not there yet, or is of no rig that was loaded
    for (const Error& error : loaded.status().errors()) watch_.Add({error.where.file});
  }
  std::shared_ptr<LiveRig> before;  // goes after the lock
  const std::lock_guard<std::mutex> lock(mutex_);
  ++state_.serial;
  state_.problems = loaded.ok() ? (*loaded)->warning() : loaded.status();
  state_.warnings = loaded.ok();
  if (!loaded.ok()) return changed_.notify_all();
  before = std::exchange(rig_, *loaded);
  state_.generation = rig_->generation();
  changed_.notify_all();
}

}  // namespace kpsa::engine
