// What goes over between Python and the face: problems as exceptions, numbers as objects.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <utility>
#include <vector>

#include "kpsa/kpsa.h"

namespace kpsa_python {

namespace py = pybind11;

using Floats = py::array_t<float, py::array::c_style>;

// kpsa.Error, which holds the problems.
py::object& ErrorType();
// What a node's function raised on this thread since the last call began; owned.
PyObject*& RaisedByNode();
// With what a node's function raised, if that was it, as the cause; with the interpreter's lock.
[[noreturn]] void Raise(const kpsa::Problems& problems);

// What a callback raised while the face ran without the interpreter's lock.
class CallbackError {
 public:
  // Calls f with the lock, after signals; what it says, or false where something was raised.
  template <typename F>
  bool Call(F&& f) {
    const py::gil_scoped_acquire lock;
    if (type_ != nullptr) return false;  // the first one is raised
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return f();
    } catch (py::error_already_set& error) {
      error.restore();
      PyErr_Fetch(&type_, &value_, &trace_);
      return false;
    }
  }
  // Raises it, if there is something; with the lock.
  void Raise() {
    if (type_ == nullptr) return;
    PyErr_Restore(std::exchange(type_, nullptr), value_, trace_);
    throw py::error_already_set();
  }

 private:
  PyObject *type_ = nullptr, *value_ = nullptr, *trace_ = nullptr;  // owned
};

// Runs without the interpreter's lock; raises what callbacks raised, or else what went wrong.
template <typename F>
auto Checked(F&& f, CallbackError* raised = nullptr) {
  Py_CLEAR(RaisedByNode());
  auto result = [&] {
    const py::gil_scoped_release release;
    return f();
  }();
  if (raised != nullptr) raised->Raise();
  if (!result) Raise(result.problems());
  return std::move(*result);
}

// A number, an array, or a matrix [4, 4] of numbers column by column.
py::object ObjectOf(const std::vector<double>& values);

}  // namespace kpsa_python
