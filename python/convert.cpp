#include "python/convert.h"

#include <pybind11/stl.h>

#include <string>

namespace kpsa_python {

py::object& ErrorType() {
  static auto* const type = new py::object;
  return *type;
}

PyObject*& RaisedByNode() {
  static thread_local PyObject* raised = nullptr;
  return raised;
}

void Raise(const kpsa::Problems& problems) {
  const auto cause = py::reinterpret_steal<py::object>(std::exchange(RaisedByNode(), nullptr));
  if (cause && PyObject_IsInstance(cause.ptr(), PyExc_Exception) == 0) {  // KeyboardInterrupt, SystemExit
    PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(cause.ptr())), cause.ptr());
    throw py::error_already_set();
  }
  const py::object error = ErrorType()(kpsa::ToText(problems));
  error.attr("problems") = problems;
  const kpsa::Problem& first = problems.front();
  error.attr("file") = first.file, error.attr("line") = first.line, error.attr("node") = first.node;
  if (cause) PyException_SetCause(error.ptr(), py::object(cause).release().ptr());
  PyErr_SetObject(ErrorType().ptr(), error.ptr());
  throw py::error_already_set();
}

py::object ObjectOf(const std::vector<double>& values) {
  if (values.size() == 1) return py::float_(values[0]);
  py::array_t<double> array(static_cast<py::ssize_t>(values.size()), values.data());
  if (values.size() != 16) return array;
  // Column by column there, rows first here, as NumPy's matrices are
  return array.reshape({4, 4}).attr("T").attr("copy")();
}

}  // namespace kpsa_python
