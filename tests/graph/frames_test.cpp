#include "graph/frames.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kFrames = 61;

// A stack of deformers behind a cache whose cues miss on some frames, one of them behind a second cache.
class FramesTest : public testing::Test {
 protected:
  FramesTest() : g_(ToyRegistry()) {
    g_.add("source", "src", {{"count", 100}});
    g_.add("move", "m1");
    g_.add("smooth", "ring", {{"rings", 2}});
    g_.add("move", "m2", {{"offset", 0.25}});
    g_.add("cached", "cache", {{"cues", std::vector<std::int64_t>{5, 50}}});
    g_.add("move", "after");
    g_.add("cached", "second", {{"cues", std::vector<std::int64_t>{7}}, {"threshold", 0.0}});
    g_.add("fail", "gate");
    g_.add("measure", "total");
    g_.connect("src.outPoints", "m1.points");
    g_.connect("m1.outPoints", "ring.points");
    g_.connect("ring.outPoints", "m2.points");
    g_.connect("m2.outPoints", "cache.cuePoints");
    g_.connect("m2.outPoints", "cache.full");
    g_.connect("cache.outPoints", "after.points");
    g_.connect("gate.out", "after.offset");
    g_.connect("after.outPoints", "second.cuePoints");
    g_.connect("ring.outPoints", "second.full");
    g_.connect("second.outPoints", "total.points");
    for (const char* plug : {"m1.offset", "cache.threshold", "gate.input", "second.floor"}) g_.vary(plug);
    g_.want("second.outPoints");
    g_.want("total.out");
    EXPECT_TRUE(g_.compile().ok());
  }

  static void Set(std::size_t frame, Evaluator& evaluator) {
    const auto f = static_cast<double>(frame);
    evaluator.Set(0,
                  10.0 * static_cast<double>(frame % 7) - 30 + f / 16);  // moves the points: hits and misses
    evaluator.Set(1, frame % 3 == 0 ? -1e9 : 60.0);    // every third frame misses in any case
    evaluator.Set(2, frame % 10 == 4 ? -1.0 : f / 8);  // some frames fail, here before the second cache
    evaluator.Set(3, frame % 13 == 5 ? 1e9 : -1e30);   // and some in its compute
  }
  // The bytes of a frame's outputs, or its error.
  static std::string Bytes(const Evaluator& evaluator, const Status& status) {
    if (!status.ok()) return status.ToString();
    std::string bytes(reinterpret_cast<const char*>(&evaluator.Get<double>(1)), sizeof(double));
    const ConstPointsView points = evaluator.Points(0);
    bytes.append(reinterpret_cast<const char*>(points.x), points.count * sizeof(float));
    return bytes;
  }
  // Every frame on an evaluator of its own.
  std::vector<std::string> Expected() {
    std::vector<std::string> expected;
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
      Evaluator evaluator(g_.plan);
      Set(frame, evaluator);
      const Status status = evaluator.Evaluate();
      expected.push_back(Bytes(evaluator, status));
    }
    return expected;
  }

  TestGraph g_;
};

TEST_F(FramesTest, SameBytesForAnyThreadsBlockAndOrder) {
  const std::vector<std::string> expected = Expected();
  std::map<std::string, int> different;
  for (const std::string& bytes : expected) ++different[bytes];
  EXPECT_GT(different.size(), 30u);
  for (int threads : {1, 2, 4}) {
    for (int block : {1, 3, 8, 100}) {
      for (std::size_t stride : {1, 25}) {  // another order: 25 and 61 share no factor
        std::vector<std::string> got(kFrames);
        std::size_t next = 0;
        FrameOptions options;
        options.threads = threads;
        options.block = block;
        const Status status = EvaluateFrames(
            g_.plan, kFrames, options, [&](std::size_t i, Evaluator& e) { Set(i * stride % kFrames, e); },
            [&](std::size_t i, const Evaluator& e, const Status& evaluated) {
              EXPECT_EQ(i, next++);
              got[i * stride % kFrames] = Bytes(e, evaluated);
              return Status();
            });
        EXPECT_TRUE(status.ok()) << status.ToString();
        EXPECT_EQ(next, kFrames);
        EXPECT_EQ(got, expected) << threads << " threads, blocks of " << block << ", stride " << stride;
      }
    }
  }
}

