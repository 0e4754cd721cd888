#include "kpsa/signature.h"

#include <gtest/gtest.h>

#include "kpsa/training_record.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

const std::vector<std::string> kNames = {"jaw",     "a",   "a.b",      "a.b.c", "upperarm01.L", "x#1",
                                         "ns:hand", "p/3", "left arm", "m@s",   "größe",        "\"\\"};

Signature Some() {
  Signature signature;
  for (const std::string& name : kNames) signature[name] = {"type", {{"translate", "1"}, {"rotate", "2"}}};
  return signature;
}

TEST(Signature, DifferencesAreNamedWhateverNodesAreCalled) {
  const Signature trained = Some();
  EXPECT_EQ(SignatureDifference(trained, trained), "");
  for (const std::string& name : kNames) {
    Signature now = trained;
    now[name].attributes["rotate"] = "3";
    EXPECT_EQ(SignatureDifference(trained, now), name + ".rotate");
    now = trained;
    now[name].attributes.erase("rotate");
    EXPECT_EQ(SignatureDifference(trained, now), name + ".rotate (gone)");
    EXPECT_EQ(SignatureDifference(now, trained), name + ".rotate (new)");
    now = trained;
    now[name].node = "another type";
    EXPECT_EQ(SignatureDifference(trained, now), name);
    now.erase(name);
    EXPECT_EQ(SignatureDifference(trained, now), name + " (gone)");
    EXPECT_EQ(SignatureDifference(now, trained), name + " (new)");
  }
  EXPECT_EQ(SignatureDifference(trained, {}), "\"\\ (gone), a (gone), a.b (gone) and 9 more");
}

// Signatures that differ in what belongs to what alone have different digests.
TEST(Signature, DigestsAreUnambiguous) {
  const std::vector<Signature> all = {
      {{"a", {"1", {{"b", "2"}}}}},
      {{"a", {"1", {}}}, {"b", {"2", {}}}},
      {{"a", {"1", {}}}, {"a.b", {"2", {}}}},
      {{"a.b", {"1", {{"c", "2"}}}}},
      {{"a", {"1", {{"b.c", "2"}}}}},
      {{"a", {"1", {{"b", "2"}, {"c", "3"}}}}},
      {{"a", {"1", {{"b", "2"}}}}, {"c", {"3", {}}}},
      {{"a", {"1", {}}}, {"b", {"2", {{"c", "3"}}}}},
      {{"ab", {"1", {}}}},
      {{"a", {"b1", {}}}},
      {},
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(SignatureDigest(all[i]), SignatureDigest(all[k])) << i << k;
  }
}

TEST(Signature, TrainingRecordsKeepWhatWasTried) {
  TrainingRecord record;
  record.tried = {{kForAllPoints, 3, 9, 0.5, 0.6, false}, {kByTile, 40, 44, 0.125, 0.25, true}};
  record.rules = {{"doubts", 0.25, 0.5, true}, {"likeness", 0.5, 0.75, false}};
  const TrainingRecord read = ParseTraining(TrainingJson(record));
  ASSERT_EQ(read.tried.size(), 2u);
  EXPECT_EQ(read.tried[1].what, kByTile);
  EXPECT_EQ(read.tried[1].rows, 44u);
  EXPECT_EQ(read.tried[1].misses, 0.125);
  EXPECT_TRUE(read.tried[1].taken && !read.tried[0].taken);
  ASSERT_EQ(read.rules.size(), 2u);
  EXPECT_EQ(read.rules[0].what, "doubts");
  EXPECT_EQ(read.rules[0].misses, 0.25);
  EXPECT_EQ(read.rules[0].cost, 0.5);
  EXPECT_TRUE(read.rules[0].taken && !read.rules[1].taken);
}

