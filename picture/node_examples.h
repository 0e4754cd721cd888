// The examples behind the pictures of the node reference, as data (node_examples.cpp).
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/geometry.h"

namespace kpsa::engine {

// A mesh whose quads are drawn as the squares of a chequer board.
struct ExampleShape {
  std::shared_ptr<const Mesh> mesh;
  std::vector<bool> dark;  // by triangle
};

struct NodeExample {
  struct Node {
    std::string name, type;
  };
  using Setting = std::pair<std::string, Value>;
  using Connection = std::pair<std::string, std::string>;

  std::string type;                    // of the node that is shown, called `d`; its points come from `input`
  ExampleShape shape;                  // of the mesh node `m`
  std::vector<Node> nodes = {};        // besides `m` and `d`
  std::vector<Setting> settings = {};  // at rest
  std::vector<Setting> pose = {};      // what moves, and to where
  std::vector<Connection> connections = {};
  std::string input = "m.points";
  ExampleShape driver = {};        // where it follows a mesh: of the mesh node `driver`
  std::string driver_points = {};  // the plug that has its points
};

// One for every deformer that the pictures show.
std::vector<NodeExample> NodeExamples();

}  // namespace kpsa::engine
