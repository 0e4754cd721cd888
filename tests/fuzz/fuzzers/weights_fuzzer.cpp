// Weight files, and .obj files, which come as a shape with them.
#include <cmath>

#include "files/obj.h"
#include "files/weights_json.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {

KPSA_FUZZER(weights) {
  const Result<WeightFile> file = ReadWeightFile(FuzzedFile("weights.json", bytes));
  if (file.ok()) {
    Reached("weights");
    for (const NamedWeights& map : file->maps) {
      Require(map.indices.size() == map.values.size(), "other numbers of indices and of values");
      for (const Index index : map.indices) Require(index < file->points, "an index beyond the points");
      (void)FirstOutOfRange(*file, map);
      if (file->points > 100'000) continue;
      for (const float weight : DenseWeights(*file, map))
        Require(std::isfinite(weight), "a weight not finite");
    }
    // What is written reads back as the same
    const std::string text = WeightFileText(*file);
    const Result<WeightFile> again = ReadWeightFile(FuzzedFile("weights.json", AsBytes(text)));
    Require(again.ok() && WeightFileText(*again) == text, "a file that does not read back");
  } else {
    RequireRefusal(file.status());
  }
  const Result<std::vector<ObjShape>> shapes = ReadObj(FuzzedFile("shape.obj", bytes));
  if (!shapes.ok()) return RequireRefusal(shapes.status());
  Reached("shape");
  Require(!shapes->empty(), "a file of no shapes");
  for (const ObjShape& shape : *shapes) {
    Require(!shape.positions.empty() && shape.positions.size() % 3 == 0, "a vertex of not three numbers");
    for (const float number : shape.positions) Require(std::isfinite(number), "a vertex not finite");
  }
}

}  // namespace kpsa::engine
