// Evaluation while compiling: constants, and rest values. Every output is computed over all of its points,
// once. Internal to graph/.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "graph/node_binding.h"

namespace kpsa::engine {

class StaticEvaluator final : public StaticValues {
 public:
  explicit StaticEvaluator(InstanceTable& table) : table_(table), totals_(table, *this) {}
  // Evaluates what the source needs. Null on failure, and ever after; status() says why.
  const Value* Get(const Source& source, bool rest) override;
  void TellOfFailure(const std::string& plug) override;
  PointTotals& totals() { return totals_; }
  const Status& status() const { return status_; }
  Index evaluated() const { return evaluated_; }
  // What binds kernels; as Bind of graph/node_binding unless set.
  using Binder = std::function<Result<BoundKernel>(Index instance, const InstanceSets& sets)>;
  void BindBy(Binder binder) { binder_ = std::move(binder); }
  // Whether a deformer touches any of the points, as its node says (ComputeGroup::touches).
  bool Touches(Index instance, const PointSet& points);
  // Where such answers are kept, and found, if they are those of an earlier compilation.
  using TouchMemo = std::function<std::optional<bool>&(Index instance, const PointSet& points)>;
  void RememberTouches(TouchMemo memo) { touch_memo_ = std::move(memo); }
  // Rest values that are known already (from an earlier compilation), by instance.
  using Outputs = std::vector<std::vector<Value>>;  // by output position and element
  void SetRest(Index instance, std::shared_ptr<const Outputs> outputs) {
    slot(instance, true) = std::move(outputs);
  }
  std::shared_ptr<const Outputs> FindRest(Index instance) { return slot(instance, true); }

 private:
  std::shared_ptr<const Outputs>& slot(Index instance, bool rest);
  Status Run(Index instance, bool rest);
  const Value* Ready(const Source& source, bool rest);

  InstanceTable& table_;
  PointTotals totals_;
  std::vector<std::shared_ptr<const Outputs>> memo_[2];
  std::vector<bool> opened_[2];  // by instance: its inputs were asked for
  std::vector<std::unique_ptr<Value>> taken_;
  Status status_;
  bool told_ = false;  // which plug it leaves without a value
  Index evaluated_ = 0;
  Binder binder_;
  TouchMemo touch_memo_;
};

// The points of `set` out of a complete array.
PointBuffer GatherPoints(ConstPointsView from, int components, const PointSet& set);
// Replaces children of a value: `children` as in Instance::children.
Value AssembleValue(const Value& whole, const std::vector<int>& children,
                    const std::vector<const Value*>& parts);

}  // namespace kpsa::engine