TEST_F(FramesTest, AFrameThatFailsIsNamedAndTheOthersGoOn) {
  FrameOptions options;
  options.threads = 2;
  int failed = 0, fine = 0;
  const Status status = EvaluateFrames(
      g_.plan, kFrames, options, Set, [&](std::size_t frame, const Evaluator&, const Status& evaluated) {
        EXPECT_EQ(evaluated.ok(), frame % 10 != 4 && frame % 13 != 5) << frame << evaluated.ToString();
        if (evaluated.ok()) {
          ++fine;
        } else {
          ++failed;
          EXPECT_EQ(evaluated.kind(), ErrorKind::kEvaluation);
          EXPECT_NE(evaluated.ToString().find(frame % 10 == 4 ? "\"gate\"" : "\"second\""), std::string::npos)
              << evaluated.ToString();
        }
        return Status();
      });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(failed, 10);  // 4 14 24 34 44 54, 5 18 31 57
  EXPECT_EQ(failed + fine, static_cast<int>(kFrames));
}

// What callers throw, on whatever thread, is an error with its frame, and everything else ends.
TEST_F(FramesTest, WhatCallersThrowIsAnErrorOfItsFrame) {
  for (const int threads : {1, 3}) {
    for (const bool by_sink : {false, true}) {
      FrameOptions options;
      options.threads = threads;
      std::size_t sunk = 0;
      const Status status = EvaluateFrames(
          g_.plan, kFrames, options,
          [&](std::size_t frame, Evaluator& e) {
            Set(frame, e);
            if (!by_sink && frame == 20) throw std::runtime_error("the disk has gone");
          },
          [&](std::size_t frame, const Evaluator&, const Status&) {
            ++sunk;
            if (by_sink && frame == 20) throw std::bad_alloc();
            return Status();
          });
      EXPECT_EQ(status.kind(), ErrorKind::kEvaluation);
      EXPECT_EQ(status.ToString(),
                by_sink ? "frame 20 of 61: not enough memory" : "frame 20 of 61: the disk has gone");
      EXPECT_LE(sunk, by_sink ? 21u : 20u);
    }
  }
}

// What a node throws fails that node at that frame, in computes, in decisions and in blocks.
TEST_F(FramesTest, WhatANodeThrowsIsAnErrorOfThatNode) {
  for (const int threads : {1, 3}) {
    FrameOptions options;
    options.threads = threads;
    std::size_t failed = 0;
    const Status status = EvaluateFrames(
        g_.plan, kFrames, options,
        [](std::size_t frame, Evaluator& e) {
          Set(frame, e);
          e.Set(2, frame % 10 == 4 ? kThrows : 1.0);  // the node "gate"
          e.Set(3, -1e30);
        },
        [&](std::size_t frame, const Evaluator&, const Status& evaluated) {
          EXPECT_EQ(evaluated.ok(), frame % 10 != 4) << frame << evaluated.ToString();
          if (evaluated.ok()) return Status();
          ++failed;
          EXPECT_EQ(evaluated.errors().front().node, "gate");
          EXPECT_EQ(evaluated.ToString(), "node \"gate\" (fail): was told to throw");
          return Status();
        });
    EXPECT_TRUE(status.ok()) << status.ToString();
    EXPECT_EQ(failed, 6u);
  }
}

TEST_F(FramesTest, BlocksComputeHitsTogetherAndMissesAlone) {
  g_.request.outputs = {{g_.plug("cache.outPoints"), {}}};
  Result<std::shared_ptr<const Plan>> plan = g_.compiler.Compile(g_.graph, g_.request);
  ASSERT_TRUE(plan.ok());
  TakeBlockComputes();
  Profile profile(**plan);
  profile.keep_events = true;
  FrameOptions options;
  options.threads = 1;
  options.block = 8;
  options.profile = &profile;
  const auto set = [](std::size_t frame, Evaluator& e) {
    e.Set(0, static_cast<double>(frame));
    e.Set(1, frame % 4 == 3 ? -1e9 : 1e9);
  };
  ASSERT_TRUE(EvaluateFrames(*plan, 24, options, set, [](std::size_t, const Evaluator&, const Status& s) {
                return s;
              }).ok());
  const BlockComputes blocks = TakeBlockComputes();
  EXPECT_EQ(blocks.calls, 3);
  EXPECT_EQ(blocks.frames, 18);
  // Counts by frame: the cache once in each, the full stack in the frames that miss
  std::map<std::string, int> counts;
  std::map<int, int> frames;
  for (const ProfileEvent& event : profile.events()) {
    const bool full = (*plan)->infos()[event.step].segment != 0;
    ++counts[std::string((*plan)->step_name(event.step)) + (full ? " full" : "")];
    ++frames[event.frame];
    EXPECT_LE(event.begin_ns, event.end_ns);
  }
  EXPECT_EQ(counts["cache"], 24);
  EXPECT_EQ(counts["m2"], 24);
  EXPECT_EQ(counts["m2 full"], 6);
  EXPECT_EQ(frames.size(), 24u);
  EXPECT_GT(frames[3], frames[8]);
}

