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

// Morph targets of a rig whose controls are others: left and right brow, always alike in the clips, parted in another one
// and were wrong, all of them hits, and nothing had said that they are known in pairs alone.
TEST(TrainReport, NamesWhatClipsAloneMove) {
  TrainResult result;
  result.subspace = std::make_shared<Subspace>();
  result.rig = "face.yaml";
  EXPECT_EQ(TrainText(result).find("moved by clips"), std::string::npos);
  for (int i = 0; i < 8; ++i)
    result.record.by_clips_alone.push_back("face.weight[" + std::to_string(i) + "]");
  EXPECT_NE(TrainText(result).find(
                "moved by clips and by no control, so known as these clips do it alone: face.weight[0], "
                "face.weight[1], face.weight[2], face.weight[3], face.weight[4], face.weight[5] and 2 more; "
                "another clip"),
            std::string::npos)
      << TrainText(result);
}

}  // namespace
}  // namespace kpsa::engine
