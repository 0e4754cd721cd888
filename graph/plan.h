// The compiled form of (graph, request): steps in dependency order, where their values lie, bound kernels,
// and why each node is or is not part of it. Immutable, shared by all threads and evaluators; it does not
// refer to the graph that it was made from.
//
// Steps belong to segments. Segment 0 is evaluated whenever asked; every lazy input opens a child segment,
// evaluated only when its owner's decide chooses it. What several lazy inputs of one owner share, and nobody
// else reads, has a segment between the owner's and theirs, evaluated before the chosen ones if there are
// any. A segment's steps are a contiguous range, ordered by level: steps of one level do not depend on each
// other.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "graph/point_set.h"
#include "graph/step_shape.h"

namespace kpsa::engine {

struct RequestedOutput {
  PlugRef plug;
  PointSet points;  // of a points plug; the default (total 0) means all
};

// What is wanted, and what may vary between evaluations.
struct Request {
  std::vector<RequestedOutput> outputs;
  std::vector<PlugRef> varying;
};

// A plug that varies in a plan, or one number of it: where an evaluator of that plan takes a value from
// outside.
struct PlugHandle {
  Index varying = kNoIndex;   // kNoIndex: the plug does not vary
  int component = -1;         // of a double3 or quaternion; -1: all of the plug
  Type type = Type::kDouble;  // of what is set: the component's, if there is one
  explicit operator bool() const { return varying != kNoIndex; }
  bool IsWholeNumber() const { return type == Type::kBool || type == Type::kInt || type == Type::kEnum; }
};

class Plan {
 public:
  // One run of compute. 64 bytes, read in order.
  struct Step {
    ComputeFn compute = nullptr;
    const void* kernel = nullptr;
    std::uint32_t in = 0, out = 0;            // into tables()
    std::uint32_t deps = 0, deps_count = 0;   // into deps(): producers whose change makes this step stale
    std::uint32_t value = 0, value_size = 0;  // the small outputs, one range of slots
    std::uint32_t scratch = 0;                // floats into the workspace
    std::uint32_t state = 0;                  // bytes into the evaluator's state
    std::uint32_t branch = kNoIndex;          // into branches(), for steps with lazy inputs
    std::uint32_t batch = kNoIndex;           // into batches(), for steps that can run together
    std::uint16_t unit_size = 1;              // steps that run together; at the first of them
    std::uint16_t unit_offset = 0;            // how far the first of the unit is before this step
    std::uint32_t kernel_bytes = 0;           // from `kernel` on, that are worth fetching ahead
    bool runs_plainly() const {
      return branch == kNoIndex && batch == kNoIndex && unit_size == 1 && unit_offset == 0;
    }
  };
  static_assert(sizeof(Step) == 64);
  // Steps [first, first + count) of one kind and level: where all of them are stale, one call computes them.
  struct Batch {
    ComputeBatchFn compute = nullptr;
    const void* kernel = nullptr;
    Index first = 0, count = 0;
    std::uint32_t stride = 0;   // between the inputs of its steps, in tables()
    std::uint32_t scratch = 0;  // floats into the workspace, for the outputs
  };
  struct Branch {
    DecideFn decide = nullptr;
    ComputeBlockFn compute_block = nullptr;
    // By lazy input, in the order of declaration
    std::vector<std::uint8_t> bit_of_lazy;  // its bit in what decide returns
    std::vector<Index> segment_of_lazy;     // kNoIndex where it needs no step
    std::vector<Index> lazy_deps;           // its producer; kNoIndex for none
  };
  // Segment 0 runs in every frame, another one if a lazy input is chosen that needs it: it is its own, or shared by
  // several (`users`), runs when the first of them does, and comes after those that need it.
  struct Segment {
    Index parent = kNoIndex;    // which has run before
    Index owner = kNoIndex;     // the step whose lazy inputs it serves; kNoIndex where it serves several
    Index begin = 0, end = 0;   // steps
    std::vector<Index> levels;  // begin of every level, and end
    std::vector<Index> users,
        needs;  // of what is shared: segments that read it; shared segments that it reads
    bool uses_workspace = false;
  };
  struct Buffer {  // of points: where its slot and its floats are
    std::uint32_t slot = 0;
    Index count = 0;
    int components = 3;
    std::size_t offset = 0;  // floats into the evaluator's buffers, or the workspace
    bool workspace = false;
    const float* constant = nullptr;       // points of the plan itself
    const PointBuffer* initial = nullptr;  // what a varying points plug starts with
  };
  struct Varying {
    PlugRef plug;
    std::string name;
    Type type = Type::kDouble;
    std::uint32_t slot = 0;
    Index points = 0;  // of a points plug
    double min = 0, max = 0;
  };
  struct Output {
    std::string name;
    Type type = Type::kDouble;
    std::uint32_t slot = 0;
    Index producer = kNoIndex;  // step, or steps().size() + varying; kNoIndex for a constant
    PointSet points;
  };
  // What a person sees of a step. Texts are offsets into the plan's text; see step_name and its kin.
  struct StepInfo {
    NodeId node;
    std::uint32_t name = 0, type = 0, label = 0;
    Index segment = 0;
    Index points = 0, points_total = 0;  // 0 for steps without points
    Index shape = kNoIndex;              // what its compute reads and writes; kNoIndex: it is none of a node
    float cost_ns = 0;
  };
  struct Excluded {
    std::string node_name, reason;
  };

