// Inside of the rig builder: the steps from RigFile to Rig. Nothing outside io/rig_*.cpp includes this.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/graph_editor.h"
#include "io/rest_pose.h"
#include "io/rig_builder.h"
#include "io/rig_values.h"
#include "io/weights_json.h"

namespace kpsa {

class RigBuild {
 public:
  RigBuild(RigFile* file, Rig* rig, RestPose* rest, YamlErrors* errors);
  void Run();

 private:
  // What one geometry of a deformer is.
  struct Geometry {
    std::string name;
    std::optional<std::size_t> mesh;  // in scene.meshes; none: a points attribute
    std::size_t count = 0;            // points
    bool morphed = true;              // after the mesh's morphs in its stack
    Matrix4 world_from_stage = {};    // at rest; the identity for stages in world space
  };
  // A node of the rig file, and those of its keys that are no attributes.
  struct Made {
    const RigNode* from;
    NodeId id;
    std::map<std::string, const RigAttribute*> special = {};  // parent, at, members, weights, falloff, ...
    bool placed = false, placing = false;                     // `at` was followed
    std::vector<Geometry> geometries = {};                    // that it deforms
    std::size_t weighted = 0;                                 // geometries whose weights are set
    bool world = false;                                       // space of the stages that it is in
  };
  struct Pending {  // a connection to make when all nodes exist
    std::string from;
    PlugRef to;
    SourceLocation where;
    int source;
    bool overrides = false;  // comes from overrides:
  };
  using Places = std::vector<Double3>;

  // rig_nodes.cpp: nodes, their values, overrides
  void ApplySpecialOverrides();
  void AddNodes();
  void ReadAttributes(Made* made);
  bool IsSpecial(const NodeDef& def, const std::string& key) const;
  void ReadAttribute(const Made& made, const RigAttribute& attribute, bool overrides);
  void ReadPlug(const PlugRef& plug, const YamlNode& value, int source, bool overrides);
  void ReadOverrides();
  void ReadOverride(const RigOverride& override_);
  void FinishOverrides();

  // rig_places.cpp: parents, handles, curves
  void AddCurves();
  void ConnectParents();
  void PlaceHandles();
  void ConnectPivots();
  std::optional<NodeId> CommonAncestor(const Made& made) const;
  bool Place(Made* made, int depth);
  bool RestWorld(NodeId transform, const YamlNode& asked, int depth, Matrix4* world);
  bool ReadPlace(const YamlNode& node, int source, int depth, Double3* place);
  bool VertexPlaces(const YamlNode& vertices, const YamlNode* mesh, Places* places);
  Matrix4 LocalAtRest(NodeId transform) const;

  // rig_connect.cpp: connections, names
  void ConnectCurves();
  void MakeConnections();
  bool IsOverridden(const PlugRef& plug) const;
  void ConnectUnlessOverridden(const PlugRef& from, const PlugRef& to, const SourceLocation& where,
                               int source, bool override_clip);
  void ConnectPlugs(const PlugRef& from, const PlugRef& to, const SourceLocation& where, int source,
                    bool override_clip, bool replace);
  Unit PlugUnit(const PlugRef& plug) const;
  std::optional<std::size_t> FindMesh(const std::string& name, const SourceLocation& where);
  std::optional<NodeId> FindTransform(const std::string& name, const SourceLocation& where);

  // rig_deform.cpp: stacks
  void BuildStacks();
  void BuildMeshStack(const RigDeform& deform, std::size_t mesh, bool any_morphs);
  void BuildPointsStack(const RigDeform& deform);
  bool ResolveStack(const RigDeform& deform, std::size_t mesh, bool any_morphs, std::vector<Stage>* stages);
  Made* FindDeformer(const RigString& name);
  bool AddGeometry(Made* made, Geometry geometry, bool world, const SourceLocation& where);
  PointBufferPtr PointsToDeform(const PlugRef& plug, const RigString& name, Matrix4* world_from_points);
  PointBufferPtr RegularGrid(const PlugRef& plug, const RigString& name);

