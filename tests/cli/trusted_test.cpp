// What a rig names stays in its folder: by `..`, and by symbolic links, for every kind of file; what is written also by absolute paths.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

constexpr char kWeights[] =
    R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 1, "indices": [], "values": []}}})";
constexpr char kSkin[] =
    R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"tip": {"default": 1, "indices": [], "values": []}}})";

// A way in which a rig's file may name another, and a file that it may name so; PATH stands for it.
struct Kind {
  std::string name, file, rig;
};
const std::string kBody = "kpsa: 1\ncharacter: c.gltf\n";
const std::vector<Kind> kKinds = {
    {"character", "c.gltf", "kpsa: 1\ncharacter: 'PATH'\n"},
    {"include", "part.yaml", kBody + "include: ['PATH']\n"},
    {"plugin", "wobble.so", kBody + "plugins: ['PATH']\n"},
    {"weights", "w.json",
     kBody +
         "nodes: {l: {type: cluster, weights: 'PATH#m'}}\ndeform: [{meshes: [body], stack: [gltf, l]}]\n"},
    {"influences", "skin.json", kBody + "overrides: {body_skinCluster.influences: 'PATH'}\n"},
    {"shapes", "shape.obj",
     kBody + "nodes: {fix: {type: blendShape, targets: {file: 'PATH'}}}\ndeform: [{meshes: [body], stack: "
             "[gltf, fix]}]\n"},
    {"reference", "c.gltf", "kpsa: 1\nreferences: {a: {file: 'PATH'}}\n"},
    {"template", "w.json",
     kBody + "templates: {t: {params: {map: string}, nodes: {l: {type: cluster, weights: '$(map)#m'}}}}\n"
             "use: {u: {template: t, map: 'PATH'}}\ndeform: [{meshes: [body], stack: [gltf, 'u:l']}]\n"},
    {"subspace", "f.kpsa",
     kBody + "accelerate: {f: {points: [body@skin], subspace: 'PATH', tolerance: 1cm}}\n"},
};

class Trusted : public ::testing::Test {
 protected:
  Trusted() {
    for (const char* where : {"rig/", "outside/"}) {
      const std::string in = where;
      folder.Write(in + "c.gltf", GltfBuilder::Character().Text());
      folder.Write(in + "part.yaml", "kpsa: 1\nnodes: {x: {type: transform}}\n");
      folder.Write(in + "w.json", kWeights);
      folder.Write(in + "skin.json", kSkin);
      folder.Write(in + "shape.obj", "o up\nv 0 0 1\nv 1 0 0\nv 0 1 0\n");
      fs::copy_file(KPSA_WOBBLE, folder / (in + "wobble.so"));
      folder.Write(in + "f.kpsa", "nothing that validate reads");
    }
    fs::create_directory_symlink("../outside", folder / "rig/way");
  }
  // As somebody who trusts nothing else.
  ProcessResult Run(const std::vector<std::string>& arguments) const {
    return RunKpsa(arguments, 60, folder / "rig", {"KPSA_TRUST="});
  }
  std::string WriteNaming(const Kind& kind, const std::string& path) const {
    std::string rig = kind.rig;
    rig.replace(rig.find("PATH"), 4, path);
    return folder.Write("rig/rig.yaml", rig);
  }
  void ExpectLeaves(const ProcessResult& run, const std::string& what) const {
    EXPECT_EQ(run.exit_code, 3) << what << run.err;
    EXPECT_NE(run.err.find("rig.yaml:"), std::string::npos) << what << run.err;
    EXPECT_NE(run.err.find("leads out of the rig's folder"), std::string::npos) << what << run.err;
    EXPECT_NE(run.err.find("--trust " + (folder / "outside")), std::string::npos) << what << run.err;
    EXPECT_EQ(run.error_lines(), 1u) << what << run.err;
  }
  TemporaryFolder folder;
};

