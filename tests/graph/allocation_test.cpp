// A warm evaluation allocates nothing, on no thread.
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/mman.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>

#include "base/parallel.h"
#include "graph/frames.h"
#include "tests/support/allocations.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

class Allocations : public testing::Test {
 protected:
  void SetUp() override {
    if (!KPSA_COUNTS_ALLOCATIONS)
      GTEST_SKIP() << "allocations are not counted under sanitizers or without glibc";
  }
  template <typename F>
  int In(F&& f) {
    StartCountingAllocations();
    f();
    return StopCountingAllocations();
  }
};

TEST_F(Allocations, CanaryTheCounterSeesEveryWay) {
  void* volatile p = nullptr;
  const auto count = [&](auto&& f) {
    const int n = In([&] { p = f(); });
    free(p);
    return n;
  };
  EXPECT_EQ(In([] {}), 0);
  EXPECT_EQ(count([] { return malloc(10); }), 1);
  EXPECT_EQ(count([] { return calloc(10, 1); }), 1);
  EXPECT_EQ(count([] { return realloc(nullptr, 10); }), 1);
  EXPECT_EQ(count([] { return aligned_alloc(64, 64); }), 1);
  EXPECT_EQ(count([] {
              void* q = nullptr;
              return posix_memalign(&q, 64, 64) == 0 ? q : nullptr;
            }),
            1);
  EXPECT_EQ(In([&] {
              int* made = new int(1);
              p = made;
              delete made;
            }),
            1);
  EXPECT_EQ(In([&] {
              void* made = ::operator new(64, std::align_val_t(64));
              p = made;
              ::operator delete(made, std::align_val_t(64));
            }),
            1);
  EXPECT_EQ(In([&] { p = mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); }), 1);
  munmap(p, 4096);
  // On another thread
  std::atomic<int> stage{0};
  std::thread other([&] {
    while (stage != 1) std::this_thread::yield();
    void* volatile made = malloc(10);  // volatile: or the compiler leaves both out
    free(made);
    stage = 2;
  });
  EXPECT_EQ(In([&] {
              stage = 1;
              while (stage != 2) std::this_thread::yield();
            }),
            1);
  other.join();
}

// Arithmetic, vectors, arrays, lazy branches that share, stacks in place, gathers; wide enough for threads.
void BuildWide(TestGraph& g) {
  g.add("add", "time");
  g.vary("time.a");
  g.add("sum", "all");
  for (int i = 0; i < 24; ++i) {
    const std::string n = std::to_string(i);
    g.add("source", "src" + n, {{"count", 400}});
    g.add("move", "m1_" + n);
    g.add("move", "m2_" + n, {{"offset", 0.5}});
    g.add("smooth", "ring" + n, {{"rings", 2}});
    g.add("cached", "cache" + n, {{"cues", std::vector<std::int64_t>{i, 50, 300}}});
    g.add("measure", "total" + n);
    g.add("scale3", "scale" + n, {{"input", Double3{1, 2, 3}}});
    g.add("select", "side" + n);
    g.connect("time.out", "m1_" + n + ".offset");
    g.connect("src" + n + ".outPoints", "m1_" + n + ".points");
    g.connect("m1_" + n + ".outPoints", "m2_" + n + ".points");
    g.connect("m2_" + n + ".outPoints", "ring" + n + ".points");
    g.connect("ring" + n + ".outPoints", "cache" + n + ".cuePoints");
    g.connect("ring" + n + ".outPoints", "cache" + n + ".full");
    g.connect("cache" + n + ".outPoints", "total" + n + ".points");
    g.connect("time.out", "scale" + n + ".factor");
    g.connect("time.out", "side" + n + ".which");
    g.connect("total" + n + ".out", "side" + n + ".a");
    g.connect("scale" + n + ".out.y", "side" + n + ".b");
    g.connect("side" + n + ".out", "all.input[" + n + "]");
    for (const char* name : {"root", "left", "right"}) g.add("add", name + n);
    g.add("together", "both" + n);
    g.connect("time.out", "root" + n + ".a");
    g.connect("root" + n + ".out", "left" + n + ".a");
    g.connect("root" + n + ".out", "right" + n + ".a");
    g.connect("left" + n + ".out", "both" + n + ".input[0]");
    g.connect("right" + n + ".out", "both" + n + ".other");
    g.connect("time.out", "both" + n + ".wanted");
    g.connect("both" + n + ".out", "all.input[" + std::to_string(24 + i) + "]");
    g.vary("src" + n + ".step");
    g.vary("cache" + n + ".threshold");
    g.want("m2_" + n + ".outPoints", PointSet::Of({1, 5, 9}, 400));
  }
  g.want("all.out");
}