  const std::vector<Step>& steps() const { return steps_; }
  const std::vector<std::uint32_t>& tables() const { return tables_; }
  const std::vector<Index>& deps() const { return deps_; }
  const std::vector<Branch>& branches() const { return branches_; }
  const std::vector<Batch>& batches() const { return batches_; }
  const std::vector<Segment>& segments() const { return segments_; }
  const std::vector<Buffer>& buffers() const { return buffers_; }
  const std::vector<Varying>& varying() const { return varying_; }
  const std::vector<Output>& outputs() const { return outputs_; }
  const std::vector<StepInfo>& infos() const { return infos_; }
  const StepShape* shape(Index step) const {
    return infos_[step].shape == kNoIndex ? nullptr : &shapes_[infos_[step].shape];
  }
  const std::vector<Excluded>& excluded() const { return excluded_; }
  // The first node that needs its previous frame (NodeDef::stateful), or "": such a plan is evaluated in
  // ascending order on one evaluator.
  const std::string& stateful_node() const { return stateful_node_; }
  // The first node that a function of the host program computes (NodeDef::prototype), or "": on one thread.
  const std::string& prototype_node() const { return prototype_node_; }
  const char* step_name(Index step) const { return text_.data() + infos_[step].name; }  // of its node
  const char* step_type(Index step) const { return text_.data() + infos_[step].type; }  // of its node
  const char* step_label(Index step) const {
    return text_.data() + infos_[step].label;
  }  // "", "gather", "assemble", ...
  // Consumers of a producer: steps that read it (all segments).
  std::span<const Index> consumers(Index producer) const {
    return {consumers_.data() + consumer_offsets_[producer],
            consumer_offsets_[producer + 1] - consumer_offsets_[producer]};
  }
  // Closures of the varying plugs as ranges [begin, end) of steps; empty where a walk is cheaper than storing
  // them.
  std::span<const std::pair<Index, Index>> closure(Index varying) const {
    return varying < closures_.size() ? std::span<const std::pair<Index, Index>>(closures_[varying])
                                      : std::span<const std::pair<Index, Index>>();
  }
  // The steps that an output needs, itself included, whatever is chosen, a bit each; empty where a walk is cheaper than
  // storing them.
  std::span<const std::uint64_t> needs(Index output) const {
    return output < needs_.size() ? std::span<const std::uint64_t>(needs_[output])
                                  : std::span<const std::uint64_t>();
  }
  // The same of a producer, added to bits [steps / 64 + 1]; `stack` is scratch, of the capacity of as many steps.
  // Returns how many steps it visited.
  std::size_t AddNeeds(Index producer, std::span<std::uint64_t> bits, std::vector<Index>* stack) const;
  const std::vector<std::byte>& initial_values() const {
    return initial_values_;
  }  // constants in their slots
  std::size_t buffer_floats() const { return buffer_floats_; }
  std::size_t workspace_floats() const { return workspace_floats_; }
  std::size_t state_bytes() const { return state_bytes_; }
  // Of a plug, the varying plug that it is or that holds it (an element's, of a component); kNoIndex if none
  // is.
  Index FindVarying(const PlugRef& plug) const;
  PlugHandle Handle(const PlugRef& plug) const;  // of single points there is none: points are set together
  std::size_t MemoryBytes() const;               // of this object without kernels and names

 private:
  friend class PlanBuilder;
  std::vector<Step> steps_;
  std::vector<std::uint32_t> tables_;
  std::vector<Index> deps_, consumers_, consumer_offsets_;
  std::vector<Branch> branches_;
  std::vector<Batch> batches_;
  std::vector<Segment> segments_;
  std::vector<Buffer> buffers_;
  std::vector<Varying> varying_;
  std::vector<Output> outputs_;
  std::vector<StepInfo> infos_;
  std::vector<StepShape> shapes_;  // of the types of nodes, once each
  std::vector<Excluded> excluded_;
  std::vector<std::vector<std::pair<Index, Index>>> closures_;
  std::vector<std::vector<std::uint64_t>> needs_;
  std::vector<std::byte> initial_values_;
  std::string text_, stateful_node_, prototype_node_;
  std::vector<std::shared_ptr<const void>> owned_;  // kernels, constant points, gather maps
  std::size_t buffer_floats_ = 0, workspace_floats_ = 0, state_bytes_ = 0;
};

}  // namespace kpsa::engine