TEST_F(Trusted, WhatARigNamesStaysInItsFolder) {
  for (const Kind& kind : kKinds) {
    fs::create_symlink(folder / ("outside/" + kind.file), folder / ("rig/link_" + kind.file));
    std::vector<std::string> paths = {"../outside/" + kind.file, "link_" + kind.file, "way/" + kind.file,
                                      "./way/../outside/" + kind.file};
    if (kind.name == "subspace") paths.push_back(folder / ("outside/" + kind.file));
    for (const std::string& path : paths) {
      const std::string what = kind.name + " " + path + ": ";
      WriteNaming(kind, path);
      ExpectLeaves(Run({"validate", "rig.yaml", "--plugins"}), what);
      // It is the trust alone that lacks
      const ProcessResult trusted = Run({"validate", "rig.yaml", "--plugins", "--trust", "../outside"});
      EXPECT_EQ(trusted.exit_code, 0) << what << trusted.err;
    }
    // Within the folder all ways are open
    fs::remove(folder / ("rig/link_" + kind.file));
    fs::create_symlink(kind.file, folder / ("rig/link_" + kind.file));
    for (const std::string& path :
         {kind.file, "link_" + kind.file, "../rig/" + kind.file, folder / ("rig/" + kind.file)}) {
      WriteNaming(kind, path);
      const ProcessResult run = Run({"validate", "rig.yaml", "--plugins"});
      EXPECT_EQ(run.exit_code, 0) << kind.name << " " << path << run.err;
    }
    fs::remove(folder / ("rig/link_" + kind.file));
  }
}