void Frame(Evaluator& e, int frame) {
  e.Set(0, static_cast<double>(frame % 3));
  for (Index v = 1; v < e.plan().varying().size(); v += 2) {
    e.Set(v, 1.0 + 0.01 * frame);
    e.Set(v + 1, (frame + static_cast<int>(v)) % 4 == 0 ? 1e9 : -1e9);
  }
}

TEST_F(Allocations, NoneInAWarmSerialEvaluation) {
  TestGraph g(ToyRegistry());
  BuildWide(g);
  ASSERT_TRUE(g.compile().ok());
  Workspace workspace(*g.plan);
  EvaluatorOptions options;
  options.workspace = &workspace;
  Evaluator a(g.plan, options), b(g.plan, options);
  // Nothing of it is warmed up but the plan: the first evaluation allocates nothing, either
  double sum = 0;
  EXPECT_EQ(In([&] {
              for (int frame = 0; frame < 40; ++frame) {
                for (Evaluator* e : {&a, &b}) {
                  Frame(*e, frame);
                  if (!(frame % 5 == 4 ? e->Pull(3) : e->Evaluate()).ok()) return;
                  sum += e->Get<double>(24);
                }
              }
              a.Invalidate();
              sum += a.Evaluate().ok();
            }),
            0);
  EXPECT_GT(sum, 0);
}

TEST_F(Allocations, NoneInAWarmParallelEvaluation) {
  TestGraph g(ToyRegistry());
  BuildWide(g);
  ASSERT_TRUE(g.compile().ok());
  for (int threads : {2, 4}) {
    ThreadLimit limit(threads);
    EvaluatorOptions options;
    options.parallel = true;
    Evaluator e(g.plan, options);
    const auto run = [&](int frames) {
      for (int frame = 0; frame < frames; ++frame) {
        Frame(e, frame);
        if (!e.Evaluate().ok()) return;
      }
    };
    run(500);  // the pool's threads come to life
    EXPECT_EQ(In([&] { run(200); }), 0) << threads << " threads";
  }
}

TEST_F(Allocations, AFirstMissAllocatesNothing) {
  TestGraph g(ToyRegistry());
  BuildWide(g);
  ASSERT_TRUE(g.compile().ok());
  Evaluator e(g.plan);
  for (Index v = 2; v < g.plan->varying().size(); v += 2) e.Set(v, 1e9);
  ASSERT_TRUE(e.Evaluate().ok());  // hits
  EXPECT_EQ(In([&] {
              for (Index v = 2; v < g.plan->varying().size(); v += 2) e.Set(v, -1e9);
              if (!e.Evaluate().ok()) std::abort();
            }),
            0);
}

TEST_F(Allocations, FramesAllocateByThreadAndNotByFrame) {
  TestGraph g(ToyRegistry());
  BuildWide(g);
  ASSERT_TRUE(g.compile().ok());
  const auto run = [&](std::size_t frames) {
    FrameOptions options;
    options.threads = 2;
    options.block = 4;
    const auto set = [](std::size_t frame, Evaluator& e) { Frame(e, static_cast<int>(frame)); };
    const auto sink = [](std::size_t, const Evaluator&, const Status& status) { return status; };
    return In([&] {
      if (!EvaluateFrames(g.plan, frames, options, set, sink).ok()) std::abort();
    });
  };
  run(40);
  const int few = run(40), many = run(400);
  EXPECT_NEAR(few, many, 8);
  EXPECT_GT(few, 0);
}

}  // namespace
}  // namespace kpsa::engine
