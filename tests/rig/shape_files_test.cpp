// Targets of blend shapes from files, on a small character: `sheet` (nine places, of which a seam splits three: twelve
// vertices, nine points) and `patch` (three vertices), both without skins.
#include <fmt/format.h>
#include <sys/stat.h>

#include <random>

#include "files/npz.h"
#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

using Floats = std::vector<float>;

constexpr Index kVertices = 12, kPlaces = 9;
// The place of each vertex: those after a seam come again.
constexpr Index kPlaceOf[kVertices] = {0, 1, 2, 3, 4, 5, 3, 4, 5, 6, 7, 8};

Floats SheetPositions() {
  Floats positions;
  for (const Index place : kPlaceOf) {
    const auto at = static_cast<float>(place);
    positions.insert(positions.end(), {0.3f * static_cast<float>(place % 3), 0.1f * at,
                                       0.25f * static_cast<float>(place / 3)});
  }
  return positions;
}

int PushMesh(GltfBuilder* b, const std::string& name, const Floats& positions,
             const nlohmann::json& targets = {}, const std::vector<std::string>& names = {}) {
  std::vector<std::uint16_t> indices;
  for (std::size_t i = 0; i < positions.size() / 3; ++i) indices.push_back(static_cast<std::uint16_t>(i));
  nlohmann::json mesh = {{"primitives",
                          {{{"attributes", {{"POSITION", b->Accessor(positions, "VEC3")}}},
                            {"indices", b->Accessor(indices, "SCALAR")}}}}};
  if (!targets.is_null()) mesh["primitives"][0]["targets"] = targets;
  if (!names.empty()) mesh["extras"] = {{"targetNames", names}};
  return b->Push("nodes", {{"name", name}, {"mesh", b->Push("meshes", mesh)}});
}

class ShapeFiles : public RigFixture {
 protected:
  ShapeFiles() {
    GltfBuilder b;
    Floats bulge(3 * kVertices, 0.f);
    bulge[2] = 0.5f;
    PushMesh(&b, "sheet", SheetPositions(), {{{"POSITION", b.Accessor(bulge, "VEC3")}}}, {"bulge"});
    PushMesh(&b, "patch", {2, 0, 0, 3, 0, 0, 2, 1, 0});
    b.Push("scenes", {{"nodes", {0, 1}}});
    folder.Write("c.gltf", b.Text());
  }
  // A displacement for each place, the same for all vertices there.
  static Floats Displacements(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> number(-0.2f, 0.2f);
    Floats by_place(3 * kPlaces), values;
    for (float& x : by_place) x = number(random);
    for (const Index place : kPlaceOf)
      values.insert(values.end(), &by_place[3 * place], &by_place[3 * place] + 3);
    return values;
  }
  static Floats Positions(const Floats& displacements) {
    Floats values = SheetPositions();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += displacements[i];
    return values;
  }
  template <typename T>
  void WriteNpz(const std::string& name, const std::map<std::string, std::vector<T>>& arrays) const {
    Result<NpzWriter> writer = NpzWriter::Create(folder / name, true);
    ASSERT_TRUE(writer.ok());
    for (const auto& [key, values] : arrays)
      ASSERT_TRUE(writer->Add(key, {values.size() / 3, 3}, values).ok());
    ASSERT_TRUE(writer->Finish().ok());
  }
  static std::string Obj(const Floats& positions, double scale = 1, const char* number = "{:.9g}") {
    std::string text = "# a shape\n";
    for (std::size_t i = 0; i < positions.size(); ++i)
      text += (i % 3 == 0 ? "v " : " ") + fmt::format(fmt::runtime(number), positions[i] * scale) +
              (i % 3 == 2 ? "\n" : "");
    return text + "f 1 2 3\n";
  }
  // A rig with one blend shape on the sheet.
  std::string WriteRig(const std::string& targets, const std::string& more = "") const {
    return folder.Write("t.yaml",
                        "kpsa: 1\ncharacter: c.gltf\nnodes:\n  fix: {type: blendShape, targets: " + targets +
                            "}\ndeform: [{meshes: [sheet], stack: [morph, fix]}]\n" + more);
  }
  std::string ErrorsOf(const std::string& targets) {
    const Result<Rig> rig = LoadRig(StandardRegistry(), WriteRig(targets));
    return rig.ok() ? "no error" : Short(rig.status().ToString());
  }
  // By vertex of the sheet.
  static std::vector<Double3> Vertices(RigPlayer* player) {
    const std::vector<Double3> points = player->Points("fix");
    std::vector<Double3> vertices;
    for (Index v = 0; v < kVertices; ++v) vertices.push_back(points.at(player->PointOf(v)));
    return vertices;
  }
};