TEST_F(FramesTest, MemoryIsBoundedWhileTheSinkIsSlow) {
  std::mutex mutex;
  int begun = 0, sunk = 0, most = 0;
  FrameOptions options;
  options.threads = 4;
  options.block = 2;
  const Status status = EvaluateFrames(
      g_.plan, kFrames, options,
      [&](std::size_t frame, Evaluator& e) {
        Set(frame, e);
        std::lock_guard<std::mutex> lock(mutex);
        most = std::max(most, ++begun - sunk);
      },
      [&](std::size_t, const Evaluator&, const Status&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        std::lock_guard<std::mutex> lock(mutex);
        ++sunk;
        return Status();
      });
  EXPECT_TRUE(status.ok());
  EXPECT_LE(most, 4 * 2);
  EXPECT_GT(most, 2);
}

TEST_F(FramesTest, CancellingEndsAfterACompletePrefix) {
  for (int threads : {1, 3}) {
    std::atomic<bool> cancel{false};
    std::size_t seen = 0;
    FrameOptions options;
    options.threads = threads;
    options.block = 4;
    options.cancel = &cancel;
    const Status status = EvaluateFrames(g_.plan, kFrames, options, Set,
                                         [&](std::size_t frame, const Evaluator&, const Status&) {
                                           EXPECT_EQ(frame, seen++);
                                           if (seen == 10) cancel = true;
                                           return Status();
                                         });
    EXPECT_EQ(status.kind(), ErrorKind::kInterrupted);
    EXPECT_NE(status.ToString().find("10 of 61"), std::string::npos) << status.ToString();
    EXPECT_EQ(seen, 10u);
  }
}

TEST_F(FramesTest, AnErrorOfTheSinkEndsEverything) {
  std::size_t seen = 0;
  FrameOptions options;
  options.threads = 3;
  options.block = 2;
  const Status status =
      EvaluateFrames(g_.plan, kFrames, options, Set, [&](std::size_t, const Evaluator&, const Status&) {
        return ++seen == 7 ? Status::Invalid("the disk is full") : Status();
      });
  EXPECT_EQ(seen, 7u);
  EXPECT_EQ(status.ToString(), "the disk is full");
}

TEST_F(FramesTest, NoFramesAndFewerFramesThanThreads) {
  int calls = 0;
  const auto sink = [&](std::size_t, const Evaluator&, const Status&) { return ++calls, Status(); };
  FrameOptions options;
  options.threads = 8;
  EXPECT_TRUE(EvaluateFrames(g_.plan, 0, options, Set, sink).ok());
  EXPECT_EQ(calls, 0);
  EXPECT_TRUE(EvaluateFrames(g_.plan, 3, options, Set, sink).ok());
  EXPECT_EQ(calls, 3);
}

TEST(Frames, AStatefulNodeKeepsItsFramesInOrderOnOneEvaluator) {
  TestGraph g(ToyRegistry());
  g.add("trail", "follow");
  g.add("add", "after", {{"b", 1.0}});
  g.connect("follow.out", "after.a");
  g.vary("follow.input");
  g.want("after.out");
  ASSERT_TRUE(g.compile().ok());
  EXPECT_EQ(g.plan->stateful_node(), "follow");
  FrameOptions options;
  options.threads = 4;
  options.block = 8;
  double at = 0;
  std::vector<const Evaluator*> evaluators;
  const Status status = EvaluateFrames(
      g.plan, 40, options,
      [](std::size_t frame, Evaluator& e) { e.Set(0, static_cast<double>(frame * frame)); },
      [&](std::size_t frame, const Evaluator& e, const Status& evaluated) {
        if (frame > 0 || at > 0) at = (at + static_cast<double>(frame * frame)) / 2;
        EXPECT_EQ(e.Get<double>(0), at + 1) << frame;
        evaluators.push_back(&e);
        return evaluated;
      });
  EXPECT_TRUE(status.ok());
  for (const Evaluator* e : evaluators) EXPECT_EQ(e, evaluators[0]);

  // From the first frame again
  Evaluator again(g.plan);
  std::vector<double> first;
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t frame = 0; frame < 5; ++frame) {
      again.Set(0, 1.0 + static_cast<double>(frame));
      ASSERT_TRUE(again.Evaluate().ok());
      if (pass == 0) first.push_back(again.Get<double>(0));
      EXPECT_EQ(again.Get<double>(0), first[frame]);
    }
    again.Restart();
  }

  TestGraph plain(ToyRegistry());
  plain.add("add", "a");
  plain.vary("a.a");
  plain.want("a.out");
  ASSERT_TRUE(plain.compile().ok());
  EXPECT_EQ(plain.plan->stateful_node(), "");
}

}  // namespace
}  // namespace kpsa::engine
