// Node types that functions in Python compute (kpsa/node_type.h).
#pragma once

#include <string>

#include "python/convert.h"

namespace kpsa_python {

// inputs: defaults by name, or None; outputs: kinds by name, names, or None. What does not fit raises.
void AddNode(kpsa::Library& library, const std::string& name, const py::object& inputs,
             const py::object& outputs, const py::object& compute, bool deformer, const std::string& doc);

}  // namespace kpsa_python