// What the points ought to be, said again: rest plus weighted displacements, the mean of a place's vertices.
std::vector<Double3> Twin(const std::vector<std::pair<double, Floats>>& weighted) {
  std::vector<Double3> places(kPlaces), vertices;
  std::vector<double> count(kPlaces, 0.0);
  const Floats rest = SheetPositions();
  for (Index v = 0; v < kVertices; ++v) {
    Double3 moved;
    for (const auto& [weight, d] : weighted)
      moved = moved + Double3{d[3 * v], d[3 * v + 1], d[3 * v + 2]} * weight;
    places[kPlaceOf[v]] = places[kPlaceOf[v]] + moved;
    count[kPlaceOf[v]] += 1;
  }
  for (Index v = 0; v < kVertices; ++v)
    vertices.push_back(Double3{rest[3 * v], rest[3 * v + 1], rest[3 * v + 2]} +
                       places[kPlaceOf[v]] * (1 / count[kPlaceOf[v]]));
  return vertices;
}

TEST_F(ShapeFiles, EveryFormatActsAsTheTwin) {
  const Floats a = Displacements(1), b = Displacements(2);
  WriteNpz<float>("positions.npz", {{"a", Positions(a)}, {"b", Positions(b)}});
  WriteNpz<double>("displacements.npz", {{"a", {a.begin(), a.end()}}, {"b", {b.begin(), b.end()}}});
  folder.Write("shapes/both.obj", "o a\n" + Obj(Positions(a)) + "o b\n" + Obj(Positions(b)));
  folder.Write("a.obj", Obj(Positions(a)));
  folder.Write("b.obj", Obj(Positions(b), 100));
  GltfBuilder morphs, meshes;
  PushMesh(&morphs, "any", Positions(b),
           {{{"POSITION", morphs.Accessor(a, "VEC3")}}, {{"POSITION", morphs.Accessor(b, "VEC3")}}},
           {"a", "b"});
  PushMesh(&meshes, "a", Positions(a));
  PushMesh(&meshes, "b", Positions(b));
  for (GltfBuilder* document : {&morphs, &meshes}) {
    nlohmann::json all;
    for (std::size_t i = 0; i < document->root["nodes"].size(); ++i) all.push_back(i);
    document->Push("scenes", {{"nodes", all}});
  }
  folder.Write("morphs.glb", morphs.Glb());
  folder.Write("meshes.gltf", meshes.Text());
  for (const char* targets :
       {"{file: positions.npz}", "[{file: positions.npz, shapes: [a, b], as: positions, unit: m}]",
        "{file: displacements.npz, as: displacements}",
        "[{file: shapes/both.obj, shapes: a}, {file: shapes/both.obj, shapes: [b]}]",
        "[{file: a.obj}, {file: b.obj, unit: cm}]", "{file: morphs.glb}",
        "{file: morphs.glb, from: any, shapes: [b, a]}", "{file: meshes.gltf, shapes: [a, b]}",
        "[{file: a.obj, name: a, mesh: sheet}, {file: meshes.gltf, from: b, name: b}]"}) {
    SCOPED_TRACE(targets);
    RigPlayer player(WriteRig(
        targets, "controls: {'fix.weight[a]': {min: -1, max: 2}, 'fix.weight[b]': {min: -1, max: 2}}\n"));
    ASSERT_TRUE(player.ok());
    for (const auto& [wa, wb] : {std::pair(1.0, 0.0), std::pair(0.0, 1.0), std::pair(0.7, -0.4)}) {
      player.Set("fix.weight[a]", wa);
      player.Set("fix.weight[b]", wb);
      EXPECT_LT(MaxDistance(Vertices(&player), Twin({{wa, a}, {wb, b}})), 5e-7);
    }
    EXPECT_TRUE(player.rig.notes.empty()) << player.rig.notes.front();
  }
}

TEST_F(ShapeFiles, AShapeMayHaveANumberForEachPoint) {
  const Floats a = Displacements(3);
  Floats by_point;  // of the vertices that are welded, the first alone
  for (const Index v : {0, 1, 2, 3, 4, 5, 9, 10, 11})
    by_point.insert(by_point.end(), &a[3 * v], &a[3 * v] + 3);
  WriteNpz<float>("a.npz", {{"a", by_point}});
  RigPlayer player(
      WriteRig("{file: a.npz, as: displacements}", "controls: {'fix.weight[a]': {min: 0, max: 1}}\n"));
  ASSERT_TRUE(player.ok());
  player.Set("fix.weight[a]", 1);
  EXPECT_LT(MaxDistance(Vertices(&player), Twin({{1, a}})), 5e-7);
}

