#include "view/server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <exception>
#include <optional>

#include "report/viewer_page.h"
#include "view/answers.h"
#include "view/token.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kThreads = 24;  // a waiting page takes one, and each idle connection of a browser
constexpr char kPolicy[] =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// The body is shared, and goes out as it is: nothing is compressed on the way to the same machine.
void Send(const Answer& answer, httplib::Response* response) {
  response->status = answer.status;
  const std::shared_ptr<const std::string> body = answer.body;
  response->set_content_provider(body->size(), answer.type,
                                 [body](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                   return sink.write(body->data() + offset, length);
                                 });
}

}  // namespace

struct Server::Impl {
  Session* session = nullptr;
  httplib::Server http;
  std::string token, host, local_host;  // "127.0.0.1:PORT", "localhost:PORT"
  int port = 0;
  std::shared_ptr<const std::string> page;

  bool IsAllowed(const httplib::Request& request) const {
    if (request.get_header_value_count("Host") != 1) return false;
    const std::string asked = request.get_header_value("Host");
    if (asked != host && asked != local_host) return false;
    if (request.path == "/")
      return request.get_param_value_count("token") == 1 &&
             SameToken(request.get_param_value("token"), token);
    return request.get_header_value_count("X-Kpsa-Token") == 1 &&
           SameToken(request.get_header_value("X-Kpsa-Token"), token);
  }

  // Of requests without a body, and of those that are refused whatever their body is. None: it has to be read.
  std::optional<Answer> AnswerAtOnce(const httplib::Request& request) const {
    if (!IsAllowed(request))
      return Refusal(403, Status::Usage("not allowed: expected the address that kpsa view printed"));
    if (request.has_header("Range")) return Refusal(400, Status::Usage("everything is sent as a whole"));
    const bool get = request.method == "GET" || request.method == "HEAD";
    if (request.method == "POST") return std::nullopt;
    if (!get) return Refusal(405, Status::Usage("expected GET or POST"));
    if (request.path == "/") return Answer{200, "text/html; charset=utf-8", page};
    const char* const key = request.path == "/events" ? "after" : "vertex";
    return AnswerGet(session, request.path, request.get_param_value(key));
  }

  void Set() {
    http.set_default_headers({{"Cache-Control", "no-store"},
                              {"X-Content-Type-Options", "nosniff"},
                              {"X-Frame-Options", "DENY"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Content-Security-Policy", kPolicy}});
    http.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      const std::optional<Answer> answer = AnswerAtOnce(request);
      if (!answer.has_value()) return httplib::Server::HandlerResponse::Unhandled;
      Send(*answer, &response);
      return httplib::Server::HandlerResponse::Handled;
    });
    for (const char* path : {"/evaluate", "/pose-file"}) {
      http.Post(path, [this](const httplib::Request& request, httplib::Response& response,
                             const httplib::ContentReader& read) {
        std::string body;
        bool large = false;
        // However it is encoded, no more than this is kept
        const bool whole = read([&](const char* data, std::size_t size) {
          large = large || body.size() + size > kMaxBody;
          if (!large) body.append(data, size);
          return !large;
        });
        if (large || response.status == 413)
          Send(Refusal(413, Status::Usage("expected at most {} bytes", kMaxBody)), &response);
        else if (!whole)
          Send(Refusal(400, Status::Usage("the request has no end")), &response);
        else
          Send(AnswerPost(session, request.path, body), &response);
      });
    }
    // What the library refuses itself, and what escapes
    http.set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (response.content_length_ == 0 && response.body.empty())
        Send(Refusal(response.status, Status::Usage("no such request")), &response);
    });
    http.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      Send(Refusal(500, Status::Evaluation("the request failed")), &response);
    });
    http.set_payload_max_length(kMaxBody);
    http.set_tcp_nodelay(true);
    http.set_keep_alive_max_count(1'000'000);
    http.set_read_timeout(5);
    http.set_write_timeout(20);
    http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    // The library's own options let another program listen on the same port
    http.set_socket_options([](int socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    });
  }
};

Result<std::unique_ptr<Server>> Server::Open(Session* session, int port) {
  auto impl = std::make_unique<Impl>();
  impl->session = session;
  impl->Set();
  if (port == 0)
    impl->port = impl->http.bind_to_any_port("127.0.0.1");
  else
    impl->port = impl->http.bind_to_port("127.0.0.1", port) ? port : -1;
  if (impl->port <= 0)
    return Status::Usage("port {} of 127.0.0.1 is taken, or not allowed: expected another, or none", port);
  impl->token = NewToken();
  impl->host = fmt::format("127.0.0.1:{}", impl->port);
  impl->local_host = fmt::format("localhost:{}", impl->port);
  impl->page = std::make_shared<const std::string>(ViewerPage());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() { Stop(); }
int Server::port() const { return impl_->port; }
const std::string& Server::token() const { return impl_->token; }
std::string Server::address() const { return fmt::format("http://{}/?token={}", impl_->host, impl_->token); }
void Server::Listen() { impl_->http.listen_after_bind(); }

void Server::Stop() {
  impl_->session->Stop();
  impl_->http.stop();
}

}  // namespace kpsa::engine
