// Variants of the bundled hello rig, in a folder of their own.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "kpsa/training/trainer.h"
#include "tests/cli/glb_edit.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {

// `text` with its only `from` replaced; fails the test where that is not there once.
inline std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no \"" << from << "\"";
  if (at == std::string::npos) return text;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << "\"" << from << "\" twice";
  return text.replace(at, from.size(), to);
}

class HelloFolder : public TemporaryFolder {
 public:
  HelloFolder() {
    Write("hello.yaml", Yaml());
    Write("hello.glb", Glb());
  }
  // The files of scenes/hello.
  static std::string Yaml();
  static std::string Glb();
  // Its column five times: what one takes is too little to be worth training on a fast machine.
  static std::string Columns();
  // Writes hello.yaml with one place changed; its path.
  std::string Edit(const std::string& from, const std::string& to) const {
    return Write("hello.yaml", Replaced(Read(*this / "hello.yaml"), from, to));
  }
  std::string rig() const { return *this / "hello.yaml"; }
  // Adds "shell", a second mesh with the points and the skin of the first.
  void AddShell() const {
    GlbParts glb(Read(*this / "hello.glb"));
    nlohmann::json shell = glb.json["nodes"][2];
    shell["name"] = "shell";
    glb.json["nodes"].push_back(shell);
    glb.json["scenes"][0]["nodes"].push_back(3);
    Write("hello.glb", glb.Bytes());
  }
  // Adds the clip "sway", in which the lower joint turns as the upper one does in "wave".
  void AddSway() const {
    GlbParts glb(Read(*this / "hello.glb"));
    nlohmann::json sway = glb.json["animations"][0];
    sway["name"] = "sway";
    sway["channels"][0]["target"]["node"] = 0;
    glb.json["animations"].push_back(sway);
    Write("hello.glb", glb.Bytes());
  }
};

// A second of training, at a tolerance that most poses keep.
inline constexpr double kQuickTolerance = 2e-3;
inline TrainOptions QuickTraining() {
  TrainOptions options;
  options.samples = 600;
  options.calibration_poses = 400;
  options.tolerance = kQuickTolerance;
  options.violation_rate = 0.05;
  return options;
}

}  // namespace kpsa::engine