// Six decimals of an .obj are no displacements: what was not sculpted stays where it is, bit for bit.
TEST_F(ShapeFiles, RoundingMovesNothing) {
  Floats a(3 * kVertices, 0.f);
  a[1] = 0.0625f;
  folder.Write("a.obj", Obj(Positions(a), 1, "{:.6f}"));
  RigPlayer player(WriteRig("{file: a.obj}", "controls: {'fix.weight[a]': {min: 0, max: 1}}\n"));
  ASSERT_TRUE(player.ok());
  const Value targets = Held(player.rig, "fix.targets[0]");
  ASSERT_NE(targets.asset<MorphTargets>(), nullptr);
  EXPECT_EQ(targets.asset<MorphTargets>()->targets()[0].points, std::vector<Index>{player.PointOf(0)});
}

TEST_F(ShapeFiles, PointsThatAreOneStayOneAndANoteSaysSo) {
  Floats torn = Displacements(4);
  torn[3 * 7] += 0.1f;  // the second vertex of place 4
  WriteNpz<float>("a.npz", {{"a", torn}});
  RigPlayer player(
      WriteRig("{file: a.npz, as: displacements}", "controls: {'fix.weight[a]': {min: 0, max: 1}}\n"));
  ASSERT_TRUE(player.ok());
  player.Set("fix.weight[a]", 1);
  EXPECT_LT(MaxDistance(Vertices(&player), Twin({{1, torn}})), 5e-7);
  ASSERT_EQ(player.rig.notes.size(), 1u);
  EXPECT_EQ(Short(player.rig.notes[0]),
            "t.yaml:4:36: shape \"a\" of a.npz pulls vertices apart that are one point of sheet, at 1 place: "
            "these go "
            "to the mean (weld: off keeps them apart)");
}

TEST_F(ShapeFiles, AnotherUnitIsSuspected) {
  folder.Write("a.obj", Obj(Positions(Displacements(5)), 100));
  const Result<Rig> rig = LoadRig(StandardRegistry(), WriteRig("[{file: a.obj}]"));
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  ASSERT_EQ(rig->notes.size(), 1u);
  EXPECT_TRUE(Has(rig->notes[0], "is it in another unit (unit: cm)")) << rig->notes[0];
}

// One target for two meshes; morph targets of the character beside it, and rules between all of them.
TEST_F(ShapeFiles, OneTargetOfSeveralMeshesWithRules) {
  const Floats a = Displacements(6), b = Displacements(7);
  WriteNpz<float>("sheet.npz", {{"smile", Positions(a)}, {"half", Positions(b)}});
  WriteNpz<float>("patch.npz", {{"smile", {0, 0, 1, 0, 0, 2, 0, 0, 3}}});
  folder.Write("t.yaml", R"(kpsa: 1
character: c.gltf
nodes:
  fix:
    type: blendShape
    targets: [bulge, {file: sheet.npz, mesh: sheet}, {file: patch.npz, mesh: patch, as: displacements}]
    inbetweens: {smile: {0.5: half}}
    combinations: {smile: {targets: [bulge]}}
deform: [{meshes: [sheet, patch], stack: [morph, fix]}]
controls: {'fix.weight[bulge]': {min: 0, max: 1}}
)");
  RigPlayer player(folder / "t.yaml");
  ASSERT_TRUE(player.ok());
  Floats bulge(3 * kVertices, 0.f);
  bulge[2] = 0.5f;
  for (const double w : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    player.Set("fix.weight[bulge]", w);
    const double half = w < 0.5 ? 2 * w : 2 - 2 * w, smile = w < 0.5 ? 0 : 2 * w - 1;
    EXPECT_LT(MaxDistance(Vertices(&player), Twin({{w, bulge}, {half, b}, {smile, a}})), 1e-6) << w;
    const std::vector<Double3> patch = player.Points(1);
    for (Index v = 0; v < 3; ++v) EXPECT_NEAR(patch[player.PointOf(v, 1)].z, smile * (v + 1.0), 1e-6) << w;
  }
}

