// The long parts of training end by themselves wherever they are asked to.
#include <gtest/gtest.h>

#include "base/parallel.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/training_cancel.h"
#include "kpsa/training/varimax.h"
#include "tests/kpsa/synthetic.h"
#include "tests/support/countdown.h"

namespace kpsa::engine {
namespace {

// How often `work` asks whether to go on; and that it ends where the answer is no: at the first question, the last, and
// some between.
template <typename F>
long long QuestionsOf(F work) {
  const Countdown never;
  {
    const CancelScope scope(&never);
    work();
  }
  const long long all = never.questions();
  for (const long long at : {0LL, all / 7, all / 3, all / 2, all - 1}) {
    const Countdown countdown(at);
    const CancelScope scope(&countdown);
    EXPECT_THROW(work(), Cancelled) << at << " of " << all;
    EXPECT_LE(countdown.questions(), at + 16 + 2 * HardwareThreads()) << "it went on for long";
  }
  return all;
}

TEST(CancelledTraining, ProductsAskWithinTheirTiles) {
  const Eigen::MatrixXd a = RandomNormal(300, 5000, 1), b = RandomNormal(5000, 40, 2);
  const long long shallow = QuestionsOf([&] { Multiply(a.leftCols(16), b.topRows(16)); });
  EXPECT_GT(QuestionsOf([&] { Multiply(a, b); }), shallow + 5) << "the depth of a tile counts";
  EXPECT_GT(QuestionsOf([&] { Gram(GemmOperand::Dense(a)); }), shallow + 5);
}

TEST(CancelledTraining, PcaAndVarimax) {
  const test::Sheet sheet(600, 5, 1);
  PoseMatrix poses = sheet.RandomPoses(400, 2, sheet.Layout());
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  for (const auto method : {PcaOptions::Method::kSnapshot, PcaOptions::Method::kRandomised})
    EXPECT_GT(QuestionsOf([&] { (void)ComputePca(poses, mean, {.max_modes = 30, .method = method}); }), 50);
  Eigen::MatrixXd square = GramOf(RandomNormal(500, 500, 3));
  EXPECT_GT(QuestionsOf([&] { LargestEigen(square, 20, 1); }), 20);
  Eigen::MatrixXd modes = RandomNormal(600, 12, 4);
  Orthonormalize(&modes);
  EXPECT_GE(QuestionsOf([&] {
              Eigen::MatrixXd turned = modes;
              Varimax({}, 3, &turned);
            }),
            66)
      << "each pair of modes";
}

TEST(CancelledTraining, AsksWhoeverTrainsAsWell) {
  int calls = 0;
  std::string last;
  const TrainingCancel::Progress progress = [&](const char* what, double) {
    last = what;
    return ++calls < 3;
  };
  TrainingCancel cancel(progress);
  EXPECT_FALSE(cancel.asked()) << "not so soon";
  EXPECT_TRUE(cancel.Say("modes", 0.5));
  EXPECT_EQ(last, "modes");
  EXPECT_FALSE(cancel.asked());
  while (calls < 2) EXPECT_FALSE(cancel.asked());  // after a while it calls by itself
  EXPECT_FALSE(cancel.Say("subspace", 0.8));
  EXPECT_TRUE(cancel.asked()) << "once true, it stays";
  bool elsewhere = false;
  std::thread([&] { elsewhere = cancel.asked(); }).join();
  EXPECT_TRUE(elsewhere);
  EXPECT_EQ(calls, 3);

  const Countdown now(0);
  const CancelScope scope(&now);
  const TrainingCancel::Progress always = [](const char*, double) { return true; };
  EXPECT_TRUE(TrainingCancel(always).asked()) << "the scope around it counts";
  const TrainingCancel::Progress nobody;
  EXPECT_TRUE(TrainingCancel(nobody).asked());
}

}  // namespace
}  // namespace kpsa::engine
