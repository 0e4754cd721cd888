// A node type as data: its attributes, and how groups of outputs are computed from inputs. Everybody who
// wants to know about a type (the reader of rig files, the compiler, the reference) reads this declaration.
// Definitions are immutable once they are in a registry.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <typeinfo>
#include <vector>

#include "base/status.h"
#include "graph/compute_context.h"
#include "graph/point_set.h"
#include "graph/value.h"

namespace kpsa::engine {

class LastStep;
class Structural;

inline constexpr int kMaxArrayElements = 1 << 20;  // of an array attribute

struct AttributeDef {
  std::string name;
  Type type = Type::kDouble;
  std::string doc;
  Value default_value;                                    // of an element, for arrays
  double min = -std::numeric_limits<double>::infinity();  // of numbers; outside is an author's error
  double max = std::numeric_limits<double>::infinity();
  Unit unit = Unit::kNone;
  bool output = false;
  bool array = false;          // plugs are name[i]
  bool structural = false;     // read when a plan is made, baked into kernels
  bool lazy = false;           // evaluated only if decide chooses it
  bool lazy_together = false;  // all elements of a lazy array share one decision (one bit)
  bool diagnostic = false;     // decides whether the node fails, never what it computes
  bool per_geometry = false;   // array whose element i belongs to the i-th deformed geometry
  bool world_place = false;    // matrix that is the world's where nothing drives it
  std::vector<std::string> enum_names;
  const std::type_info* choice = nullptr;  // the scoped enum that enum_names are of, where one was given
  std::vector<std::string> aliases;        // other names under which plugs may be written
  std::string grid;  // elements may be written [s,t,u]; names the structural attribute with the divisions
  std::function<Value(const Structural&)> default_from;  // for defaults that follow from structural values
};

// The view that compile-time functions of a node receive. Names are attribute names; asking for one that the
// definition lacks throws, and so becomes an error of the node.
class Structural {
 public:
  virtual ~Structural() = default;
  virtual const Value& value(std::string_view name, int element = -1) const = 0;  // set, driven or default
  virtual bool is_set(std::string_view name, int element = -1) const = 0;         // set or driven
  virtual int array_size(std::string_view name) const = 0;
  virtual int geometry() const = 0;  // which element, for per-geometry groups; otherwise 0
  virtual const std::string& node_name() const = 0;
  // The value of an input with everything at its default: controls as set in the graph, no clip. Null where
  // an upstream node failed. Points come complete.
  virtual const Value* rest(std::string_view name, int element = -1) const = 0;

  int get_int(std::string_view name) const { return static_cast<int>(value(name).AsInt()); }
  double get_double(std::string_view name) const { return value(name).AsDouble(); }
  bool get_bool(std::string_view name) const { return value(name).AsInt() != 0; }
  // Of an enum, as what it was declared with; asking for another one throws, too.
  template <typename E>
  E choice(std::string_view name) const {
    return static_cast<E>(ChoiceOf(name, typeid(E)));
  }
  template <typename T>
  const T* asset(std::string_view name, int element = -1) const {
    return value(name, element).asset<T>();
  }

 protected:
  // The scoped enum of an enum attribute; null where none was given.
  virtual const std::type_info* choice_type(std::string_view) const { return nullptr; }

