// What a frame costs a program that embeds the library: bench_face RIG CLIP FRAMES sets a time and reads the points of
// the first mesh, frame after frame, and prints the median in microseconds. bench/python_frame.py runs it beside
// the same in Python.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "kpsa/kpsa.h"

namespace {

int Fail(const kpsa::Problems& problems) {
  std::fprintf(stderr, "%s\n", kpsa::ToText(problems).c_str());
  return 3;
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc == 4 ? std::atoi(argv[3]) : 0;
  if (frames < 1) {
    std::fprintf(stderr, "bench_face RIG CLIP FRAMES\n");
    return 2;
  }
  kpsa::Library library;
  auto rig = library.Load(argv[1]);
  if (!rig) return Fail(rig.problems());
  kpsa::Scene scene(*rig);
  if (const auto playing = scene.Play(argv[2]); !playing) return Fail(playing.problems());
  const std::string mesh = rig->meshes().front().name;
  double begin_time = 0, length = 0;  // of the clip, which plays again and again
  for (const kpsa::ClipInfo& clip : rig->clips()) {
    if (clip.name == argv[2]) begin_time = clip.begin, length = clip.end - clip.begin;
  }
  std::vector<double> us;
  for (int f = -frames / 10; f < frames; ++f) {  // the first ones warm up
    const auto begin = std::chrono::steady_clock::now();
    scene.SetTime(begin_time + std::fmod(std::abs(f) / rig->fps(), length));
    const auto points = scene.Points(mesh);
    const auto end = std::chrono::steady_clock::now();
    if (!points) return Fail(points.problems());
    if (f >= 0) us.push_back(std::chrono::duration<double, std::micro>(end - begin).count());
  }
  std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(us.size() / 2), us.end());
  std::printf("%.3f\n", us[us.size() / 2]);
}
