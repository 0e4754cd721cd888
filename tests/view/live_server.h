// A server in the test's own process, of a rig in a folder of its own, and what a page would ask of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "view/server.h"

namespace kpsa::engine {

struct WebAnswer {
  int status = -1;  // -1: no answer
  std::map<std::string, std::string> headers;
  std::string body;
  nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
};

// An answer of /evaluate, taken apart.
struct Evaluated {
  nlohmann::json facts;
  std::map<std::string, std::vector<float>> parts;
};
Evaluated TakeApart(const std::string& bytes);

// A subspace of scenes/hello, trained once in this process; its path.
const std::string& HelloSubspace();

class LiveServer {
 public:
  // A rig (.yaml) with the character beside it. kpsa: the subspace; "": full evaluation.
  LiveServer(const std::string& yaml, const std::string& character_name, const std::string& character,
             const std::string& kpsa = "");
  ~LiveServer();
  // scenes/hello.
  static std::unique_ptr<LiveServer> Hello(bool accelerated = false);

  const TemporaryFolder& folder() const { return folder_; }
  std::string rig() const { return folder_ / "rig.yaml"; }
  Server& server() { return *server_; }
  Session& session() { return *session_; }
  using Headers = std::map<std::string, std::string>;
  Headers Token() const { return {{"X-Kpsa-Token", server_->token()}}; }
  WebAnswer Get(const std::string& path) { return Get(path, Token()); }
  // No answer within these seconds is none.
  WebAnswer Get(const std::string& path, const Headers& headers, int seconds = 60);
  WebAnswer Post(const std::string& path, const std::string& body) { return Post(path, body, Token()); }
  WebAnswer Post(const std::string& path, const std::string& body, const Headers& headers);
  // Of a request that must be answered.
  Evaluated Evaluate(const nlohmann::json& request);
  // /events until the predicate holds of an answer; fails the test after half a minute.
  nlohmann::json WaitFor(const std::function<bool(const nlohmann::json&)>& wanted);

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<Server> server_;
  std::thread thread_;
};

// Bytes as they are, over a connection of their own; what came back until the server closed it. `ends`: no more will come,
// which the server is told.
std::string SendRaw(int port, const std::string& bytes, bool ends = false);

}  // namespace kpsa::engine