TEST(Signature, IsTakenOutOfRecordsOfEarlierVersions) {
  Subspace subspace;
  subspace.rig = {Some(), {"upperarm01.L.rotate.x", "p/3.envelope"}};
  subspace.training = R"({"seed":7})";
  std::string text = TrainingText(subspace);
  EXPECT_EQ(TakeTrainedRig(&text), subspace.rig);
  EXPECT_EQ(text, subspace.training);
  const auto taken = [](std::string from) { return TakeTrainedRig(&from); };
  // The flat form of earlier versions is no signature, and neither is anything else
  EXPECT_TRUE(taken(R"({"signature": {"mush": "1", "mush.iterations": "2"}})").signature.empty());
  for (const char* text :
       {"", "[]", R"({"signature": 3, "controls": {}})", R"({"signature": [1], "controls": [1]})",
        R"({"signature": {"a": [], "b": null}})"}) {
    EXPECT_EQ(taken(text), TrainedRig()) << text;
  }
  const Signature odd = taken(R"({"signature": {"a": {"node": 1, "attributes": {"b": 2}}}})").signature;
  EXPECT_EQ(odd, (Signature{{"a", {}}}));
}

class SetHereTest : public testing::Test {
 protected:
  SetHereTest() : g_(ToyRegistry()) {
    g_.add("scale3", "arm.L", {{"input", Double3{1, 2, 3}}});
    g_.add("add", "arm", {{"a", 1.0}});
    g_.connect("arm.out", "arm.L.factor");
    g_.add("add", "elsewhere");
    outputs_ = {g_.plug("arm.L.out")};
    trained_ = RigSignature(g_.graph, outputs_, {}, controls());
  }
  std::vector<PlugRef> controls() const { return {g_.plug("arm.L.input.x")}; }
  void Pose(const std::string& plug, Value value) {
    ASSERT_TRUE(g_.graph.Pose(g_.plug(plug), std::move(value)).ok());
  }
  // "name = value" of what is set here; what is left of the signature's difference.
  std::vector<std::string> Taken(std::string* difference) const {
    Signature now = RigSignature(g_.graph, outputs_, {}, controls());
    std::vector<std::string> taken;
    for (const SetHere& set : TakeSetHere(g_.graph, outputs_, {}, controls(), {}, trained_, &now))
      taken.push_back(set.name + " = " + set.value);
    *difference = SignatureDifference(trained_, now);
    return taken;
  }
  void ExpectTaken(const std::vector<std::string>& expected, const std::string& stale = "") const {
    std::string difference;
    EXPECT_EQ(Taken(&difference), expected);
    EXPECT_EQ(difference, stale);
  }
  TestGraph g_;
  std::vector<PlugRef> outputs_;
  Signature trained_;
};

TEST_F(SetHereTest, PosesAreToldComponentByComponent) {
  ExpectTaken({});
  Pose("elsewhere.a", 5.0);    // not upstream
  Pose("arm.L.input.y", 2.0);  // as it is anyway
  ExpectTaken({});
  Pose("arm.L.input.y", 4.0);
  ExpectTaken({"arm.L.inputY = 4"});
  Pose("arm.L.input", Double3{1, 2, 9});
  ExpectTaken({"arm.L.inputZ = 9"});
  Pose("arm.L.input.x", 0.5);  // a control
  Pose("arm.b", 0.25);
  ExpectTaken({"arm.L.inputX = 0.5", "arm.L.inputZ = 9", "arm.b = 0.25"});
}

TEST_F(SetHereTest, WhatTheRigSaysIsToldFromWhatIsSet) {
  g_.hold("arm.a", 2.0);  // the rig changed
  ExpectTaken({}, "arm.a");
  Pose("arm.a", 1.0);  // to what it was: no longer on top of another rig
  ExpectTaken({"arm.a = 1"}, "arm.a");
}

TEST_F(SetHereTest, WhatTrainingHadIsNotToldOf) {
  Pose("arm.L.input.y", 4.0);
  trained_ = RigSignature(g_.graph, outputs_, {}, controls());
  ExpectTaken({});
  Pose("arm.L.input.x", 3.0);
  ExpectTaken({"arm.L.inputX = 3"});
  Pose("arm.L.input.y", 5.0);
  ExpectTaken({"arm.L.inputX = 3", "arm.L.inputY = 5"}, "arm.L.input");
}

}  // namespace
}  // namespace kpsa::engine
