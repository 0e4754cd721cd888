#include "files/obj.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// "name: x y z, x y z; name: ..." or the error, without the folder.
std::string ObjOf(const std::string& text, const std::string& name = "elbow.obj") {
  const TemporaryFolder folder;
  const Result<std::vector<ObjShape>> shapes = ReadObj(folder.Write(name, text));
  std::string said;
  if (!shapes.ok()) {
    said = shapes.status().ToString();
    const std::size_t at = said.find(folder.path() + "/");
    return at == std::string::npos ? said : said.erase(at, folder.path().size() + 1);
  }
  for (const ObjShape& shape : *shapes) {
    said += (said.empty() ? "" : "; ") + shape.name + ":";
    for (std::size_t i = 0; i < shape.positions.size(); ++i)
      said += fmt::format("{}{}", i > 0 && i % 3 == 0 ? ", " : " ", shape.positions[i]);
  }
  return said;
}

TEST(Obj, OneObjectIsNamedAsTheFile) {
  EXPECT_EQ(ObjOf("v 1 2 3\nv -1e-1 +.5 0\nf 1 2 1\n"), "elbow: 1 2 3, -0.1 0.5 0");
  EXPECT_EQ(ObjOf("# Blender\nmtllib a.mtl\no Cube.001\nv 1 2 3\nvn 0 0 1\nvt 0.5 nonsense\ns off\nf 1//1 "
                  "1//1 1//1\n"),
            "elbow: 1 2 3");
  // A byte more or less: blanks, tabs, other ends of lines, none at the end, colours, the fourth number
  EXPECT_EQ(ObjOf("  v\t1  2 3 1.0\r\n\r\nv 4 5 6 0.1 0.2 0.3"), "elbow: 1 2 3, 4 5 6");
  EXPECT_EQ(ObjOf("v 1 2 3\n", "left arm.v2.OBJ"), "left arm.v2: 1 2 3");
}

TEST(Obj, FacesAndVerticesOfOneObjectMayAlternate) {
  EXPECT_EQ(ObjOf("v 1 1 1\nf 1 1 1\nv 2 2 2\nf 2 2 2\n"), "elbow: 1 1 1, 2 2 2");
  EXPECT_EQ(ObjOf("o a\nv 1 1 1\nf 1 1 1\nv 2 2 2\ng x\nf 2 2 2\no b\nv 3 3 3\n"),
            "a: 1 1 1, 2 2 2; b: 3 3 3");
}

TEST(Obj, SeveralObjectsOrGroupsAreShapes) {
  EXPECT_EQ(ObjOf("o rest pose\nv 1 1 1\no bent\nv 2 2 2\nv 3 3 3\n"),
            "rest pose: 1 1 1; bent: 2 2 2, 3 3 3");
  // As Maya writes them
  EXPECT_EQ(ObjOf("g default\nv 1 1 1\ng one\nf 1 1 1\ng default\nv 2 2 2\ng two\nf 2 2 2\n"),
            "one: 1 1 1; two: 2 2 2");
  // As 3ds Max does; groups of faces of one object are no shapes
  EXPECT_EQ(ObjOf("v 1 1 1\ng one\nf 1 1 1\nv 2 2 2\ng two\nf 2 2 2\ng more\nf 2 2 2\n"),
            "one: 1 1 1; two: 2 2 2");
  EXPECT_EQ(ObjOf("v 1 1 1\nv 2 2 2\ng head\nf 1 1 1\ng jaw\nf 2 2 2\n"), "elbow: 1 1 1, 2 2 2");
}

TEST(Obj, ALineMayGoOnInTheNext) {
  EXPECT_EQ(ObjOf("v 1 \\\n2 3\nf 1 1 \\\r\n 1\nv 4 5 6\n"), "elbow: 1 2 3, 4 5 6");
  EXPECT_EQ(ObjOf("f 1 1 \\\n1\nv 1 x 2\n"), "elbow.obj:3: a vertex needs three finite numbers, found \"x\"");
}

TEST(Obj, WhatIsWrongIsToldWithItsLine) {
  EXPECT_EQ(ObjOf("v 1 2 3\nv 1 2\n"), "elbow.obj:2: a vertex needs three finite numbers, found \"\"");
  for (const char* number :
       {"nan", "inf", "-inf", "1e39", "1e999", "1,5", "0x10", "1.5abc", "--1", "+-1", "+"}) {
    EXPECT_EQ(ObjOf(fmt::format("\nv 0 {} 0\n", number)),
              fmt::format("elbow.obj:2: a vertex needs three finite numbers, found \"{}\"", number));
  }
  EXPECT_EQ(ObjOf("v 1 2 3\nvertex 1 2 3\n"), "elbow.obj:2: \"vertex\" is no statement of an .obj file");
  const std::string long_word = ObjOf(std::string(100000, 'x'));
  EXPECT_LT(long_word.size(), 120u) << long_word;
  EXPECT_EQ(ObjOf(""), "elbow.obj: has no vertices");
  EXPECT_EQ(ObjOf("o a\nf 1 2 3\n"), "elbow.obj: has no vertices");
  EXPECT_EQ(ObjOf("o a\nv 1 1 1\no a\nv 2 2 2\n"), "elbow.obj: two of its objects are named \"a\"");
  EXPECT_EQ(ObjOf(std::string("\0\0v 1 2 3", 9)).rfind("elbow.obj:1: ", 0), 0u);
}

TEST(Obj, OnlyFilesAreRead) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe.obj";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {folder.path(), folder / "missing.obj", pipe})
    EXPECT_FALSE(ReadObj(path).ok()) << path;
}

}  // namespace
}  // namespace kpsa::engine