TEST_F(ShapeFiles, FilesAreReadOnceAndListed) {
  folder.Write("s/readme", "");
  WriteNpz<float>("s/a.npz", {{"a", Displacements(1)}, {"b", Displacements(2)}});
  const Result<Rig> rig =
      LoadRig(StandardRegistry(),
              WriteRig("[{file: s/a.npz, shapes: a}, {file: s/a.npz, shapes: b, as: displacements}]"));
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  EXPECT_EQ(std::count(rig->files.begin(), rig->files.end(), folder / "s/a.npz"), 1);
}

TEST_F(ShapeFiles, WhatIsWrongIsToldWhereItStands) {
  const Floats a = Displacements(1);
  WriteNpz<float>("a.npz", {{"elbow", Positions(a)}, {"wrist", Positions(a)}});
  WriteNpz<float>("short.npz", {{"elbow", {0, 0, 0, 1, 1, 1}}});
  folder.Write("b.obj", Obj(Positions(a)));
  GltfBuilder two;
  for (const char* name : {"left", "right"})
    PushMesh(&two, name, Positions(a), {{{"POSITION", two.Accessor(a, "VEC3")}}}, {"up"});
  two.Push("scenes", {{"nodes", {0, 1}}});
  folder.Write("two.glb", two.Glb());

  EXPECT_EQ(ErrorsOf("{file: short.npz}"),
            "t.yaml:4:36: shape \"elbow\" of short.npz has 2 vertices; sheet has 12, or 9 where those that "
            "are welded "
            "count once");
  EXPECT_EQ(
      ErrorsOf("[bulge, {file: a.npz, shapes: elbw}]"),
      "t.yaml:4:66: shapes: \"elbw\" is no shape of a.npz (did you mean \"elbow\"?); it has elbow, wrist");
  EXPECT_EQ(ErrorsOf("{file: a.npz, from: sheet}"), "t.yaml:4:56: from: a.npz is no glTF file");
  EXPECT_EQ(ErrorsOf("{file: two.glb}"),
            "t.yaml:4:36: targets: two.glb has several meshes: say which one, from: left or from: right");
  EXPECT_EQ(ErrorsOf("{file: two.glb, shapes: up}"),
            "t.yaml:4:60: shapes: \"up\" is the name of several shapes of two.glb: say which one, from: left "
            "or from: "
            "right");
  EXPECT_EQ(ErrorsOf("{file: two.glb, from: lft}"),
            "t.yaml:4:58: from: \"lft\" is no mesh of two.glb (did you mean \"left\"?); it has left, right");
  EXPECT_EQ(ErrorsOf("{file: two.glb, from: left, as: positions}"),
            "t.yaml:4:68: as: shape \"up\" of two.glb has displacements");
  EXPECT_EQ(ErrorsOf("{file: a.npz, as: deltas}"),
            "t.yaml:4:54: as: expected positions or displacements, found \"deltas\"");
  EXPECT_EQ(ErrorsOf("{file: a.npz, unit: inch}").substr(0, 12), "t.yaml:4:56:");
  EXPECT_EQ(ErrorsOf("{file: a.npz, name: both}"),
            "t.yaml:4:56: name: expected it of one shape, and a.npz has 2");
  EXPECT_EQ(ErrorsOf("{file: a.npz, mesh: patch}"),
            "t.yaml:4:36: targets: \"fix\" does not deform patch; it deforms sheet");
  EXPECT_TRUE(Has(ErrorsOf("{file: a.npz, mesh: shet}"), "unknown mesh \"shet\" (did you mean \"sheet\"?)"));
  EXPECT_EQ(ErrorsOf("[elbow, {file: a.npz}]"),
            "t.yaml:4:44: targets: \"elbow\" is named twice: here and at t.yaml:4:37");
  EXPECT_EQ(ErrorsOf("[{file: a.npz}, {file: a.npz, shapes: wrist}]"),
            "t.yaml:4:52: targets: \"wrist\" is named twice: here and at t.yaml:4:37");
  EXPECT_TRUE(Has(ErrorsOf("{flie: a.npz}"), "did you mean \"file\"?")) << ErrorsOf("{flie: a.npz}");
  EXPECT_EQ(ErrorsOf("[[bulge]]"),
            "t.yaml:4:37: targets: expected names of targets, or {file: FILE}, found a list");
  EXPECT_EQ(ErrorsOf("{file: a.txt}"),
            "t.yaml:4:43: the file of shapes cannot be read\n"
            "a.txt: expected a file that ends in .npz, .obj, .glb, .gltf or .vrm");
  for (const char* missing : {"no.npz", "no.obj", "no.glb"}) {
    const std::string said = ErrorsOf(fmt::format("{{file: {}}}", missing));
    EXPECT_TRUE(Has(said, "t.yaml:4:43: the file of shapes cannot be read")) << said;
    EXPECT_TRUE(Has(said, std::string("\n") + missing + ": cannot be read")) << said;
  }
  folder.Write("t.yaml",
               "kpsa: 1\ncharacter: c.gltf\nnodes: {fix: {type: blendShape, targets: {file: a.npz}}}\n"
               "deform: [{meshes: [sheet, patch], stack: [fix]}]\n");
  const Result<Rig> two_meshes = LoadRig(StandardRegistry(), folder / "t.yaml");
  ASSERT_FALSE(two_meshes.ok());
  EXPECT_TRUE(
      Has(two_meshes.status().ToString(),
          "t.yaml:3:42: targets: \"fix\" deforms sheet, patch: say whose shapes these are, mesh: sheet"))
      << two_meshes.status().ToString();
}

