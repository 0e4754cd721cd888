// Who is answered: nobody without the token, nobody who asked for another host, and no bytes do harm.
#include <gtest/gtest.h>

#include "tests/view/live_server.h"
#include "view/token.h"

namespace kpsa::engine {
namespace {

TEST(Door, NobodyIsAnsweredWithoutTheToken) {
  const auto live = LiveServer::Hello();
  const std::string token = live->server().token();
  EXPECT_EQ(token.size(), 32u);
  for (const char* path :
       {"/meta.json", "/blob/rest", "/events?after=-1", "/explain?vertex=0", "/nothing", "/"}) {
    EXPECT_EQ(live->Get(path, {}).status, 403) << path;
    EXPECT_EQ(live->Get(path, {{"X-Kpsa-Token", std::string(32, '0')}}).status, 403) << path;
    EXPECT_EQ(live->Get(path, {{"X-Kpsa-Token", token.substr(1)}}).status, 403) << path;
  }
  EXPECT_EQ(live->Post("/evaluate", "{}", {}).status, 403);
  EXPECT_EQ(live->Post("/pose-file", "{}", {}).status, 403);
  EXPECT_EQ(live->Get("/meta.json").status, 200);
  EXPECT_EQ(live->Get("/nothing").status, 404);
  // The page alone takes it from the address, and only there
  EXPECT_EQ(live->Get("/?token=" + token, {}).status, 200);
  EXPECT_EQ(live->Get("/?token=" + token + "&token=x", {}).status, 403);
  EXPECT_EQ(live->Get("/meta.json?token=" + token, {}).status, 403);
  EXPECT_EQ(live->server().address(),
            "http://127.0.0.1:" + std::to_string(live->server().port()) + "/?token=" + token);
}

TEST(Door, TokensAreNewAndComparedAsAWhole) {
  EXPECT_NE(NewToken(), NewToken());
  EXPECT_TRUE(SameToken("abc", "abc"));
  EXPECT_FALSE(SameToken("abc", "abd"));
  EXPECT_FALSE(SameToken("abc", "ab"));
  EXPECT_FALSE(SameToken("", "a"));
}

TEST(Door, AHostOfAnotherNameIsRefused) {
  const auto live = LiveServer::Hello();
  const std::string port = std::to_string(live->server().port());
  const auto status = [&](const std::string& hosts) {
    const std::string answer = SendRaw(live->server().port(), "GET /meta.json HTTP/1.1\r\n" + hosts +
                                                                  "X-Kpsa-Token: " + live->server().token() +
                                                                  "\r\nConnection: close\r\n\r\n");
    return answer.substr(0, answer.find('\r'));
  };
  EXPECT_EQ(status("Host: 127.0.0.1:" + port + "\r\n"), "HTTP/1.1 200 OK");
  EXPECT_EQ(status("Host: localhost:" + port + "\r\n"), "HTTP/1.1 200 OK");
  for (const std::string& hosts : {std::string("Host: evil.example\r\n"),
                                   "Host: evil.example:" + port + "\r\n", std::string("Host: 127.0.0.1\r\n"),
                                   std::string(), "Host: localhost:" + port + "\r\nHost: evil.example\r\n"})
    EXPECT_EQ(status(hosts), "HTTP/1.1 403 Forbidden") << hosts;
}

TEST(Door, EveryAnswerSaysWhatBrowsersMayDoWithIt) {
  const auto live = LiveServer::Hello();
  for (const WebAnswer& answer : {live->Get("/?token=" + live->server().token()), live->Get("/meta.json"),
                                  live->Get("/blob/none"), live->Get("/meta.json", {})}) {
    const auto header = [&](const char* name) {
      const auto at = answer.headers.find(name);
      return at == answer.headers.end() ? "" : at->second;
    };
    EXPECT_EQ(header("Cache-Control"), "no-store");
    EXPECT_EQ(header("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(header("Referrer-Policy"), "no-referrer");
    const std::string policy = header("Content-Security-Policy");
    EXPECT_NE(policy.find("default-src 'none'"), std::string::npos) << policy;
    EXPECT_NE(policy.find("connect-src 'self'"), std::string::npos) << policy;
    EXPECT_EQ(header("Access-Control-Allow-Origin"), "");
    EXPECT_EQ(header("Content-Encoding"), "");
  }
  EXPECT_NE(live->Get("/?token=" + live->server().token()).body.find("<!--kpsa:data-->"), std::string::npos);
}

TEST(Door, NoPathReachesAFile) {
  const auto live = LiveServer::Hello();
  for (const char* path :
       {"/blob/../rig.yaml", "/blob/..%2frig.yaml", "/blob//etc/passwd", "/field/%00", "/blob/",
        "/field/joint:nobody", "/field/", "/../../etc/passwd", "/blob/%2e%2e/%2e%2e/etc/passwd"}) {
    const WebAnswer answer = live->Get(path);
    EXPECT_EQ(answer.status, 404) << path;
    EXPECT_FALSE(answer.json()["problems"].empty()) << path;
  }
}

TEST(Door, BodiesAreLimitedHoweverTheyAreSent) {
  const auto live = LiveServer::Hello();
  EXPECT_EQ(live->Post("/evaluate", std::string(kMaxBody + 1, ' ')).status, 413);
  EXPECT_EQ(live->Post("/pose-file", std::string(kMaxBody + 1, '#')).status, 413);
  const std::string head =
      "POST /evaluate HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(live->server().port()) +
      "\r\nX-Kpsa-Token: " + live->server().token() + "\r\nConnection: close\r\n";
  std::string chunks = head + "Transfer-Encoding: chunked\r\n\r\n";
  for (std::size_t sent = 0; sent <= kMaxBody; sent += 0x10000)
    chunks += "10000\r\n" + std::string(0x10000, ' ') + "\r\n";
  const std::string answer = SendRaw(live->server().port(), chunks + "0\r\n\r\n");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 413")) << answer.substr(0, 100);
  EXPECT_EQ(live->Get("/meta.json").status, 200);
}

TEST(Door, BytesThatAreNoRequestDoNoHarm) {
  const auto live = LiveServer::Hello();
  const int port = live->server().port();
  const std::string allowed = "Host: 127.0.0.1:" + std::to_string(port) +
                              "\r\nX-Kpsa-Token: " + live->server().token() + "\r\nConnection: close\r\n";
  std::string ranges = "Range: bytes=0-1";
  for (int i = 0; i < 1500; ++i) ranges += ",0-1";
  for (const std::string& bytes :
       {std::string("\0\1\2\3", 4), std::string("GET\r\n\r\n"), std::string(100'000, 'A'),
        "GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET /field/" + std::string(8'000, 'b') + " HTTP/1.1\r\n" + allowed + "\r\n",
        "GET /field/" + std::string(2'600, '%') + " HTTP/1.1\r\n" + allowed + "\r\n",
        "GET /meta.json HTTP/1.1\r\n" + allowed + ranges + "\r\n\r\n",
        "POST /evaluate HTTP/1.1\r\n" + allowed + "Content-Length: 99999999999999999999\r\n\r\n{}",
        "POST /evaluate HTTP/1.1\r\n" + allowed + "Content-Length: -1\r\n\r\n{}",
        "POST /evaluate HTTP/1.1\r\n" + allowed + "Content-Length: 2\r\nContent-Encoding: gzip\r\n\r\n{}",
        "POST /evaluate HTTP/1.1\r\n" + allowed + "Transfer-Encoding: chunked\r\n\r\nzz\r\n",
        "DELETE /meta.json HTTP/1.1\r\n" + allowed + "\r\n",
        "OPTIONS /evaluate HTTP/1.1\r\n" + allowed + "\r\n"}) {
    const std::string answer = SendRaw(port, bytes, true);
    EXPECT_FALSE(answer.starts_with("HTTP/1.1 2")) << bytes.substr(0, 60) << "\n" << answer.substr(0, 200);
    EXPECT_EQ(live->Get("/meta.json").status, 200) << bytes.substr(0, 60);
  }
}

}  // namespace
}  // namespace kpsa::engine
