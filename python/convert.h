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

// Runs without the interpreter's lock; raises what went wrong.
template <typename F>
auto Checked(F&& f) {
  Py_CLEAR(RaisedByNode());
  auto result = [&] {
    const py::gil_scoped_release release;
    return f();
  }();
  if (!result) Raise(result.problems());
  return std::move(*result);
}

// A number, an array, or a matrix [4, 4] of numbers column by column.
py::object ObjectOf(const std::vector<double>& values);

}  // namespace kpsa_python
