// Structural as the compiler gives it to compile-time functions of nodes: set values, driven ones, defaults,
// and rest values through a callback. Internal to graph/.
#pragma once

#include <functional>
#include <typeinfo>

#include "graph/instances.h"

namespace kpsa::engine {

// The static outputs that a view may need from upstream: of a structural source, and rest values of inputs.
class StaticValues {
 public:
  virtual ~StaticValues() = default;
  // The value of a source with its component taken; null where an upstream node failed. Stays valid.
  virtual const Value* Get(const Source& source, bool rest) = 0;
  // What the failure that Get has just met leaves without a value, for whoever reads of it.
  virtual void TellOfFailure(const std::string& plug) = 0;
};

class StructuralView final : public Structural {
 public:
  // Without an instance (defaults before resolution) driven values and rest values are not available.
  StructuralView(InstanceTable& table, NodeId node, int geometry, const Instance* instance,
                 StaticValues* statics)
      : table_(table), node_(node), geometry_(geometry), instance_(instance), statics_(statics) {}

  const Value& value(std::string_view name, int element) const override;
  bool is_set(std::string_view name, int element) const override;
  int array_size(std::string_view name) const override;
  int geometry() const override { return geometry_ < 0 ? 0 : geometry_; }
  const std::string& node_name() const override { return table_.graph().name(node_); }
  const Value* rest(std::string_view name, int element) const override;

 protected:
  const std::type_info* choice_type(std::string_view name) const override;

 private:
  int Attribute(std::string_view name) const;
  int Element(int attribute, int element) const;

  InstanceTable& table_;
  NodeId node_;
  int geometry_;
  const Instance* instance_;
  StaticValues* statics_;
};

}  // namespace kpsa::engine
