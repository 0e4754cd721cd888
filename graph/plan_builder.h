// The compiler's last pass: slots, buffers, tables and adjacency of a Plan. Internal to graph/.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>

#include "graph/plan.h"
#include "graph/step_order.h"

namespace kpsa::engine {

class PlanBuilder {
 public:
  PlanBuilder(InstanceTable& table, const PlanDraft& draft, const StepOrder& order, const Request& request,
              std::vector<BoundKernel> kernels)
      : table_(table), draft_(draft), order_(order), request_(request), kernels_(std::move(kernels)) {}
  std::shared_ptr<const Plan> Build();

 private:
  struct Slots {  // of a placed step
    std::vector<std::vector<std::uint32_t>> outputs;
  };
  void NumberSteps();
  void AddVarying();
  void PlaceOutputs();
  void FillSteps();
  void MakeBatches();
  void FillRequestOutputs();
  void Connect();
  void CacheClosures();
  void CacheNeeds();
  void Explain();
  std::uint32_t SlotOf(const DraftInput& input);
  Index ProducerOf(const DraftInput& input) const;
  const ComputeGroup* BatchGroup(Index number) const;  // of a step that can run in a batch; or null
  std::uint32_t AddSlot(std::size_t size);
  std::uint32_t AddBuffer(std::uint32_t slot, const PointSet& points, Type type, bool workspace,
                          std::uint32_t reuse);
  std::uint32_t ConstantSlot(const Value& value, Type type, const PointSet& points);
  std::uint32_t AddText(const std::string& text);
  Index ShapeOf(const Instance& instance, const ComputeGroup& group);

  InstanceTable& table_;
  const PlanDraft& draft_;
  const StepOrder& order_;
  const Request& request_;
  std::vector<BoundKernel> kernels_;  // by draft step
  std::shared_ptr<Plan> plan_ = std::make_shared<Plan>();
  std::vector<Index> number_;                  // plan step by draft step
  std::vector<Index> placed_;                  // draft step by plan step
  std::vector<Slots> slots_;                   // by draft step
  std::vector<std::uint32_t> buffer_of_step_;  // by draft step: number of the buffer of its first output
  std::unordered_map<std::string, std::uint32_t> small_constants_;  // slots by their bytes
  std::map<std::pair<const Value*, Digest>, std::uint32_t> point_constants_;
  std::unordered_map<std::string, std::uint32_t> texts_;
  std::unordered_map<const ComputeGroup*, Index> shape_of_;
};

}  // namespace kpsa::engine
