// The progress line on a terminal: a time left only where it is known, and nothing left behind.
#include "cli/progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <thread>

namespace kpsa::engine {
namespace {

// What is written to stderr while that is a terminal.
std::string OnTerminal(const std::function<void()>& work) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (terminal < 0 || ::grantpt(terminal) != 0 || ::unlockpt(terminal) != 0) return "";
  const int other = ::open(::ptsname(terminal), O_RDWR | O_NOCTTY), before = ::dup(STDERR_FILENO);
  std::fflush(stderr);
  ::dup2(other, STDERR_FILENO);
  work();
  std::fflush(stderr);
  ::dup2(before, STDERR_FILENO);
  ::close(before);
  ::fcntl(terminal, F_SETFL, O_NONBLOCK);
  std::string text;
  for (int quiet = 0; quiet < 20;) {  // what was written may take a moment to arrive
    char bytes[1024];
    const ssize_t size = ::read(terminal, bytes, sizeof(bytes));
    if (size > 0) text.append(bytes, static_cast<std::size_t>(size));
    if (size > 0) continue;
    ++quiet;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ::close(other);
  ::close(terminal);
  return text;
}

TEST(Progress, StagesHaveNoTimeLeftAndCountsHave) {
  const std::string text = OnTerminal([] {
    Progress progress("train", 0, false);
    progress.SetStage("train: modes");
    progress.SetLabel("train: trying it, poses", 10);
    progress.Set(0);
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
    progress.Set(5);
    progress.Clear();
    std::fputs("report", stderr);
  });
  if (text.empty()) GTEST_SKIP() << "no pseudo terminals here";
  const std::size_t stage = text.find("train: modes "), counted = text.find("0/10"), half = text.find("5/10");
  ASSERT_NE(stage, std::string::npos) << text;
  ASSERT_NE(counted, std::string::npos) << text;
  ASSERT_NE(half, std::string::npos) << text;
  EXPECT_NE(text.find("after 0 s", stage), std::string::npos) << text;
  EXPECT_GT(text.find("s left"), half) << "before anything is done nobody knows: " << text;
  EXPECT_NE(text.find("s left"), std::string::npos) << text;
  // Cleared before what follows, once
  EXPECT_TRUE(text.ends_with("\r\033[Kreport")) << text;
}

TEST(Progress, QuietDrawsNothing) {
  EXPECT_EQ(OnTerminal([] {
              Progress progress("frames", 3, true);
              progress.SetStage("train: modes");
              progress.Set(2);
            }),
            "");
}

}  // namespace
}  // namespace kpsa::engine
