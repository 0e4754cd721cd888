// What shows the random graphs (random_graph_test.cpp) going red: nodes that declare too little or do too much, and
// twins and evaluators that miss something.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/toy_nodes.h"
#include "tests/support/twin_rounds.h"

namespace kpsa::engine {
namespace {

double hidden = 0;

// Toys, and some that are like one of them but for what is wrong.
const NodeRegistry& WrongToys() {
  static const NodeRegistry* const registry = [] {
    auto* toys = new NodeRegistry;
    AddToyNodes(*toys);
    toys->add("peek", "Reads what it does not declare.")
        .in("input", 0.0)
        .out("out", Type::kDouble)
        .compute([](double v) { return v + hidden; });
    AddToySelect(*toys, "greedySelect", "Has both inputs evaluated.",
                 [](ComputeContext&) -> std::uint64_t { return 3; });
    AddToySelect(*toys, "blindSelect", "Has the other input evaluated.",
                 [](ComputeContext& c) -> std::uint64_t { return c.get<std::int64_t>(0) != 0 ? 1 : 2; });
    AddToyRaise(*toys, "shyRaise", "Touches more points than it says.", 6);
    toys->add("calmFail", "Never fails.").in("input", 0.0).out("out", Type::kDouble).compute([](double v) {
      return v;
    });
    toys->add("jumpyFail", "Fails too early.")
        .in("input", 0.0)
        .out("out", Type::kDouble)
        .compute([](ComputeContext& c) {
          c.out_value<double>(0) = c.get<double>(0);
          if (c.get<double>(0) < 4) c.host->Fail("is below four");
        });
    return toys;
  }();
  return *registry;
}

// What the first seeds say; "" if all of them agree.
std::string FirstFault(const TwinMistakes& mistakes) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    TwinCounts counts;
    TwinSizes sizes;
    sizes.nodes = 40;
    std::string fault = Disagreement(WrongToys(), Choices(seed), sizes, &counts, mistakes);
    if (!fault.empty()) return fault;
  }
  return "";
}
TwinMistakes Disguised(const std::string& type, const std::string& as) {
  TwinMistakes mistakes;
  mistakes.disguises[type] = as;
  return mistakes;
}
bool Ends(const std::string& text, const std::string& end) { return text.ends_with(end); }

TEST(RandomGraphCanaries, WithoutAMistakeAllAgree) { EXPECT_EQ(FirstFault({}), ""); }

TEST(RandomGraphCanaries, ANodeThatDeclaresTooLittleIsStale) {
  TwinMistakes mistakes = Disguised("floor", "peek");
  mistakes.hidden = &hidden;
  EXPECT_TRUE(Ends(FirstFault(mistakes), "is another value")) << FirstFault(mistakes);
}

TEST(RandomGraphCanaries, ADeformerThatTouchesMoreThanItSays) {
  const std::string fault = FirstFault(Disguised("raise", "shyRaise"));
  EXPECT_TRUE(Ends(fault, "is another value")) << fault;
}

TEST(RandomGraphCanaries, ANodeThatIsNotLazyEnough) {
  const std::string fault = FirstFault(Disguised("select", "greedySelect"));
  EXPECT_TRUE(Ends(fault, "ran, and nobody needs it") || fault.find("knows of no such failure") != fault.npos)
      << fault;
}

TEST(RandomGraphCanaries, ANodeThatIsTooLazy) {
  EXPECT_NE(FirstFault(Disguised("select", "blindSelect")), "");
}

TEST(RandomGraphCanaries, AValueThatDoesNotArrive) {
  TwinMistakes mistakes;
  mistakes.forgets_to_set = true;
  EXPECT_NE(FirstFault(mistakes), "");
}

TEST(RandomGraphCanaries, AnEvaluatorThatTakesTooMuchForDirty) {
  TwinMistakes mistakes;
  mistakes.invalidates = true;
  const std::string fault = FirstFault(mistakes);
  EXPECT_TRUE(Ends(fault, "ran, and nothing that it reads has changed")) << fault;
}

TEST(RandomGraphCanaries, FailuresThatOneSideDoesNotKnow) {
  EXPECT_NE(FirstFault(Disguised("fail", "calmFail")).find("the evaluation does not"), std::string::npos);
  EXPECT_NE(FirstFault(Disguised("fail", "jumpyFail")).find("knows of no such failure"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