  // rig_spaces.cpp: how stages before a skin lie in the world at rest
  void PlaceStages();
  void PlaceStagesAtHandles();
  std::optional<Places> HandlePlaces(const Made& made);
  const WeightMap* WeightsOf(const Made& made, std::size_t geometry);
  void SetWorldFromStage(Made* made, std::size_t geometry, const Matrix4& world_from_stage);
  bool BoxOfMembers(Made* lattice, const SourceLocation& where, Matrix4* world_from_box);

  // rig_members.cpp: members, weights, falloffs
  void SetWeights(Made* made);
  const Geometry* GeometryOf(const Made& made, const WeightFile& file) const;
  bool AddMembers(const YamlNode& node, int source, const Made& made, const Geometry& of,
                  std::vector<float>* weights);
  bool AnyOther(const Made& made, const Geometry& of,
                const std::function<bool(const CharacterMesh&)>& has) const;
  bool ReadVertices(const YamlNode& node, std::size_t count, const std::string& of,
                    std::vector<Index>* vertices);
  bool MultiplyByMaps(const RigAttribute& attribute, const Made& made,
                      std::vector<std::vector<float>>* weights);
  bool MultiplyByFalloff(const RigAttribute& attribute, const Geometry& of, std::vector<float>* weights);
  bool FindMap(const YamlNode& reference, int source, const Made& made, const WeightFile** file,
               const NamedWeights** map, const Geometry** of);
  const WeightFile* FindWeightFile(const YamlNode& reference, const std::string& path);
  Index VertexCount(const Geometry& of) const;
  Index PointOf(const Geometry& of, Index vertex) const;

  // rig_lights.cpp: what illuminations see
  void ConnectLights();
  std::optional<NodeId> FindWithOutputs(const YamlNode& name, std::initializer_list<const char*> outputs,
                                        const char* what);

  // rig_request.cpp: controls and acceleration
  void AddControls();
  void AddAccelerations();

  Graph& graph() { return *rig_->graph; }
  const Graph& graph() const { return *rig_->graph; }
  const FileUnits& units(int source) const { return file_->sources[static_cast<std::size_t>(source)].units; }
  const std::string& folder(int source) const {
    return file_->sources[static_cast<std::size_t>(source)].folder;
  }
  bool Fail(const SourceLocation& where, Status status);
  Made* FindMade(NodeId id);
  Made* FindMade(const std::string& name);

  RigFile* file_;
  Rig* rig_;
  RestPose* rest_;
  YamlErrors* errors_;
  std::vector<Made> made_;
  std::unordered_map<Index, std::size_t> made_by_node_;
  std::unordered_map<std::string, std::size_t> made_by_name_;
  std::unordered_map<std::string, std::size_t> written_;              // names in the file -> RigFile::nodes
  std::unordered_map<std::string, std::vector<Index>> gltf_by_name_;  // verbatim names
  std::unordered_map<Index, Index> gltf_by_node_;                     // graph node -> glTF node
  int conversions_ = 0;
  std::vector<Pending> pending_;
  std::vector<std::pair<PlugRef, bool>> overridden_;  // plug; whether by a value
  using PlugKey = std::tuple<Index, int, int, int>;   // node, attribute, element, component
  static PlugKey KeyOf(const PlugRef& plug) {
    return {plug.node.index, plug.attribute, plug.element, plug.component};
  }
  std::map<PlugKey, SourceLocation>
      written_plugs_[2];                      // by nodes, by overrides: a plug has several spellings
  std::set<PlugKey> connected_plugs_;         // of those, the ones that name another plug
  std::set<PlugKey> overridden_plugs_;        // the same
  std::set<PlugKey> stacked_;                 // points attributes that a stack drives
  std::unordered_map<Index, Places> curves_;  // by graph node: rest cvs in the world
  std::vector<std::optional<SourceLocation>> stack_of_mesh_;
  std::map<std::string, std::optional<WeightFile>> weight_files_;  // by path; none: it could not be read
};

}  // namespace kpsa
