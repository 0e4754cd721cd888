// Loads a rig, turns a control and says what moved; then trains a subspace and plays a clip with it.
//
//   embed RIG CONTROL VALUE CLIP
//   embed hello.yaml upper.rotateZ -60 wave
#include <kpsa/kpsa.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

int Complain(const kpsa::Problems& problems) {
  std::fprintf(stderr, "%s\n", kpsa::ToText(problems).c_str());
  return 1;
}

// Load, set, pull.
int Move(const kpsa::Rig& rig, const std::string& control, double value) {
  kpsa::Scene scene(rig);
  const std::string mesh = rig.meshes()[0].name;
  auto at_rest = scene.Points(mesh);
  if (!at_rest) return Complain(at_rest.problems());
  const std::vector<float> rest(at_rest->begin(), at_rest->end());
  if (auto set = scene.Set(control, value); !set) return Complain(set.problems());
  auto points = scene.Points(mesh);
  if (!points) return Complain(points.problems());
  std::size_t moved = 0;
  double farthest = 0;
  for (std::size_t v = 0; v < rest.size() / 3; ++v) {
    double squared = 0;
    for (std::size_t c = 3 * v; c < 3 * v + 3; ++c) squared += std::pow((*points)[c] - rest[c], 2);
    moved += squared > 1e-12 ? 1 : 0;
    farthest = std::fmax(farthest, std::sqrt(squared));
  }
  std::printf("%s = %g moves %zu of %zu vertices of %s, the farthest by %.1f mm\n", control.c_str(), value, moved,
              rest.size() / 3, mesh.c_str(), 1000 * farthest);
  return 0;
}

// Train, accelerate, play.
int Accelerate(const kpsa::Rig& rig, const std::string& clip) {
  kpsa::TrainingOptions training;
  training.samples = 200;
  auto trained = rig.Train(training, "embed.kpsa");
  if (!trained) return Complain(trained.problems());
  std::printf("trained: %zu points by %zu cues\n", trained->points, trained->cues);
  auto fast = rig.Accelerated({.subspace = trained->subspace});
  if (!fast) return Complain(fast.problems());
  kpsa::Scene scene(*fast);
  if (auto played = scene.Play(clip); !played) return Complain(played.problems());
  std::vector<double> seconds;
  for (int frame = 0; frame <= 24; ++frame) seconds.push_back(frame / fast->fps());
  std::size_t hits = 0;
  auto done = scene.Frames(seconds, [&](const kpsa::Frame& frame) {
    hits += frame.verdict->hit ? 1 : 0;
    return true;
  });
  if (!done) return Complain(done.problems());
  std::printf("%s: %zu of %zu frames hit\n", clip.c_str(), hits, seconds.size());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: embed RIG CONTROL VALUE CLIP\n"), 2;
  const kpsa::Library library;
  auto rig = library.Load(argv[1]);
  if (!rig) return Complain(rig.problems());
  if (const int failed = Move(*rig, argv[2], std::atof(argv[3])); failed != 0) return failed;
  return Accelerate(*rig, argv[4]);
}
