#include "python/node_functions.h"

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

namespace kpsa_python {
namespace {

using NodeType = kpsa::NodeAttribute::Type;
constexpr const char* kKinds[] = {"number", "vector", "quaternion", "matrix"};

py::array_t<double> NumbersOf(const py::handle& object) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!array) throw py::type_error("expected numbers, got " + std::string(py::repr(object)));
  return array;
}

kpsa::NodeAttribute InputOf(const std::string& name, const py::handle& value) {
  const py::array_t<double> array = NumbersOf(value);
  kpsa::NodeAttribute input{name, NodeType::kNumber, {array.data(), array.data() + array.size()}};
  if (array.ndim() == 0) return input;
  if (array.ndim() == 1 && array.size() == 3) return input.type = NodeType::kVector, input;
  if (array.ndim() == 1 && array.size() == 4) return input.type = NodeType::kQuaternion, input;
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4)
    throw py::value_error(name + ": expected a number, three, four, or a matrix [4, 4]");
  input.type = NodeType::kMatrix;
  for (py::ssize_t row = 0; row < 4; ++row) {
    for (py::ssize_t column = 0; column < 4; ++column)
      input.value[static_cast<std::size_t>(4 * column + row)] = array.at(row, column);
  }
  return input;
}

kpsa::NodeAttribute OutputOf(const std::string& name, const std::string& kind) {
  for (int i = 0; i < 4; ++i) {
    if (kind == kKinds[i]) return {name, static_cast<NodeType>(i), {}};
  }
  throw py::value_error(name + ": expected \"number\", \"vector\", \"quaternion\" or \"matrix\"");
}

// As many numbers as the output has.
void Write(const std::string& name, const py::handle& value, std::span<double> to) {
  const py::array_t<double> array = NumbersOf(value);
  if (static_cast<std::size_t>(array.size()) != to.size())
    throw py::value_error(name + ": expected " + std::to_string(to.size()) + " numbers, got " +
                          std::to_string(array.size()));
  for (std::size_t i = 0; i < to.size(); ++i)  // a matrix has rows first there
    to[i] = array.data()[to.size() == 16 ? 4 * (i % 4) + i / 4 : i];
}

// A node's function in Python, called with the interpreter's lock.
struct PyNode {
  std::vector<std::string> inputs, outputs;
  bool deformer = false;
  py::object function;

  void Call(const kpsa::NodeCall& call) const {
    py::dict values;
    for (std::size_t i = 0; i < inputs.size(); ++i)
      values[py::str(inputs[i])] = ObjectOf({call.inputs[i].begin(), call.inputs[i].end()});
    if (deformer) {
      Floats points({static_cast<py::ssize_t>(call.points.size() / 3), py::ssize_t{3}}, call.points.data());
      const py::object moved = function(points, **values);
      if (!moved.is_none()) {
        const auto given = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(moved);
        if (!given) throw py::type_error("expected points, got " + std::string(py::repr(moved)));
        points = given;
      }
      if (points.ndim() != 2 || points.shape(1) != 3 ||
          points.size() != static_cast<py::ssize_t>(call.out_points.size()))
        throw py::value_error("expected points of shape (" + std::to_string(call.out_points.size() / 3) +
                              ", 3)");
      std::copy_n(points.data(), call.out_points.size(), call.out_points.begin());
      return;
    }
    const py::object result = function(**values);
    if (py::isinstance<py::dict>(result)) {
      for (std::size_t i = 0; i < outputs.size(); ++i)
        Write(outputs[i], result[py::str(outputs[i])], call.outputs[i]);
    } else if (outputs.size() == 1) {
      Write(outputs[0], result, call.outputs[0]);
    } else {
      if (!py::isinstance<py::sequence>(result))
        throw py::type_error("expected " + std::to_string(outputs.size()) + " outputs, got " +
                             std::string(py::repr(result)));
      const auto several = py::reinterpret_borrow<py::sequence>(result);
      if (several.size() != outputs.size())
        throw py::value_error("expected " + std::to_string(outputs.size()) + " outputs, got " +
                              std::to_string(several.size()));
      for (std::size_t i = 0; i < outputs.size(); ++i) Write(outputs[i], several[i], call.outputs[i]);
    }
  }

  std::string operator()(const kpsa::NodeCall& call) const {
    const py::gil_scoped_acquire lock;
    try {
      Call(call);
      return "";
    } catch (py::error_already_set& error) {
      const std::string type = py::str(error.type().attr("__name__"));
      const std::string text = py::str(error.value());
      Py_XSETREF(RaisedByNode(), py::object(error.value()).release().ptr());
      if (error.trace()) PyException_SetTraceback(RaisedByNode(), error.trace().ptr());
      return text.empty() ? type : type + ": " + text;
    } catch (const std::exception& error) {
      return error.what();
    }
  }
};

}  // namespace

void AddNode(kpsa::Library& library, const std::string& name, const py::object& inputs,
             const py::object& outputs, const py::object& compute, bool deformer, const std::string& doc) {
  // Whoever lets go of it last may have no lock
  const std::shared_ptr<PyNode> node(new PyNode, [](PyNode* of) {
    if (Py_IsInitialized() == 0) return;
    const py::gil_scoped_acquire lock;
    delete of;
  });
  kpsa::NodeType type;
  type.name = name, type.doc = doc, type.deformer = node->deformer = deformer;
  node->function = compute;
  if (!inputs.is_none()) {
    for (const auto& [key, value] : py::dict(inputs)) {
      node->inputs.push_back(py::str(key));
      type.inputs.push_back(InputOf(node->inputs.back(), value));
    }
  }
  if (py::isinstance<py::dict>(outputs)) {
    for (const auto& [key, kind] : py::dict(outputs)) {
      node->outputs.push_back(py::str(key));
      type.outputs.push_back(OutputOf(node->outputs.back(), py::str(kind)));
    }
  } else if (py::isinstance<py::str>(outputs)) {
    throw py::type_error("outputs: expected names, as [\"output\"], or kinds by name");
  } else if (!outputs.is_none()) {
    for (const py::handle& key : outputs) {
      node->outputs.push_back(py::str(key));
      type.outputs.push_back({node->outputs.back()});
    }
  }
  type.compute = [node](const kpsa::NodeCall& call) { return (*node)(call); };
  Checked([&] { return library.AddNode(type); });
}

}  // namespace kpsa_python
