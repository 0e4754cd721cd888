// The program as a user runs it.
#include <gtest/gtest.h>
#include <httplib.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

extern char** environ;

namespace kpsa::engine {
namespace {

// kpsa view, its standard output, and what it printed there first.
struct Viewing {
  pid_t process = 0;
  std::string line;

  explicit Viewing(std::vector<std::string> arguments) {
    int ends[2] = {};
    if (::pipe(ends) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", 1, 0);
    std::vector<char*> argv;
    for (std::string& word : arguments) argv.push_back(word.data());
    argv.push_back(nullptr);
    ::posix_spawn(&process, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) line += c;
    ::close(ends[0]);
  }
  // Its exit code; 128 and the signal where one ended it.
  int End(int signal) {
    if (signal != 0) ::kill(process, signal);
    int status = 0;
    ::waitpid(process, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
};

const std::string kRig = KPSA_SCENES_DIR "/hello/hello.yaml";

TEST(ViewProgram, PrintsItsAddressAndServesUntilItIsInterrupted) {
  for (const int signal : {SIGINT, SIGTERM}) {
    // Clips to play, and none
    Viewing viewing(signal == SIGINT ? std::vector<std::string>{KPSA_PROGRAM, "view", kRig}
                                     : std::vector<std::string>{KPSA_PROGRAM, "view", kRig, "--rest"});
    const std::string begin = "http://127.0.0.1:", middle = "/?token=";
    ASSERT_TRUE(viewing.line.starts_with(begin)) << viewing.line;
    const std::size_t at = viewing.line.find(middle);
    ASSERT_NE(at, std::string::npos) << viewing.line;
    const std::string token = viewing.line.substr(at + middle.size());
    const int port = std::atoi(viewing.line.substr(begin.size(), at - begin.size()).c_str());
    httplib::Client client("127.0.0.1", port);
    const auto meta = client.Get("/meta.json", {{"X-Kpsa-Token", token}});
    ASSERT_TRUE(meta);
    EXPECT_EQ(meta->status, 200);
    EXPECT_EQ(meta->body.find("\"clips\":") != std::string::npos, signal == SIGINT);
    // Somebody waits for changes, as pages do
    std::thread waits([&] {
      httplib::Client other("127.0.0.1", port);
      (void)other.Get("/events?after=0", {{"X-Kpsa-Token", token}});
    });
    EXPECT_EQ(viewing.End(signal), 130);
    waits.join();
  }
}

TEST(ViewProgram, RefusesWhatItCannotShow) {
  EXPECT_EQ(Viewing({KPSA_PROGRAM, "view", "nobody.yaml"}).End(0), 3);
  EXPECT_EQ(Viewing({KPSA_PROGRAM, "view", kRig, "--port", "70000"}).End(0), 2);
  EXPECT_EQ(Viewing({KPSA_PROGRAM, "view", kRig, "--clip", "nobody"}).End(0), 2);
  EXPECT_EQ(Viewing({KPSA_PROGRAM, "view", kRig, "--kpsa", "nobody.kpsa"}).End(0), 3);
  // A port has one server
  Viewing first({KPSA_PROGRAM, "view", kRig});
  const std::string port = first.line.substr(17, first.line.find("/?") - 17);
  EXPECT_EQ(Viewing({KPSA_PROGRAM, "view", kRig, "--port", port}).End(0), 2);
  EXPECT_EQ(first.End(SIGINT), 130);
}

}  // namespace
}  // namespace kpsa::engine