TEST_F(Trusted, AbsolutePathsAreReadAndWhatTheirPartsNameBesideThem) {
  for (const Kind& kind : kKinds) {
    if (kind.name == "subspace") continue;
    WriteNaming(kind, folder / ("outside/" + kind.file));
    const ProcessResult run = Run({"validate", "rig.yaml", "--plugins"});
    EXPECT_EQ(run.exit_code, 0) << kind.name << run.err;
  }
  folder.Write("outside/part.yaml", "kpsa: 1\nnodes: {l: {type: cluster, weights: 'w.json#m'}}\n");
  folder.Write("rig/rig.yaml", kBody + "include: ['" + (folder / "outside/part.yaml") +
                                   "']\ndeform: [{meshes: [body], stack: [gltf, l]}]\n");
  ProcessResult run = Run({"validate", "rig.yaml"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  folder.Write("outside/part.yaml", "kpsa: 1\nnodes: {l: {type: cluster, weights: '../rig2/w.json#m'}}\n");
  folder.Write("rig2/w.json", kWeights);
  run = Run({"validate", "rig.yaml"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("leads out of the rig's folder"), std::string::npos) << run.err;
}

TEST_F(Trusted, NothingOfAFileOutsideIsShown) {
  folder.Write("outside/part.yaml", "kpsa: 1\nSECRET: 1\n");
  WriteNaming(kKinds[1], "../outside/part.yaml");
  const ProcessResult run = Run({"validate", "rig.yaml"});
  ExpectLeaves(run, "");
  EXPECT_EQ(run.err.find("SECRET"), std::string::npos) << run.err;
  EXPECT_NE(Run({"validate", "rig.yaml", "--trust", "../outside"}).err.find("SECRET"), std::string::npos)
      << "as a canary";
}

TEST_F(Trusted, TrainingWritesNothingOutside) {
  fs::create_symlink(folder / "outside/new.kpsa", folder / "rig/nowhere.kpsa");
  for (const char* path : {"../outside/new.kpsa", "way/new.kpsa", "nowhere.kpsa"}) {
    WriteNaming(kKinds.back(), path);
    const ProcessResult run = Run({"train", "rig.yaml", "--force"});
    EXPECT_EQ(run.exit_code, 3) << path << run.err;
    EXPECT_FALSE(fs::exists(folder / "outside/new.kpsa")) << path;
  }
  EXPECT_NE(Run({"train", "rig.yaml"}).err.find("a symbolic link that leads nowhere"), std::string::npos);
}

TEST_F(Trusted, AReferencedRigMayNameWhatTheRigMay) {
  folder.Write("rig/props/hat.yaml", "kpsa: 1\ncharacter: ../c.gltf\n");
  folder.Write("outside/hat.yaml", "kpsa: 1\ncharacter: ../rig/c.gltf\n");
  WriteNaming(kKinds[6], "props/hat.yaml");
  EXPECT_EQ(Run({"validate", "rig.yaml"}).exit_code, 0);
  EXPECT_EQ(Run({"validate", "props/hat.yaml"}).exit_code, 3) << "by itself it has its own folder";
  WriteNaming(kKinds[6], "../outside/hat.yaml");
  EXPECT_EQ(Run({"validate", "rig.yaml", "--trust", "../outside"}).exit_code, 0);
  folder.Write("rig/props/hat.yaml", "kpsa: 1\ncharacter: ../../outside/c.gltf\n");
  WriteNaming(kKinds[6], "props/hat.yaml");
  const ProcessResult run = Run({"validate", "rig.yaml"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("hat.yaml:2:12: "), std::string::npos) << run.err;
}

TEST_F(Trusted, WhatAGltfNamesStaysInItsFolder) {
  const auto with = [&](const std::string& uri) {
    GltfBuilder b = GltfBuilder::Character();
    folder.Write("outside/data.bin",
                 std::string(reinterpret_cast<const char*>(b.buffer.data()), b.buffer.size()));
    b.root["buffers"] = {{{"byteLength", b.buffer.size()}, {"uri", uri}}};
    folder.Write("rig/named.gltf", b.root.dump());
    return Run({"inspect", "named.gltf"});
  };
  fs::create_symlink("../outside/data.bin", folder / "rig/link.bin");
  for (const char* uri : {"link.bin", "way/data.bin"}) {
    const ProcessResult run = with(uri);
    EXPECT_EQ(run.exit_code, 3) << uri;
    EXPECT_NE(run.err.find("leaves the document's folder by a symbolic link"), std::string::npos) << run.err;
  }
  fs::copy_file(folder / "outside/data.bin", folder / "rig/data.bin");
  fs::remove(folder / "rig/link.bin");
  fs::create_symlink("data.bin", folder / "rig/link.bin");
  EXPECT_EQ(with("link.bin").exit_code, 0) << "as a canary";
}

TEST_F(Trusted, AProjectOpensItsFolders) {
  WriteNaming(kKinds[0], "../outside/c.gltf");
  EXPECT_EQ(Run({"validate", "rig.yaml"}).exit_code, 3);
  folder.Write("kpsa.project", "");
  EXPECT_EQ(Run({"validate", "rig.yaml"}).exit_code, 0);
  fs::remove(folder / "kpsa.project");
  EXPECT_EQ(
      RunKpsa({"validate", "rig.yaml"}, 60, folder / "rig", {"KPSA_TRUST=" + (folder / "outside")}).exit_code,
      0);
  const ProcessResult nowhere = Run({"validate", "rig.yaml", "--trust", "nowhere"});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_NE(nowhere.err.find("--trust \"nowhere\""), std::string::npos) << nowhere.err;
  // The committed scenes share parts
  for (const char* scene : {"boy/boy.yaml", "animal/animal_heavy.yaml"})
    EXPECT_EQ(Run({"validate", std::string(KPSA_SCENES_DIR "/") + scene}).exit_code, 0) << scene;
}

TEST_F(Trusted, InitNamesACharacterThatIsElsewhereByItsWholePath) {
  fs::create_directory(folder / "rig/new");
  const ProcessResult init = Run({"init", "../outside/c.gltf", "-o", "new/rig.yaml"});
  EXPECT_EQ(init.exit_code, 0) << init.err;
  EXPECT_NE(
      TemporaryFolder::Read(folder / "rig/new/rig.yaml").find("character: \"" + (folder / "outside/c.gltf")),
      std::string::npos);
  EXPECT_EQ(Run({"validate", "new/rig.yaml"}).exit_code, 0);
  // A character of the project is named where it is
  folder.Write("kpsa.project", "");
  EXPECT_EQ(Run({"init", "../outside/c.gltf", "-o", "named.yaml"}).exit_code, 0);
  EXPECT_NE(TemporaryFolder::Read(folder / "rig/named.yaml").find("character: \"../outside/c.gltf\""),
            std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
