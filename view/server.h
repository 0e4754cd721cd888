// The door to cpp-httplib: serves a session to a page on this machine (docs/viewer-data.md, "The live server").
//
// Whoever asks has to know the token, and to have asked for 127.0.0.1 or localhost: other people's pages in the same
// browser do not know the one, and pages of names that are made to mean this machine do not have the other.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "base/status.h"
#include "view/session.h"

namespace kpsa::engine {

class Server {
 public:
  // On 127.0.0.1 alone; port 0: any free one. The session outlives the server. Errors: a port that is taken.
  static Result<std::unique_ptr<Server>> Open(Session* session, int port);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const;
  const std::string& token() const;  // 32 hexadecimal digits, new for every server
  std::string address() const;       // "http://127.0.0.1:PORT/?token=T"
  void Listen();                     // until Stop is called, on any thread

  // Ends Listen, and the waiting of those who wait for changes.
  void Stop();

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

inline constexpr std::size_t kMaxBody = 1 << 20;  // bytes of a request

}  // namespace kpsa::engine
