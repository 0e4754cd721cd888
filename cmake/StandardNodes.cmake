# cmake -DFOLDER=nodes -DOUTPUT=standard_nodes.cpp -P StandardNodes.cmake: writes AddStandardNodes (nodes/standard_nodes.h), which calls
# the KPSA_NODES of every source in the folder. A list that is the same leaves the file as it is, and nothing is compiled anew.
cmake_minimum_required(VERSION 3.25)
file(GLOB sources ${FOLDER}/*.cpp)
set(declarations "")
set(calls "")
foreach(source ${sources})
  file(STRINGS ${source} found REGEX "^KPSA_NODES\\(" LIMIT_COUNT 1)
  if(found)
    get_filename_component(name ${source} NAME_WE)
    string(APPEND declarations "KPSA_NODES(${name}, registry);\n")
    string(APPEND calls "  AddNodesOf_${name}(registry);\n")
  endif()
endforeach()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "// Written by cmake/StandardNodes.cmake.
#include \"nodes/standard_nodes.h\"

#include \"nodes/node_file.h\"

namespace kpsa::engine {

@declarations@
void AddStandardNodes(NodeRegistry& registry) {
@calls@}

}  // namespace kpsa::engine
")
