// CarriedFrame: from the world to the stage of a deformer, before and after a skin.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "base/matrix.h"
#include "nodes/deformer.h"

namespace kpsa::engine {
namespace {

const Matrix4 kParentRest = Translation({1, 2, 3}) * RotationFromEuler({0.3, -0.2, 0.5}, RotateOrder::kXyz);
const Matrix4 kWorldFromMesh = Translation({-4, 0, 1}) * Scaling({2, 2, 2});

// A deformer of a stage in mesh space (1), or in world space (0).
class AStage : public Structural {
 public:
  explicit AStage(int space) {
    values["space"] = Value(space);
    values["geometryMatrix"] = Value(kWorldFromMesh);
    values["parentMatrix"] = Value(kParentRest);
  }
  const Value& value(std::string_view name, int) const override { return values.at(std::string(name)); }
  bool is_set(std::string_view, int) const override { return true; }
  int array_size(std::string_view) const override { return 0; }
  int geometry() const override { return 0; }
  const std::string& node_name() const override { return name; }
  const Value* rest(std::string_view name, int) const override { return &value(name, -1); }
  std::map<std::string, Value> values;
  std::string name = "n";
};

double Difference(const Matrix4& a, const Matrix4& b) {
  double most = 0;
  for (int i = 0; i < 16; ++i) most = std::max(most, std::fabs(a.m[i] - b.m[i]));
  return most;
}

const Matrix4 kParentNow = Translation({0, 5, 0}) * RotationFromEuler({1, 0.4, -0.7}, RotateOrder::kXyz);
const Matrix4 kHandle = Translation({0.5, 0, 0}) * RotationFromEuler({0, 0.9, 0}, RotateOrder::kXyz);

TEST(CarriedFrames, OfAStageInTheWorldChangeNothing) {
  const Result<CarriedFrame> frame = CarriedFrame::Bind(AStage(0));
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->StageFromWorld(kParentNow), Matrix4());
  EXPECT_EQ(frame->StageFromHandle(kParentNow, kHandle), kHandle);
}

TEST(CarriedFrames, InMeshSpaceTakeAHandleToWhereItsParentRests) {
  const Result<CarriedFrame> frame = CarriedFrame::Bind(AStage(1));
  ASSERT_TRUE(frame.ok());
  // Under its parent, the handle is for the stage where it was at rest
  EXPECT_LT(Difference(frame->StageFromHandle(kParentNow, kParentNow * kHandle),
                       frame->stage_from_world() * kParentRest * kHandle),
            1e-12);
  EXPECT_LT(
      Difference(frame->StageFromWorld(kParentNow) * kHandle, frame->StageFromHandle(kParentNow, kHandle)),
      1e-12);
  EXPECT_LT(Difference(frame->StageFromWorld(kParentRest), frame->stage_from_world()), 1e-12);
  EXPECT_GT(Difference(frame->StageFromWorld(kParentNow), frame->stage_from_world()), 0.1);
}

}  // namespace
}  // namespace kpsa::engine
