// The Python module, over the public face alone: the same nouns, NumPy arrays for points, exceptions for problems.
// Evaluation, training and loading run without the interpreter's lock.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kpsa/kpsa.h"
#include "python/convert.h"
#include "python/node_functions.h"

namespace kpsa_python {
namespace {

// [rows, 3] of float32 that a caller gave, or a new one.
Floats Target(const py::object& out, std::vector<py::ssize_t> shape) {
  if (out.is_none()) return Floats(shape);
  if (!py::isinstance<Floats>(out)) throw py::type_error("out: expected a C-contiguous array of float32");
  Floats array = py::reinterpret_borrow<Floats>(out);
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t d = 0; fits && d < shape.size(); ++d)
    fits = array.shape(static_cast<py::ssize_t>(d)) == shape[d];
  if (!fits || !array.writeable()) {
    std::string text;
    for (const py::ssize_t size : shape) text += (text.empty() ? "" : ", ") + std::to_string(size);
    throw py::value_error("out: expected a writeable array of shape (" + text + ")");
  }
  return array;
}

// What a callback returned: nothing means to go on.
bool Truth(const py::object& answer) {
  if (answer.is_none()) return true;
  const int truth = PyObject_IsTrue(answer.ptr());
  if (truth < 0) throw py::error_already_set();
  return truth != 0;
}

struct PyVerdict {  // a row of the structured array of verdicts
  bool hit;
  float full_share;
  double score;
};

// Looks at signals while nodes that remember come to a time, and now and then while frames are evaluated.
class SignalWatch {
 public:
  explicit SignalWatch(kpsa::Scene& scene) : scene_(scene) {
    scene.WatchRunUp([this] { return !Due() || raised.Call([] { return true; }); });
  }
  ~SignalWatch() { scene_.WatchRunUp({}); }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  bool Due() {
    constexpr auto kInterval = std::chrono::milliseconds(20);  // the lock may be long in coming
    const Clock::time_point now = Clock::now();
    if (now - looked_ < kInterval) return false;
    looked_ = now;
    return true;
  }
  CallbackError raised;  // by a signal, or by whatever else is called

