#include "nodes/kernels/expression.h"

#include <cmath>
#include <limits>
#include <locale>
#include <thread>

#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

double Formula(const std::string& text, const std::vector<double>& inputs = {}) {
  Result<Expression> program = Expression::Compile(text, inputs.size());
  EXPECT_TRUE(program.ok()) << text << ": " << program.status().ToString();
  if (!program.ok()) return std::nan("");
  std::vector<double> stack(program->stack_size());
  return program->Run(inputs, stack);
}

TEST(Expressions, ComputeWhatTheySay) {
  EXPECT_EQ(Formula("2"), 2);
  EXPECT_EQ(Formula("1.5e2 + .5 - 3."), 147.5);
  EXPECT_EQ(Formula("2 + 3 * 4 - 10 / 4"), 11.5);
  EXPECT_EQ(Formula("(2 + 3) * -(4 - 10)"), 30);
  EXPECT_EQ(Formula("2 ^ 3 ^ 2"), 512);
  EXPECT_EQ(Formula("-2 ^ 2"), -4);
  EXPECT_EQ(Formula("in0 * in1 - in0", {3, 5}), 12);
  EXPECT_EQ(Formula("in0 < 2 && in1 >= 5 || in0 == 7", {3, 5}), 0);
  EXPECT_EQ(Formula("in0 != 2 && in1 <= 5 || in0 > 7", {3, 5}), 1);
  for (const auto& [x, expected] : std::vector<std::pair<double, double>>{{-1, 10}, {0.5, 20}, {2, 30}})
    EXPECT_EQ(Formula("in0 < 0 ? 10 : in0 < 1 ? 20 : 30", {x}), expected);
  EXPECT_EQ(Formula("(in0 ? 1 : 2) + (in1 ? 10 : 20)", {0, 1}), 12);
  EXPECT_EQ(Formula("min(3, 1, 2) + max(4) + max(1, 5, -2)"), 10);
  EXPECT_EQ(Formula("clamp(5, 0, 2) + clamp(-5, -1, 2) + abs(-3) + sign(-9) + fmod(7, 4)"), 6);
  EXPECT_EQ(Formula("floor(2.7) + ceil(2.1) + round(2.5) + sqrt(16) + pow(2, 10)"), 1036);
  EXPECT_EQ(Formula("smoothstep(0, 2, 1) + linstep(0, 4, 1) + linstep(1, 1, 2)"), 1.75);
  EXPECT_EQ(Formula("sin(in0) + cos(in0)", {0.3}), Sin(0.3) + Cos(0.3));
  EXPECT_EQ(Formula("tan(0.3)"), Sin(0.3) / Cos(0.3));
  EXPECT_EQ(Formula("exp(log(2)) - asin(0.5) + acos(0.1) - atan(2) + atan2(1, -2)"),
            Exp(Log(2)) - Asin(0.5) + Acos(0.1) - Atan2(2, 1) + Atan2(1, -2));
  EXPECT_EQ(Formula("pi * e"), kPi * 2.71828182845904523536);
  EXPECT_EQ(Formula("in0 / 0", {1}), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(Formula("sqrt(in0)", {-1})));
}

TEST(Expressions, SayWhatIsWrongAndWhere) {
  const auto error = [](const std::string& text, std::size_t inputs = 2) {
    const Result<Expression> program = Expression::Compile(text, inputs);
    return program.ok() ? "no error" : program.status().ToString();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(error("1 + foo"), "character 5: ")) << error("1 + foo");
  EXPECT_TRUE(has(error("1 + foo"), "\"foo\"")) << error("1 + foo");
  EXPECT_TRUE(has(error("1 + in2"), "inputs are in0 to in1")) << error("1 + in2");
  EXPECT_TRUE(has(error("in0", 0), "no input is set")) << error("in0", 0);
  for (const char* bad : {"",     "1 +",     "(1",   "1)",       "sin()", "sin(1, 2)", "1 2",
                          "* 3",  "in0 = 3", "1, 2", "\"text\"", "1 ? 2", "printf(1)", "in0 in1",
                          "1..2", "#",       "rnd",  "_pi",      "0x10",  "nan",       "inf"}) {
    const std::string text = error(bad);
    EXPECT_TRUE(has(text, "expression \"")) << bad << ": " << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_FALSE(has(text, "position")) << text;
  }
  EXPECT_TRUE(has(error(std::string(5000, '1')), "at most 4096")) << error(std::string(5000, '1'));
  EXPECT_EQ(error(std::string(2000, '(') + "1" + std::string(2000, ')')), "no error");
}

TEST(Expressions, DoNotKnowTheLocale) {
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
  };
  const std::locale old = std::locale::global(std::locale(std::locale::classic(), new Comma));
  EXPECT_EQ(Formula("1.5 + max(1,5)"), 6.5);
  std::locale::global(old);
}

TEST(Expressions, OneProgramServesManyThreads) {
  const Result<Expression> program =
      Expression::Compile("in0 > 0.5 ? sin(in0) * in1 : max(in0, in1, 0.25) ^ 3", 2);
  ASSERT_TRUE(program.ok());
  std::vector<std::vector<double>> results(4);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < results.size(); ++t) {
    threads.emplace_back([&, t] {
      std::vector<double> stack(program->stack_size());
      for (int i = 0; i < 5000; ++i)
        results[t].push_back(program->Run(std::vector<double>{i / 5000.0, 0.3}, stack));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<double>& result : results) EXPECT_EQ(result, results[0]);
  EXPECT_EQ(results[0][4000], Sin(0.8) * 0.3);
}

TEST(Expressions, AreANode) {
  TestGraph g(StandardNodes());
  g.add("expression", "n", {{"expression", "in0 * 2 + in2"}, {"input[0]", 3.0}, {"input[2]", 0.5}});
  g.vary("n.input[0]");
  g.want("n.output");
  EXPECT_EQ(g.pull<double>("n.output"), 6.5);
  g.set("n.input[0]", 5.0);
  EXPECT_EQ(g.pull<double>("n.output"), 10.5);

  TestGraph bad(StandardNodes());
  bad.add("expression", "broken", {{"expression", "in0 +"}, {"input[0]", 3.0}});
  const std::string text = bad.try_pull("broken.output").ToString();
  EXPECT_NE(text.find("node \"broken\" (expression): expression \"in0 +\", character 7"), std::string::npos)
      << text;
}

TEST(Expressions, TheDefaultIsZero) {
  TestGraph g(StandardNodes());
  g.add("expression", "n");
  EXPECT_EQ(g.pull<double>("n.output"), 0);
}

}  // namespace
}  // namespace kpsa::engine
