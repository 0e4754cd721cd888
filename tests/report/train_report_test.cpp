// What training says of itself.
#include "report/train_report.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace kpsa::engine {
namespace {

std::string WorstOf(double error) {
  Subspace subspace;
  subspace.tolerance = 0.002;
  TrainResult result;
  result.subspace = std::make_shared<Subspace>(subspace);
  result.rig = "gnome.yaml", result.worst_path = "gnome.worst.yaml";
  result.record.worst.error = error, result.record.worst.kind = "sampled", result.record.worst.clip = "walk";
  const std::string text = TrainText(result);
  const std::size_t begin = text.find("worst that is accepted");
  return text.substr(begin, text.find("\nnext", begin) - begin);
}

TEST(TrainReport, SaysHowManyTolerancesTheWorstIsOff) {
  EXPECT_EQ(WorstOf(0.0015),
            "worst that is accepted: 1.5 mm (sampled, over walk); gnome.worst.yaml replays it\n");
  EXPECT_EQ(
      WorstOf(0.005),
      "worst that is accepted: 5 mm, 2.5 tolerances (sampled, over walk); gnome.worst.yaml replays it\n");
  EXPECT_EQ(
      WorstOf(0.062),
      "worst that is accepted: 62 mm, 31.0 tolerances (sampled, over walk); gnome.worst.yaml replays it\n"
      "that is 31 tolerances: look at it, and at the controls it moves, before this is used\n");
}

}  // namespace
}  // namespace kpsa::engine
