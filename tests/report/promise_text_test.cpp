// What a bench says of the promise, and when it is kept.
#include "report/promise_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace kpsa::engine {
namespace {

Promise FivePercent() {
  Promise promise;
  promise.tolerance = 1e-3, promise.rate = 0.05;
  return promise;
}

TEST(Promise, IsKeptUpToItsRate) {
  Promise promise = FivePercent();
  for (int f = 0; f < 19; ++f) promise.Add("talk", f, true, true, 4e-4);
  EXPECT_TRUE(promise.kept());
  promise.Add("talk", 19, true, true, 2e-3);
  EXPECT_TRUE(promise.kept()) << "1 of 20";
  EXPECT_NE(PromiseText(promise, "")
                .find("kept: 1 of 20 frames beyond 1 mm (promised 5 %), 1 of 20 hits (promised 10 %)"),
            std::string::npos)
      << PromiseText(promise, "");
  EXPECT_NE(PromiseText(promise, "").find("worst accepted: frame 19 of talk, 2.00 tolerances"),
            std::string::npos);
  promise.Add("talk", 20, true, true, NAN);
  EXPECT_FALSE(promise.kept()) << "an error that is no number is beyond every tolerance";
  EXPECT_TRUE(
      PromiseText(promise, "").starts_with("PROMISE BROKEN: 9.52 % > 5 % of frames beyond 1 mm (2 of 21)"))
      << PromiseText(promise, "");
  EXPECT_NE(PromiseText(promise, "").find("what helps: "), std::string::npos);
}

TEST(Promise, HitsHaveTwiceTheRate) {
  Promise promise = FivePercent();
  for (int f = 0; f < 95; ++f) promise.Add("talk", f, false, false, 0);
  for (int f = 95; f < 100; ++f) promise.Add("talk", f, true, true, f < 96 ? 2e-3 : 0);
  EXPECT_FALSE(promise.kept()) << "1 % of the frames, but 20 % of the hits";
  EXPECT_TRUE(
      PromiseText(promise, "").starts_with("PROMISE BROKEN: 20 % > 10 % of hits beyond 1 mm (1 of 5)"))
      << PromiseText(promise, "");
}

TEST(Promise, MissesAndFramesThatAreAcceptedAnywayBreakNone) {
  Promise promise = FivePercent();
  promise.Add("talk", 1, false, false, 1);  // as of a mesh that nothing accelerates
  EXPECT_TRUE(promise.kept());
  EXPECT_NE(PromiseText(promise, "").find("no frame was accepted"), std::string::npos);
  promise.tolerance = 1e30;
  promise.Add("talk", 2, true, true, 1);
  EXPECT_FALSE(promise.promised());
  EXPECT_TRUE(promise.kept());
  EXPECT_EQ(PromiseText(promise, ""), "none: every frame is accepted, whatever its error\n");
}

}  // namespace
}  // namespace kpsa::engine
