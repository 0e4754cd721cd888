// A node type that a function of the program computes: for prototypes. It is slow, frames with it are evaluated on
// one thread, and no points that need it are trained; what stays becomes a node of a plugin (docs/howto/plugin.md).
#pragma once

#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace kpsa {

struct NodeAttribute {
  enum class Type {
    kNumber,
    kVector,
    kQuaternion,
    kMatrix
  };  // 1, 3, 4 (x y z w) and 16 numbers (column by column)
  std::string name;
  Type type = Type::kNumber;
  std::vector<double> value =
      {};  // an input's where nothing is set; empty: zeros, or what turns and moves nothing
};

// A span whose places are checked: asking for one that there is not throws, which is an error of the node.
template <typename T>
class Row {
 public:
  Row() = default;
  Row(std::span<T> values, std::string_view name) : values_(values), name_(name) {}
  T& operator[](std::size_t i) const {
    if (i >= values_.size())
      throw std::out_of_range("asks for place " + std::to_string(i) + " of " + std::string(name_) +
                              ", which has " + std::to_string(values_.size()));
    return values_[i];
  }
  std::size_t size() const { return values_.size(); }
  T* data() const { return values_.data(); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.end(); }
  operator std::span<T>() const { return values_; }  // NOLINT: implicit by design

 private:
  std::span<T> values_;
  std::string_view name_;  // "inputs", or an attribute's
};

// What a function reads and writes while it computes.
struct NodeCall {
  Row<const Row<const double>> inputs;  // by input, as many numbers as its type has
  Row<const Row<double>> outputs;       // by output; to be written
  Row<const float> points;              // of a deformer: x y z a point, as they come in
  Row<float> out_points;                // as many; they hold the same when the function is called
};

struct NodeType {
  std::string name;  // "wobble", as rigs call it
  std::string doc = {};
  std::vector<NodeAttribute> inputs = {}, outputs = {};
  // It has inPoints and outPoints, too, and stands in a mesh's stack (deform: in a rig, GraphEdit::Deform).
  bool deformer = false;
  // "", or what is wrong, which becomes an error of the node. It gives the same whenever it is given the same; it is
  // called by whatever thread uses the scene, by several at once where several scenes are used. What it throws is
  // an error of the node, too.
  std::function<std::string(const NodeCall&)> compute = {};
};

}  // namespace kpsa
