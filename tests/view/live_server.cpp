#include "tests/view/live_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstring>

#include "cli/common.h"
#include "kpsa/library.h"
#include "kpsa/rig.h"

namespace kpsa::engine {
namespace {

WebAnswer Taken(const httplib::Result& result) {
  if (!result) return {};
  WebAnswer answer{result->status, {}, result->body};
  for (const auto& [name, value] : result->headers) answer.headers[name] = value;
  return answer;
}

httplib::Headers HeadersOf(const LiveServer::Headers& headers) {
  httplib::Headers taken;
  for (const auto& [name, value] : headers) taken.emplace(name, value);
  return taken;
}

}  // namespace

Evaluated TakeApart(const std::string& bytes) {
  Evaluated evaluated;
  std::uint32_t length = 0;
  EXPECT_GE(bytes.size(), sizeof(length));
  if (bytes.size() < sizeof(length)) return evaluated;
  std::memcpy(&length, bytes.data(), sizeof(length));
  std::size_t at = (4 + length + 3) / 4 * 4;
  EXPECT_LE(at, bytes.size());
  if (at > bytes.size()) return evaluated;
  evaluated.facts = nlohmann::json::parse(bytes.substr(4, length), nullptr, false);
  EXPECT_FALSE(evaluated.facts.is_discarded()) << bytes.substr(4, length);
  if (evaluated.facts.is_discarded() || evaluated.facts["parts"].empty()) return evaluated;
  const std::size_t size = (bytes.size() - at) / evaluated.facts["parts"].size();
  for (const nlohmann::json& part : evaluated.facts["parts"]) {
    std::vector<float>& points = evaluated.parts[part.get<std::string>()];
    points.resize(size / sizeof(float));
    std::memcpy(points.data(), bytes.data() + at, size);
    at += size;
  }
  EXPECT_EQ(at, bytes.size());
  return evaluated;
}

const std::string& HelloSubspace() {
  static const TemporaryFolder folder;
  static const std::string path = [] {
    const kpsa::Result<kpsa::Rig> rig = Library().Load(KPSA_SCENES_DIR "/hello/hello.yaml");
    EXPECT_TRUE(rig) << ToText(rig.problems());
    TrainingOptions options;
    options.samples = 600;
    options.calibration = 400;
    options.tolerance = 2e-3;
    const auto report = rig->Train(options, folder / "hello.kpsa");
    EXPECT_TRUE(report) << ToText(report.problems());
    return folder / "hello.kpsa";
  }();
  return path;
}

LiveServer::LiveServer(const std::string& yaml, const std::string& character_name,
                       const std::string& character, const std::string& kpsa) {
  folder_.Write(character_name, character);
  Flags flags;
  flags.file = folder_.Write("rig.yaml", yaml);
  flags.rest = true;
  LiveOptions options;
  options.opener = OpenerOf(flags);
  if (!kpsa.empty()) {
    options.acceleration.emplace();
    options.acceleration->subspace = kpsa;
  }
  Result<std::unique_ptr<Session>> session = Session::Open(std::move(options));
  EXPECT_TRUE(session.ok()) << session.status().ToString();
  if (!session.ok()) return;
  session_ = std::move(*session);
  Result<std::unique_ptr<Server>> server = Server::Open(session_.get(), 0);
  EXPECT_TRUE(server.ok()) << server.status().ToString();
  if (!server.ok()) return;
  server_ = std::move(*server);
  thread_ = std::thread([this] { server_->Listen(); });
}

LiveServer::~LiveServer() {
  if (server_ == nullptr) return;
  while (Get("/meta.json").status == -1) std::this_thread::yield();  // it listens by now
  server_->Stop();
  thread_.join();
}

std::unique_ptr<LiveServer> LiveServer::Hello(bool accelerated) {
  const std::string scenes = KPSA_SCENES_DIR "/hello/";
  return std::make_unique<LiveServer>(TemporaryFolder::Read(scenes + "hello.yaml"), "hello.glb",
                                      TemporaryFolder::Read(scenes + "hello.glb"),
                                      accelerated ? HelloSubspace() : "");
}

WebAnswer LiveServer::Get(const std::string& path, const Headers& headers, int seconds) {
  httplib::Client client("127.0.0.1", server_->port());
  client.set_read_timeout(seconds);
  return Taken(client.Get(path, HeadersOf(headers)));
}

WebAnswer LiveServer::Post(const std::string& path, const std::string& body, const Headers& headers) {
  httplib::Client client("127.0.0.1", server_->port());
  client.set_read_timeout(60);
  return Taken(client.Post(path, HeadersOf(headers), body, "application/json"));
}

Evaluated LiveServer::Evaluate(const nlohmann::json& request) {
  const WebAnswer answer = Post("/evaluate", request.dump());
  EXPECT_EQ(answer.status, 200) << answer.body.substr(0, 500);
  return answer.status == 200 ? TakeApart(answer.body) : Evaluated();
}

nlohmann::json LiveServer::WaitFor(const std::function<bool(const nlohmann::json&)>& wanted) {
  const auto begin = std::chrono::steady_clock::now();
  nlohmann::json state = {{"serial", -1}};
  while (std::chrono::steady_clock::now() - begin < std::chrono::seconds(30)) {
    state = Get("/events?after=" + state["serial"].dump()).json();
    if (state.is_object() && wanted(state)) return state;
    if (!state.is_object()) break;
  }
  ADD_FAILURE() << "waited in vain: " << state.dump();
  return state;
}

std::string SendRaw(int port, const std::string& bytes, bool ends) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t sent = ::send(socket, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (sent <= 0) break;
      at += static_cast<std::size_t>(sent);
    }
    if (ends) ::shutdown(socket, SHUT_WR);
    char buffer[4096];
    for (ssize_t got; (got = ::recv(socket, buffer, sizeof(buffer), 0)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(got));
  }
  ::close(socket);
  return answer;
}

}  // namespace kpsa::engine