TEST_F(ShapeFiles, HostileFilesAreRefused) {
  const Floats good = Positions(Displacements(1));
  const auto refused = [&](const std::string& file) {
    const std::string said = ErrorsOf("{file: " + file + "}");
    EXPECT_TRUE(Has(said, "t.yaml:4:43: the file of shapes cannot be read\n" + file + ":")) << said;
    return said;
  };
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Floats values = good;
    values[3 * 5 + 1] = bad;
    WriteNpz<float>("nan.npz", {{"a", values}});
    EXPECT_TRUE(Has(refused("nan.npz"), "shape \"a\": vertex 5 is not finite"));
  }
  WriteNpz<double>("large.npz", {{"a", std::vector<double>(36, 1e300)}});
  EXPECT_TRUE(Has(refused("large.npz"), "vertex 0 is not finite"));
  // Truncated anywhere
  WriteNpz<float>("a.npz", {{"a", good}});
  const std::string npz = TemporaryFolder::Read(folder / "a.npz");
  for (std::size_t size = 0; size < npz.size(); size += 37) {
    folder.Write("cut.npz", npz.substr(0, size));
    refused("cut.npz");
  }
  GltfBuilder b;
  PushMesh(&b, "any", good);
  b.Push("scenes", {{"nodes", {0}}});
  const std::string glb = b.Glb();
  for (std::size_t size = 0; size < glb.size(); size += 37) {
    folder.Write("cut.glb", glb.substr(0, size));
    refused("cut.glb");
  }
  // Counts that are a lie
  b.root["accessors"][0]["count"] = 4'000'000'000u;
  folder.Write("count.glb", b.Glb());
  refused("count.glb");
  // Other arrays, other types
  Result<NpzWriter> writer = NpzWriter::Create(folder / "flat.npz", true);
  ASSERT_TRUE(writer.ok() && writer->Add("a", {36}, good).ok() && writer->Finish().ok());
  EXPECT_TRUE(Has(refused("flat.npz"), "array \"a\" has shape (36), expected floats of shape (V, 3)"));
  ASSERT_EQ(::mkfifo((folder / "pipe.npz").c_str(), 0600), 0);
  refused("pipe.npz");
  std::filesystem::create_directory(folder / "dir.npz");
  refused("dir.npz");
  // More of them than anybody has
  std::string many;
  for (int i = 0; i < 9000; ++i) many += fmt::format("o s{}\nv 0 0 0\n", i);
  folder.Write("many.obj", many);
  EXPECT_TRUE(Has(refused("many.obj"), "has 9000 shapes or more; at most 8192 are supported"));
  GltfBuilder crowd;
  PushMesh(&crowd, "one", good);
  for (int i = 1; i < 9000; ++i) crowd.Push("nodes", {{"mesh", 0}});
  nlohmann::json all = nlohmann::json::array();
  for (int i = 0; i < 9000; ++i) all.push_back(i);
  crowd.Push("scenes", {{"nodes", all}});
  folder.Write("crowd.glb", crowd.Glb());
  EXPECT_TRUE(Has(refused("crowd.glb"), "at most 8192 are supported"));
  // What overflows on its way to metres and back
  Floats far = good;
  far[0] = 3e38f;
  WriteNpz<float>("far.npz", {{"a", far}, {"b", good}});
  EXPECT_EQ(ErrorsOf("{file: far.npz, shapes: a}"), "no error");  // nonsense, and finite; a note says so
}

}  // namespace
}  // namespace kpsa::engine
