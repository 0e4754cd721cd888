// Libraries of nodes: by `plugins:` of a rig, by --plugin, and those that are refused.
#include "graph/plugin.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/cli/refusals.h"

namespace kpsa::engine {
namespace {

class Plugins : public RefusalTest {
 protected:
  Plugins() {
    std::filesystem::create_directory(folder / "lib");
    std::filesystem::copy_file(KPSA_WOBBLE, folder / "lib/wobble.so");
    std::filesystem::copy_file(kHelloGlb, folder / "hello.glb");
    folder.Write("rig.yaml", Rig("plugins: [lib/wobble.so]\n"));
    folder.Write("bare.yaml", Rig(""));
  }
  static std::string Rig(const std::string& head) {
    return "kpsa: 1\ncharacter: hello.glb\n" + head +
           "nodes: {sway: {type: wobble, input: time.time, period: 12f, amplitude: 30}}\n"
           "connections: [sway.output -> upper.rotateZ]\n";
  }
  // The path of a library that must be refused.
  static std::string Broken(const std::string& name) {
    return fmt::format("{}/libplugin_{}.so", KPSA_BROKEN_PLUGINS, name);
  }
  std::vector<double> Get(const std::vector<std::string>& rig, const std::string& plug) const {
    std::vector<std::string> arguments = {"get"};
    arguments.insert(arguments.end(), rig.begin(), rig.end());
    arguments.insert(arguments.end(), {plug, "--times", "0,0.125,0.25,0.375", "--json"});
    std::string out;
    ExpectGood(arguments, &out);
    const nlohmann::json json = nlohmann::json::parse(out, nullptr, false);
    return json.is_discarded() ? std::vector<double>()
                               : json["plugs"][0]["values"].get<std::vector<double>>();
  }
};

TEST_F(Plugins, ARigLoadsItsLibraryFromItsFolder) {
  EXPECT_EQ(Get({"rig.yaml"}, "sway.output"), (std::vector<double>{-30, 0, 30, 0}));
  ExpectGood({"eval", "rig.yaml", "--times", "0,0.25", "-o", "a.npz"});
  ExpectGood({"eval", "rig.yaml", "--times", "0,0.25", "--set", "sway.amplitude=0", "-o", "b.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "a.npz", folder / "b.npz"}).exit_code, 1)
      << "the node moves nothing";
  // From another folder, and from an included file
  EXPECT_EQ(RunKpsa({"validate", folder / "rig.yaml", "--plugins"}).exit_code, 0);
  std::filesystem::create_directory(folder / "parts");
  folder.Write("parts/part.yaml", "kpsa: 1\nplugins: ../lib/wobble.so\n");
  folder.Write("whole.yaml", Rig("include: parts/part.yaml\nplugins: [./lib/wobble.so]\n"));
  EXPECT_EQ(Get({"whole.yaml"}, "sway.output"), (std::vector<double>{-30, 0, 30, 0}));
}

TEST_F(Plugins, TheCommandLineLoadsThemToo) {
  ExpectBadFile("bare.yaml", Rig(""), {"bare.yaml:3", "unknown node type \"wobble\""});
  EXPECT_EQ(Get({"bare.yaml", "--plugin", "lib/wobble.so"}, "sway.output"),
            (std::vector<double>{-30, 0, 30, 0}));
  ExpectGood({"inspect", "bare.yaml", "--plugin", "lib/wobble.so"});
  ExpectGood({"inspect", "rig.yaml", "--plugins"});
  ExpectGood({"inspect", "rig.yaml", "--plugin", "lib/wobble.so"});
  // Both name it: it is loaded once
  EXPECT_EQ(Get({"rig.yaml", "--plugin", "lib/wobble.so", "--plugin", "lib/../lib/wobble.so"}, "sway.output"),
            (std::vector<double>{-30, 0, 30, 0}));
}

// What a rig names is native code that somebody else wrote.
TEST_F(Plugins, AreNotLoadedByCommandsThatOnlyReadNorWhereTheyAreRefused) {
  const std::vector<std::string> reading[] = {
      {"inspect", "rig.yaml"}, {"validate", "rig.yaml"}, {"compile", "rig.yaml"}, {"fmt", "rig.yaml"}};
  for (std::vector<std::string> command : reading) {
    ExpectRefused(command, 3, {"rig.yaml:3:", "wobble.so\" is not loaded", "expected --plugins"});
    command.push_back("--plugins");
    ExpectGood(command);
  }
  ExpectRefused({"eval", "rig.yaml", "--no-plugins", "-o", "a.npz"}, 3,
                {"wobble.so\" is not loaded: --no-plugins"});
  ExpectGood(
      {"eval", "rig.yaml", "--no-plugins", "--plugin", "lib/wobble.so", "--times", "0", "-o", "a.npz"});
  // Not even its first instruction runs: a library that ends the program where it is loaded
  const std::string deadly = fmt::format("{}/libplugin_deadly.so", KPSA_BROKEN_PLUGINS);
  folder.Write("deadly.yaml", fmt::format("kpsa: 1\ncharacter: hello.glb\nplugins: [\"{}\"]\n", deadly));
  for (const char* command : {"inspect", "validate", "compile", "fmt"})
    EXPECT_EQ(RunKpsa({command, folder / "deadly.yaml"}).exit_code, 3) << command;
  EXPECT_EQ(RunKpsa({"inspect", folder / "deadly.yaml", "--plugins"}).exit_code, 77);
}

TEST_F(Plugins, TheReferenceTellsOfTheirNodes) {
  std::string out;
  ExpectGood({"nodes", "wobble", "--plugin", "lib/wobble.so"}, &out);
  EXPECT_NE(out.find("A triangle wave."), std::string::npos);
  EXPECT_NE(out.find("amplitude"), std::string::npos);
  ExpectRefused({"nodes", "wobble"}, 2, {"no node type is called \"wobble\""});
}

TEST_F(Plugins, BadLibrariesAreRefused) {
  folder.Write("text.so", "#!/bin/sh\n");
  folder.Write("cut.so", TemporaryFolder::Read(KPSA_WOBBLE).substr(0, 3000));
  const std::tuple<std::string, std::vector<std::string>> cases[] = {
      {"none.so", {"none.so\": No such file"}},
      {"lib", {"lib\": expected a shared library, found no regular file"}},
      {"text.so", {"text.so\" cannot be loaded", "expected a shared library of nodes"}},
      {"cut.so", {"cut.so\" cannot be loaded"}},
      {Broken("silent"), {"exports no kpsa_plugin_abi", "KPSA_PLUGIN"}},
      {Broken("mute"), {"exports no kpsa_register", "KPSA_PLUGIN"}},
      {Broken("old"), {fmt::format("is of ABI version {}, expected {}", kPluginAbi - 1, kPluginAbi)}},
      {Broken("unresolved"), {"cannot be loaded", "a_function_that_nobody_has"}},
      {Broken("twice"), {"node type \"half\" is registered twice; expected each name once"}},
      {Broken("taken"), {"registers the node type \"transform\", which kpsa itself has already"}},
      {Broken("nameless"), {"a node type has no name"}},
      {Broken("mistyped"),
       {"node type \"three\": compute takes 3 parameters; expected 2",
        "attribute \"output\" (double): compute returns "
        "an integer; expected double"}},
      {Broken("throwing"), {"no licence found"}},
  };
  for (const auto& [path, parts] : cases) {
    std::vector<std::string> at_line = parts, at_option = parts;
    at_line.insert(at_line.end(), {"bad.yaml:3:", path});
    at_option.insert(at_option.end(), {"--plugin: ", path});
    ExpectBadFile("bad.yaml", fmt::format("kpsa: 1\ncharacter: hello.glb\nplugins: [\"{}\"]\n", path),
                  at_line);
    ExpectRefused({"nodes", "--plugin", path}, 3, at_option);
  }
  ExpectBadFile("bad.yaml", Rig("plugins: {a: b}\n"), {"bad.yaml:3:", "plugins: expected a list of files"});
}

TEST_F(Plugins, TwoThatClashAreNamedBoth) {
  ExpectRefused({"nodes", "--plugin", "lib/wobble.so", "--plugin", Broken("rival")}, 3,
                {"libplugin_rival.so", "\"wobble\"", "which plugin \"lib/wobble.so\" has already"});
}

}  // namespace
}  // namespace kpsa::engine