 private:
  using Clock = std::chrono::steady_clock;
  kpsa::Scene& scene_;
  Clock::time_point looked_ = Clock::now();
};

Floats Points(kpsa::Scene& scene, const std::string& mesh, const py::object& out) {
  SignalWatch watch(scene);
  const auto points = Checked([&] { return scene.Points(mesh); }, &watch.raised);
  Floats array = Target(out, {static_cast<py::ssize_t>(points.size() / 3), 3});
  std::memcpy(array.mutable_data(), points.data(), points.size_bytes());
  return array;
}

py::object Values(kpsa::Scene& scene, const std::string& plug) {
  SignalWatch watch(scene);
  return ObjectOf(Checked([&] { return scene.Values(plug); }, &watch.raised));
}

py::object Value(const kpsa::Rig& rig, const std::string& plug) {
  const kpsa::PlugValue value = Checked([&] { return rig.Value(plug); });
  if (value.numbers.empty() && !value.text.empty()) return py::str(value.text);
  return ObjectOf(value.numbers);
}

py::dict Frames(kpsa::Scene& scene, const std::vector<double>& seconds, const py::object& out, int threads,
                const py::object& progress) {
  const auto meshes = scene.rig().meshes();
  const auto count = static_cast<py::ssize_t>(seconds.size());
  py::dict arrays;
  std::vector<float*> to;
  for (const kpsa::MeshInfo& mesh : meshes) {
    const py::str name(mesh.name);
    const py::object given = out.is_none() ? out : py::object(out.attr("get")(name));
    Floats array = Target(given, {count, static_cast<py::ssize_t>(mesh.vertices), 3});
    to.push_back(array.mutable_data());
    arrays[name] = std::move(array);
  }
  py::array_t<PyVerdict> verdicts(scene.rig().is_accelerated() ? count : 0);
  PyVerdict* const verdict = verdicts.mutable_data();
  SignalWatch watch(scene);
  const auto take = [&](const kpsa::Frame& frame) {
    for (std::size_t m = 0; m < frame.points.size(); ++m)
      std::memcpy(to[m] + frame.index * frame.points[m].size(), frame.points[m].data(),
                  frame.points[m].size_bytes());
    if (frame.verdict != nullptr)
      verdict[frame.index] = {frame.verdict->hit, static_cast<float>(frame.verdict->full_share),
                              frame.verdict->score};
    if (!watch.Due() && progress.is_none()) return true;
    return watch.raised.Call([&] {
      if (progress.is_none()) return true;
      const py::object go_on = progress(frame.index + 1);
      return Truth(go_on);
    });
  };
  Checked([&] { return scene.Frames(seconds, take, {.threads = threads}); }, &watch.raised);
  arrays["verdicts"] = std::move(verdicts);
  return arrays;
}

kpsa::TrainingReport Train(const kpsa::Rig& rig, const std::string& subspace, const std::string& entry,
                           std::optional<std::size_t> samples, std::optional<double> tolerance,
                           std::optional<double> violation_rate, std::vector<std::string> clips,
                           std::uint64_t seed, std::optional<double> seconds, int threads, bool paper,
                           const py::object& progress) {
  kpsa::TrainingOptions options;
  options.entry = entry;
  options.samples = samples;
  options.tolerance = tolerance, options.violation_rate = violation_rate;
  options.clips = std::move(clips);
  options.seed = seed;
  if (seconds.has_value()) options.seconds = *seconds;
  options.threads = threads;
  options.paper = paper;
  CallbackError raised;
  options.progress = [&](std::string_view what, double share) {
    return raised.Call([&] {
      if (progress.is_none()) return true;
      const py::object go_on = progress(std::string(what), share);
      return Truth(go_on);
    });
  };
  return Checked([&] { return rig.Train(options, subspace); }, &raised);
}

kpsa::BenchReport Bench(const kpsa::Rig& rig, std::vector<std::string> clips, int runs, int threads,
                        const py::object& progress) {
  kpsa::BenchOptions options;
  options.clips = std::move(clips);
  options.runs = runs, options.threads = threads;
  CallbackError raised;
  options.progress = [&](std::size_t frames) {
    return raised.Call([&] {
      if (progress.is_none()) return true;
      const py::object go_on = progress(frames);
      return Truth(go_on);
    });
  };
  return Checked([&] { return rig.Bench(options); }, &raised);
}

// The graph of Rig.edited while its callback runs; of no use afterwards.
struct PyEdit {
  kpsa::GraphEdit* edit = nullptr;
  kpsa::GraphEdit& get() const {
    if (edit == nullptr)
      throw py::value_error("the graph can be edited within the function that edited() calls, and no longer");
    return *edit;
  }
};

void Said(const kpsa::Result<kpsa::Done>& done) {
  if (!done) Raise(done.problems());
}

kpsa::Rig Edited(const kpsa::Rig& rig, const py::function& function) {
  CallbackError raised;
  return Checked(
      [&] {
        return rig.Edited([&](kpsa::GraphEdit& edit) -> kpsa::Result<kpsa::Done> {
          const bool done = raised.Call([&] {
            const auto handed = std::make_shared<PyEdit>(PyEdit{&edit});
            try {
              function(handed);
            } catch (...) {
              handed->edit = nullptr;
              throw;
            }
            handed->edit = nullptr;
            return true;
          });
          if (done) return kpsa::Done();
          return kpsa::Problems(1);  // what was raised takes its place
        });
      },
      &raised);
}

py::list Profile(kpsa::Scene& scene, const std::vector<double>& seconds) {
  py::list steps;
  SignalWatch watch(scene);
  for (const kpsa::StepTime& step : Checked([&] { return scene.Profile(seconds); }, &watch.raised)) {
    py::dict row;
    row["node"] = step.node, row["type"] = step.type, row["label"] = step.label;
    row["evaluations"] = step.evaluations, row["points"] = step.points,
    row["milliseconds"] = step.milliseconds;
    steps.append(row);
  }
  return steps;
}

template <typename T>
std::vector<T> ListOf(std::span<const T> items) {
  return {items.begin(), items.end()};
}

}  // namespace
}  // namespace kpsa_python

using namespace kpsa_python;  // NOLINT: of this file

