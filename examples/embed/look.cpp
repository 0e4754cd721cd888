#include <kpsa/kpsa.h>

#include <cstdio>

int main() {
  const kpsa::Library library;  // the node types
  auto rig = library.Load("hello.yaml");
  if (!rig) return std::puts(kpsa::ToText(rig.problems()).c_str()), 1;
  kpsa::Scene scene(*rig);  // one a thread
  if (!scene.Set("upper.rotateZ", -60)) return 1;
  auto points = scene.Points("column");  // x y z a vertex, metres
  if (points) std::printf("%zu vertices, the first at %g %g %g\n", points->size() / 3, (*points)[0], (*points)[1], (*points)[2]);
}