 private:
  std::int64_t ChoiceOf(std::string_view name, const std::type_info& as) const;
};

// Which points of the inputs an output needs.
class Demand {
 public:
  virtual ~Demand() = default;
  virtual const Structural& structural() const = 0;
  // The set demanded of an output (empty if nobody wants it).
  virtual const PointSet& output(std::string_view name, int element = 0) const = 0;
  virtual Index input_total(std::string_view name,
                            int element = 0) const = 0;  // points of that input's array
  virtual void Require(std::string_view name, int element, const PointSet& points) = 0;
  // This output does not depend on a small input: it need not be evaluated, and holds its default.
  virtual void Skip(std::string_view name, int element) = 0;
};

// Everything of Demand, answered: the point sets of both sides.
class Binding {
 public:
  virtual ~Binding() = default;
  virtual const Structural& structural() const = 0;
  virtual const PointSet& output(std::string_view name, int element = 0) const = 0;
  virtual const PointSet& input(std::string_view name, int element = 0) const = 0;
};

struct BoundKernel {
  std::shared_ptr<const void> object;
  std::size_t scratch_floats = 0;  // per evaluation, from the thread's workspace
  std::size_t state_bytes = 0;     // per evaluator, zeroed at its creation
  float cost_ns = 0;  // of an evaluation, where the points that come out do not say it; 0: ComputeGroup's
  Index touched_points = kNoIndex;  // of these, that cost ComputeGroup's a point; kNoIndex: all
  std::size_t object_bytes = 0;     // sizeof, where it is worth fetching ahead of the compute
  ComputeFn compute = nullptr;      // in place of the group's, as the binding knows more; null: the group's
};

using DemandFn = std::function<void(Demand&)>;
// Whether a node may change any of these points; those that it does not come out bit for bit as they came in.
using TouchFn = std::function<bool(const Structural&, const PointSet&)>;
using BindFn = std::function<Result<BoundKernel>(const Binding&)>;
// From the kernels of the steps of a batch, which outlive it.
using BindBatchFn = std::function<std::shared_ptr<const void>(std::span<const void* const> kernels)>;
// Null: it has none with these values.
using LastStepFn = std::function<Result<std::shared_ptr<const LastStep>>(const Structural&)>;
using PointCountFn = std::function<Result<Index>(const Structural&, std::string_view output, int element)>;

// Outputs that are computed together, and from what.
struct ComputeGroup {
  std::vector<int> inputs;  // attribute numbers, without the structural ones
  std::vector<int> outputs;
  bool per_geometry = false;  // one step for every element of the per-geometry outputs
  bool named = false;         // the compute says itself what it reads (graph/node_context.h)
  ComputeFn compute = nullptr;
  DecideFn decide = nullptr;  // with lazy inputs
  ComputeBlockFn compute_block = nullptr;
  ComputeBatchFn compute_batch = nullptr;  // of groups with one small output and no arrays
  BindBatchFn bind_batch;
  DemandFn demand;               // null: the same points of every points input
  BindFn bind;                   // null: no kernel
  PointCountFn point_count;      // null: as many as the first points input has
  int in_place_input = -1;       // position in inputs whose buffer the first output may overwrite
  int passed_input = -1;         // position in inputs of what the only output equals, bit for bit, while
  std::vector<int> held_inputs;  // these (positions) hold their defaults
  TouchFn touches;               // of the points of the only output; null: it may change any
  int touched_input = -1;        // position in inputs of the points that it changes
  int strength_input = -1;       // position in inputs of a number: while that is 0, it touches none of them
  float cost_ns = 20;            // rough; decides what is worth a thread
  float cost_ns_per_point = 0;
};

struct NodeDef {
  std::string name;
  std::string doc;
  std::string category = "utility";  // heading in the reference
  int version = 1;                   // raise it when results change: it invalidates kernels and subspaces
  bool animation = false;            // brings a clip: its connections are ignored in the rest state
  bool stateful = false;             // needs its previous frame
  bool prototype = false;      // a function of the host program computes it: slow, on one thread at a time
  bool passes_points = false;  // its points are those that come in, where it succeeds
  LastStepFn last_step;        // of its points (graph/last_step.h); null: it has none
  std::vector<AttributeDef> attributes;
  std::vector<ComputeGroup> groups;
  std::vector<std::string> problems;  // of the declaration, noted while it was built

  // All that is wrong with it: `problems`, outputs that nothing computes, inputs that no compute names, a name
  // that is missing.
  std::vector<std::string> Problems() const;

  int FindAttribute(std::string_view attribute_name) const;  // -1 if there is none
  int GroupOfOutput(int attribute) const;                    // -1 if no group computes it
  std::vector<std::string> AttributeNames() const;
};

}  // namespace kpsa::engine