PYBIND11_MODULE(_kpsa, m) {
  m.doc() = "Evaluates character rigs (see the package kpsa).";
  m.attr("__version__") = std::string(kpsa::Version());

  ErrorType() = py::reinterpret_steal<py::object>(
      PyErr_NewExceptionWithDoc("kpsa.Error",
                                "What was asked for could not be done; `problems` says all that is wrong, "
                                "`file`, `line` and `node` of the first.",
                                PyExc_RuntimeError, nullptr));
  m.attr("Error") = ErrorType();

  py::class_<kpsa::Problem>(m, "Problem", "One thing that is wrong.")
      .def_property_readonly(
          "kind",
          [](const kpsa::Problem& p) {
            constexpr const char* kNames[] = {"usage", "input", "evaluation", "failed check", "interrupted"};
            return kNames[static_cast<int>(p.kind)];
          })
      .def_readonly("file", &kpsa::Problem::file)
      .def_readonly("line", &kpsa::Problem::line, "counted from 1; 0: unknown")
      .def_readonly("column", &kpsa::Problem::column)
      .def_readonly("node", &kpsa::Problem::node)
      .def_readonly("message", &kpsa::Problem::message)
      .def("__repr__", [](const kpsa::Problem& p) { return "<Problem " + kpsa::ToText({p}) + ">"; });

  py::class_<kpsa::ControlInfo>(m, "Control", "A plug that animators move, in the units of the rig's file.")
      .def_readonly("name", &kpsa::ControlInfo::name)
      .def_readonly("min", &kpsa::ControlInfo::min)
      .def_readonly("max", &kpsa::ControlInfo::max)
      .def_readonly("value", &kpsa::ControlInfo::value, "at rest")
      .def_readonly("si", &kpsa::ControlInfo::si, "metres, radians or seconds for one of the file's units")
      .def("__repr__", [](const kpsa::ControlInfo& c) {
        return py::str("<Control {} [{:g}, {:g}]>").format(c.name, c.min, c.max);
      });
  py::class_<kpsa::ClipInfo>(m, "Clip")
      .def_readonly("name", &kpsa::ClipInfo::name)
      .def_readonly("begin", &kpsa::ClipInfo::begin, "seconds")
      .def_readonly("end", &kpsa::ClipInfo::end, "seconds")
      .def("__repr__", [](const kpsa::ClipInfo& c) {
        return py::str("<Clip {} {:g}..{:g} s>").format(c.name, c.begin, c.end);
      });
  py::class_<kpsa::MeshInfo>(m, "Mesh")
      .def_readonly("name", &kpsa::MeshInfo::name)
      .def_readonly("vertices", &kpsa::MeshInfo::vertices)
      .def_readonly("stages", &kpsa::MeshInfo::stages, "of its deformer stack")
      .def_readonly("stage_nodes", &kpsa::MeshInfo::stage_nodes, "by stage: the node that computes it")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {  // no copy: the array keeps the mesh alive
            const auto& mesh = self.cast<const kpsa::MeshInfo&>();
            py::array_t<std::uint32_t> array(
                {static_cast<py::ssize_t>(mesh.triangles.size() / 3), py::ssize_t{3}}, mesh.triangles.data(),
                self);
            array.attr("flags").attr("writeable") = false;
            return array;
          },
          "uint32 [N, 3]: vertices")
      .def("__repr__", [](const kpsa::MeshInfo& c) {
        return py::str("<Mesh {} {} vertices>").format(c.name, c.vertices);
      });
  py::class_<kpsa::PlugInfo>(m, "Plug",
                             "An attribute of a node: \"node.name\", of an array \"node.name[2]\".")
      .def_readonly("name", &kpsa::PlugInfo::name)
      .def_readonly("type", &kpsa::PlugInfo::type, "\"double\", \"enum\", \"matrix\", \"points\", ...")
      .def_readonly("unit", &kpsa::PlugInfo::unit, "\"\", \"length\", \"angle\" or \"time\"")
      .def_readonly("doc", &kpsa::PlugInfo::doc)
      .def_readonly("output", &kpsa::PlugInfo::output, "computed; all others are set or driven")
      .def_readonly("structural", &kpsa::PlugInfo::structural, "read when a plan is made")
      .def_readonly("array", &kpsa::PlugInfo::array)
      .def_readonly("elements", &kpsa::PlugInfo::elements, "of an array that are set or driven")
      .def_readonly("choices", &kpsa::PlugInfo::choices, "of an enum")
      .def("__repr__",
           [](const kpsa::PlugInfo& p) { return py::str("<Plug {} {}>").format(p.name, p.type); });
  py::class_<kpsa::NodeInfo>(m, "Node", "A node of a rig's graph.")
      .def_readonly("name", &kpsa::NodeInfo::name)
      .def_readonly("type", &kpsa::NodeInfo::type)
      .def_readonly("file", &kpsa::NodeInfo::file,
                    "where the rig writes it; \"\" for what the character brings")
      .def_readonly("line", &kpsa::NodeInfo::line)
      .def_readonly("column", &kpsa::NodeInfo::column)
      .def_readonly("plugs", &kpsa::NodeInfo::plugs)
      .def("__repr__",
           [](const kpsa::NodeInfo& n) { return py::str("<Node {} {}>").format(n.name, n.type); });
  py::class_<kpsa::ConnectionInfo>(m, "Connection")
      .def_readonly("source", &kpsa::ConnectionInfo::source)
      .def_readonly("destination", &kpsa::ConnectionInfo::destination)
      .def("__repr__", [](const kpsa::ConnectionInfo& c) {
        return py::str("<Connection {} -> {}>").format(c.source, c.destination);
      });
  py::class_<kpsa::Verdict>(m, "Verdict", "What SoftCache said of a frame.")
      .def_readonly("hit", &kpsa::Verdict::hit)
      .def_readonly("full_share", &kpsa::Verdict::full_share,
                    "of the full evaluation: 0 a hit, 1 a miss, a blend in between")
      .def_readonly("score", &kpsa::Verdict::score, "the smaller, the more like the training")
      .def_readonly("reason", &kpsa::Verdict::reason)
      .def("__repr__",
           [](const kpsa::Verdict& v) { return py::str("<Verdict {} {:g}>").format(v.reason, v.score); });
  py::class_<kpsa::TrainingReport>(m, "TrainingReport")
      .def_readonly("subspace", &kpsa::TrainingReport::subspace, "the file that was written")
      .def_readonly("points", &kpsa::TrainingReport::points)
      .def_readonly("cues", &kpsa::TrainingReport::cues)
      .def_readonly("modes", &kpsa::TrainingReport::modes)
      .def_readonly("held_out_rms", &kpsa::TrainingReport::held_out_rms, "metres")
      .def_readonly("held_out_max", &kpsa::TrainingReport::held_out_max, "metres")
      .def_readonly("tolerance", &kpsa::TrainingReport::tolerance, "metres")
      .def_readonly("hit_rate", &kpsa::TrainingReport::hit_rate, "expected of frames like those of the clips")
      .def_readonly("warning", &kpsa::TrainingReport::warning);

  py::class_<kpsa::BenchReport>(m, "BenchReport",
                                "Full against accelerated over the frames of clips; times are milliseconds a "
                                "frame, errors metres between final points, misses included.")
      .def_readonly("clips", &kpsa::BenchReport::clips)
      .def_readonly("frames", &kpsa::BenchReport::frames)
      .def_readonly("hits", &kpsa::BenchReport::hits)
      .def_readonly("blends", &kpsa::BenchReport::blends)
      .def_property_readonly("hit_rate", &kpsa::BenchReport::hit_rate)
      .def_readonly("most_frequent_reason", &kpsa::BenchReport::most_frequent_reason,
                    "of frames that are no hits")
      .def_readonly("full_ms", &kpsa::BenchReport::full_ms)
      .def_readonly("accelerated_ms", &kpsa::BenchReport::accelerated_ms)
      .def_readonly("speedup", &kpsa::BenchReport::speedup, "misses included")
      .def_readonly("speedup_on_hits", &kpsa::BenchReport::speedup_on_hits, "0 where no frame hits")
      .def_readonly("error_rms", &kpsa::BenchReport::error_rms)
      .def_readonly("error_max", &kpsa::BenchReport::error_max)
      .def_readonly("tolerance", &kpsa::BenchReport::tolerance)
      .def_readonly("violation_rate", &kpsa::BenchReport::violation_rate)
      .def_readonly("beyond_tolerance", &kpsa::BenchReport::beyond_tolerance, "accepted frames that are")
      .def_readonly("promise_kept", &kpsa::BenchReport::promise_kept)
      .def_readonly("notes", &kpsa::BenchReport::notes);

  PYBIND11_NUMPY_DTYPE(PyVerdict, hit, full_share, score);

  py::class_<PyEdit, std::shared_ptr<PyEdit>>(m, "GraphEdit",
                                              "The graph of a copy of a rig, within Rig.edited.")
      .def(
          "add_node",
          [](const PyEdit& e, const std::string& type, const std::string& name) {
            Said(e.get().AddNode(type, name));
          },
          py::arg("type"), py::arg("name"))
      .def(
          "set",
          [](const PyEdit& e, const std::string& plug, double value) { Said(e.get().Set(plug, value)); },
          py::arg("plug"), py::arg("value"),
          "A number in the units of the rig's file, a choice, a text, or 3, 4 or 16 numbers.")
      .def(
          "set",
          [](const PyEdit& e, const std::string& plug, const std::string& text) {
            Said(e.get().Set(plug, text));
          },
          py::arg("plug"), py::arg("value"))
      .def(
          "set",
          [](const PyEdit& e, const std::string& plug, const std::vector<double>& values) {
            Said(e.get().Set(plug, values));
          },
          py::arg("plug"), py::arg("value"))
      .def(
          "connect",
          [](const PyEdit& e, const std::string& source, const std::string& destination) {
            Said(e.get().Connect(source, destination));
          },
          py::arg("source"), py::arg("destination"),
          "As `connections:` of a rig. A plug that something drives takes the new source.")
      .def(
          "disconnect",
          [](const PyEdit& e, const std::string& destination) { Said(e.get().Disconnect(destination)); },
          py::arg("destination"))
      .def(
          "deform",
          [](const PyEdit& e, const std::string& mesh, const std::string& node) {
            Said(e.get().Deform(mesh, node));
          },
          py::arg("mesh"), py::arg("node"), "Puts a deformer at the end of a mesh's stack.");

  py::class_<kpsa::Rig>(m, "Rig", "A loaded rig. Immutable; threads may share it.")
      .def_property_readonly("path", [](const kpsa::Rig& r) { return r.path(); })
      .def_property_readonly("fps", &kpsa::Rig::fps)
      .def_property_readonly("controls", [](const kpsa::Rig& r) { return ListOf(r.controls()); })
      .def_property_readonly("clips", [](const kpsa::Rig& r) { return ListOf(r.clips()); })
      .def_property_readonly(
          "meshes", [](const kpsa::Rig& r) { return ListOf(r.meshes()); }, "those that are shown")
      .def_property_readonly(
          "notes", [](const kpsa::Rig& r) { return ListOf(r.notes()); }, "what may surprise")
      .def_property_readonly("is_accelerated", &kpsa::Rig::is_accelerated)
      .def_property_readonly("nodes", &kpsa::Rig::Nodes,
                             "of the graph, in the order of their creation; without clips and subspaces")
      .def_property_readonly("connections", &kpsa::Rig::Connections)
      .def("value", &Value, py::arg("plug"),
           "What a plug holds where nothing drives it: a number, an array, a matrix [4, 4] or a text.")
      .def(
          "accelerated",
          [](const kpsa::Rig& r, const std::string& subspace, std::optional<double> tolerance,
             std::optional<double> violation_rate, bool stale_is_miss) {
            return Checked([&] {
              return r.Accelerated({subspace, tolerance, violation_rate, stale_is_miss});
            });
          },
          py::arg("subspace") = "", py::kw_only(), py::arg("tolerance") = py::none(),
          py::arg("violation_rate") = py::none(), py::arg("stale_is_miss") = false,
          "The rig whose accelerated points come from subspaces (\"\": those that it names). tolerance: "
          "metres.")
      .def("train", &Train, py::arg("subspace") = "", py::kw_only(), py::arg("entry") = "",
           py::arg("samples") = py::none(), py::arg("tolerance") = py::none(),
           py::arg("violation_rate") = py::none(), py::arg("clips") = std::vector<std::string>(),
           py::arg("seed") = 1, py::arg("seconds") = py::none(), py::arg("threads") = 0,
           py::arg("paper") = false, py::arg("progress") = py::none(),
           "Trains a subspace and writes it to a .kpsa file. progress(what, share) is called on the way; "
           "False cancels.")
      .def("bench", &Bench, py::kw_only(), py::arg("clips") = std::vector<std::string>(), py::arg("runs") = 5,
           py::arg("threads") = 1, py::arg("progress") = py::none(),
           "Full against accelerated, by turns, on clips (none: the rig's test clips). progress(frames) is "
           "called on the way; False cancels.")
      .def("edited", &Edited, py::arg("edit"),
           "A rig like this one with a graph that edit(graph) has changed: graph.add_node, set, connect, "
           "disconnect, deform.")
      .def(
          "scene", [](const kpsa::Rig& r) { return kpsa::Scene(r); }, "A state of the rig, at rest.");

  py::class_<kpsa::Scene>(m, "Scene",
                          "A state of a rig: a clip, a time, controls. Used by one thread at a time.")
      .def(py::init<const kpsa::Rig&>(), py::arg("rig"))
      .def_property_readonly("rig", [](const kpsa::Scene& s) { return s.rig(); })
      .def(
          "play",
          [](kpsa::Scene& s, const std::optional<std::string>& clip) {
            Checked([&] { return s.Play(clip); });
          },
          py::arg("clip"), "Lets a clip drive the character; None: the rest pose.")
      .def("set_time", &kpsa::Scene::SetTime, py::arg("seconds"))
      .def(
          "set",
          [](kpsa::Scene& s, const std::string& plug, double value) {
            Checked([&] { return s.Set(plug, value); });
          },
          py::arg("plug"), py::arg("value"),
          "A control, or any other plug that may vary, in the units of the rig's file.")
      .def(
          "set",
          [](kpsa::Scene& s, const std::map<std::string, double>& values) {
            for (const auto& [plug, value] : values) Checked([&] { return s.Set(plug, value); });
          },
          py::arg("values"))
      .def("reset", &kpsa::Scene::Reset, "All controls at rest.")
      .def("points", &Points, py::arg("mesh"), py::arg("out") = py::none(),
           "float32 [V, 3], metres: \"head_mesh\", or up to a stage, \"head_mesh@skin\". Into `out`, if it "
           "is given.")
      .def("values", &Values, py::arg("plug"), "A number, an array of three or four, or a matrix [4, 4].")
      .def_property_readonly(
          "verdict", [](kpsa::Scene& s) { return s.verdict(); }, "of the latest points() or values()")
      .def("profile", &Profile, py::arg("seconds"),
           "What evaluating the meshes at these times costs: a dict a step (node, type, label, evaluations, "
           "points, milliseconds), "
           "dearest first.")
      .def("frames", &Frames, py::arg("seconds"), py::arg("out") = py::none(), py::kw_only(),
           py::arg("threads") = 0, py::arg("progress") = py::none(),
           "Frames of the clip that plays, on many threads: a dict of float32 [T, V, 3] by mesh, and "
           "\"verdicts\", an array "
           "of (hit, full_share, score). Into the arrays of `out`, if they are given. progress(frames): "
           "False ends it.");

  py::class_<kpsa::Library>(m, "Library", "The node types that rigs are made of.")
      .def(py::init<>())
      .def(
          "add_plugin",
          [](kpsa::Library& l, const std::string& path) { Checked([&] { return l.AddPlugin(path); }); },
          py::arg("path"))
      .def(
          "add_node",
          [](kpsa::Library& l, const std::string& name, const py::object& inputs, const py::object& outputs,
             const py::object& compute, bool deformer, const std::string& doc) -> py::object {
            if (!compute.is_none()) return AddNode(l, name, inputs, outputs, compute, deformer, doc), compute;
            return py::cpp_function(
                [l, name, inputs, outputs, deformer, doc](const py::object& function) mutable {
                  AddNode(l, name, inputs, outputs, function, deformer, doc);
                  return function;
                });
          },
          py::arg("name"), py::arg("inputs") = py::none(), py::arg("outputs") = py::none(),
          py::arg("compute") = py::none(), py::kw_only(), py::arg("deformer") = false, py::arg("doc") = "",
          "A node type that a Python function computes: for prototypes, as it is slow, frames with it run on "
          "one "
          "thread, and no points that need it are trained. inputs: defaults by name (a number, three, four, "
          "a matrix "
          "[4, 4]); "
          "outputs: names, or kinds by name (\"number\", \"vector\", \"quaternion\", \"matrix\"). "
          "compute(**inputs) gives the output, a tuple of them or a dict; of a deformer, compute(points, "
          "**inputs) "
          "gives points [P, 3], or changes them and gives None. Without compute: a decorator.")
      .def(
          "load",
          [](const kpsa::Library& l, const std::string& path, const std::optional<std::string>& variant,
             std::optional<double> fps, bool plugins, const std::vector<std::string>& trust) {
            return Checked([&] { return l.Load(path, {variant, fps, plugins, trust}); });
          },
          py::arg("path"), py::kw_only(), py::arg("variant") = py::none(), py::arg("fps") = py::none(),
          py::arg("plugins") = true, py::arg("trust") = py::list(),
          "A rig (.yaml) or a character (.glb, .gltf, .vrm).");
}
