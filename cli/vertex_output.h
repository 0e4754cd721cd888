// Animated vertices of the meshes that are shown, into a file of any format: .npz frame by frame, the others
// (.pc2 .mdd .glb .usda) once all frames are there. World space in metres, vertices in the order of the glTF
// file.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "host/skin_record.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct VertexOutputOptions {
  bool force = false;
  bool blender = false;  // .pc2 and .mdd in Blender's axes and vertex order
  // Of a .glb: what its joints and morph targets alone do, which has all frames by Finish; null: nothing is known.
  const SkinRecord* skins = nullptr;
  bool skinned = false;  // a mesh that they do not move alone is an error
};

class VertexOutput {
 public:
  virtual ~VertexOutput() = default;
  // The next frame: for each mesh that is shown, all its points in their order, all finite.
  virtual Status Frame(std::span<const ConstPointsView> meshes) = 0;
  // Completes the file; without it nothing appears. Returns what a user should know, one line each.
  virtual Result<std::vector<std::string>> Finish() = 0;
  virtual std::vector<std::string> paths() const = 0;
};

// The suffixes that CreateVertexOutput knows.
std::vector<std::string> VertexSuffixes();

// Refusals: an unknown suffix, another format than .npz for stdout, existing files, more than 4 GB for
// formats that are collected in memory. The rig must outlive the output.
Result<std::unique_ptr<VertexOutput>> CreateVertexOutput(const std::string& output, const Rig& rig,
                                                         std::vector<double> times,
                                                         const VertexOutputOptions& options);

}  // namespace kpsa::engine
