// Inside of the rig builder: the steps from RigFile to Rig. Nothing outside rig/build includes this.
#pragma once

#include <deque>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rig/graph_editor.h"
#include "rig/character/rest_pose.h"
#include "rig/build/rig_builder.h"
#include "rig/file/values.h"
#include "files/weights_json.h"

namespace kpsa::engine {

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
    std::map<std::string, const RigAttribute*> special = {};  // parent, at, members, driver, ...
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

  // scopes.cpp: names within templates
  std::string InScope(const std::string& text, int source) const;
  void InScope(YamlNode* value, int source) const;
  void ResolveScopes();

  // clips.cpp: clips of the rig's own
  void AddClips();
  void AddLayer(const RigClip& clip, const RigClipLayer& from, LayeredClip* to, double* end);
  std::vector<bool> MaskedNodes(const RigClipLayer& layer);

  // nodes.cpp: nodes, their values, overrides
  void ApplySpecialOverrides();
  void InOwnNames(YamlNode* value, int source) const;
  RigAttribute SpecialOf(const std::string& key, const RigOverride& override_) const;
  void AddNodes();
  void ReadAttributes(Made* made);
  void ReadAttribute(const Made& made, const RigAttribute& attribute, bool overrides);
  void ReadPlug(const PlugRef& plug, const YamlNode& value, int source, bool overrides);
  void ReadOverrides();
  void ReadOverride(const RigOverride& override_);
  void FinishOverrides();
  void CheckVariants();

  // shapes.cpp: targets, combinations and in-betweens of blend shapes, blend weights of skins
  bool TakeOwnSpecial(const RigOverride& override_);
  void NameTargets(const Made& made);
  void AddShapeRules(Made* made);
  void AddCombination(const Made& made, const YamlNode& key, const YamlNode& body);
  void AddInbetweens(const Made& made, const YamlNode& value);
  bool FindTarget(const Made& made, const YamlNode& at, const std::string& name, PlugRef* weight);
  void SetTargets(Made* made);
  void SetBlendWeights(Made* made);
  void SetInfluences(Made* made);

  // places.cpp: parents, handles, curves
  void AddCurves();
  void ConnectParents();
  void PlaceHandles();
  void ConnectPivots();
  std::optional<NodeId> CommonAncestor(const Made& made) const;
  bool Place(Made* made, int depth);
  bool RestWorld(NodeId transform, const YamlNode& asked, int depth, Matrix4* world);
  bool ReadPlace(const YamlNode& node, int source, int depth, Double3* place);
  bool VertexPlaces(const YamlNode& vertices, const YamlNode* mesh, Places* places);
  bool HangUnderReference(const Made& made, const YamlNode& at);
  Matrix4 LocalAtRest(NodeId transform) const;

  // connect.cpp: connections, names
  void ConnectCurves();
  std::optional<NodeId> FindCurve(const YamlNode& name);
  void MakeConnections();
  bool IsOverridden(const PlugRef& plug) const;
  void ConnectUnlessOverridden(const PlugRef& from, const PlugRef& to, const SourceLocation& where,
                               int source, bool override_clip);
  void ConnectPlugs(const PlugRef& from, const PlugRef& to, const SourceLocation& where, int source,
                    bool override_clip, bool replace);
  Unit PlugUnit(const PlugRef& plug) const;
  std::optional<std::size_t> FindMesh(const std::string& name, const SourceLocation& where);
  std::optional<NodeId> FindTransform(const std::string& name, const SourceLocation& where);

  // constraints.cpp: constraints and IK
  struct NamedTransform {
    NodeId id;
    std::string name;
    SourceLocation where;  // of the key's value
  };
  // A joint whose local matrix below all constraints a chain (IK) reads: so the end may have one, too.
  struct ChainJoint {
    NodeId joint;
    PlugRef to;
    SourceLocation where;
  };
  void AddConstraints();
  void ConnectConstraints();
  std::optional<NamedTransform> ReadTransform(const Made& made, const char* key);
  std::optional<std::vector<NamedTransform>> ReadTransforms(const Made& made,
                                                            const std::vector<const char*>& keys);
  void ConnectTargets(const Made& made);
  void ConnectIk(const Made& made);
  void ConnectSplineIk(const Made& made);
  void ConnectTwist(const Made& made);
  bool ChainBelow(NodeId top, NodeId bottom, std::vector<NodeId>* chain) const;
  bool FailNoAncestor(const NamedTransform& above, const char* above_key, const NamedTransform& below,
                      const char* below_key);
  bool IsUnwritten(const PlugRef& plug) const;
  bool TakeOver(const PlugRef& plug, const Made& by, const PlugRef& in, const PlugRef& out,
                const SourceLocation& where);
  bool ConnectParentOf(NodeId transform, const Made& by, const SourceLocation& where);
  bool Constrain(NodeId transform, const Made& by, const char* in_name, const char* out_name, int element,
                 const SourceLocation& where);
  void ConstrainPole(const Made& made, const std::string& name, const SourceLocation& where);

  // deform.cpp: stacks
  void BuildStacks();
  void BuildMeshStack(const RigDeform& deform, std::size_t mesh, bool any_morphs);
  void BuildPointsStack(const RigDeform& deform);
  bool ResolveStack(const RigDeform& deform, std::size_t mesh, bool any_morphs, std::vector<Stage>* stages);
  bool IsOwn(NodeId node, const RigString& name);
  Made* FindDeformer(const RigString& name);
  bool AddGeometry(Made* made, Geometry geometry, bool world, const SourceLocation& where);
  PointBufferPtr PointsToDeform(const PlugRef& plug, const RigString& name, Matrix4* world_from_points);
  PointBufferPtr RegularGrid(const PlugRef& plug, const RigString& name);

  // drivers.cpp: meshes that drive others
  static const char* SpaceName(bool world) { return world ? "world space" : "mesh space (before the skin)"; }
  void ConnectDrivers();
  void ConnectDriver(const Made& made, const RigAttribute& driver);
  std::shared_ptr<const TriangleUvs> UvsOf(std::size_t mesh);
  void ReadPoses(const Made& made);
  void ConnectTime();
  void SplitStage(const std::string& text, std::string* mesh, std::string* stage) const;
  const Stage* FindStage(const CharacterMesh& mesh, const std::string& stage, const SourceLocation& where);

  // spaces.cpp: how stages before a skin lie in the world at rest
  void PlaceStages();
  void PlaceStagesAtHandles();
  std::optional<Places> HandlePlaces(const Made& made);
  const WeightMap* WeightsOf(const Made& made, std::size_t geometry);
  void SetWorldFromStage(Made* made, std::size_t geometry, const Matrix4& world_from_stage);
  bool BoxOfMembers(Made* lattice, const SourceLocation& where, Matrix4* world_from_box);

  // members.cpp: members, weights
  void SetWeights(Made* made);
  void NoteWeights(const Made& made, const RigAttribute& key, const std::string& geometry,
                   const std::string& path = "", const std::string& map = "");
  const Geometry* GeometryOf(const Made& made, const WeightFile& file) const;
  bool AddMembers(const YamlNode& node, int source, const Made& made, const Geometry& of,
                  std::vector<float>* weights);
  bool AnyOther(const Made& made, const Geometry& of,
                const std::function<bool(const CharacterMesh&)>& has) const;
  bool ReadVertices(const YamlNode& node, std::size_t count, const std::string& of,
                    std::vector<Index>* vertices);
  bool MultiplyByMaps(const RigAttribute& attribute, const Made& made,
                      std::vector<std::vector<float>>* weights);
  bool FindMap(const YamlNode& reference, const std::string& key, int source, const Made& made,
               const WeightFile** file, const NamedWeights** map, const Geometry** of);
  bool FindGeometry(const YamlNode& reference, const Made& made, const WeightFile& file,
                    const std::string& path, const Geometry** of);
  std::vector<float> ByPoint(const WeightFile& file, const NamedWeights& map, const Geometry& of) const;
  const WeightFile* FindWeightFile(const YamlNode& reference, const std::string& path);
  Index VertexCount(const Geometry& of) const;
  Index PointOf(const Geometry& of, Index vertex) const;

  // falloffs.cpp: falloffs, evaluated at rest; false after an error
  bool MultiplyByFalloff(const RigAttribute& attribute, const Made& made, const Geometry& of,
                         std::vector<float>* weights);
  using Falloff = std::optional<std::vector<double>>;  // by point, 0 to 1; none: says nothing of this mesh
  bool ReadFalloff(const YamlNode& node, int source, const Made& made, const Geometry& of, Falloff* falloff);
  bool CombineFalloffs(const YamlNode& list, const std::string& how, int source, const Made& made,
                       const Geometry& of, Falloff* falloff);
  bool ReadFalloffShape(const std::string& kind, const YamlNode& node, int source, const Geometry& of,
                        std::function<double(Double3)>* weight_at);

  // rig_falloff_nodes.cpp: falloffs that vary
  struct FalloffUse {  // a geometry that a falloff node measures, as a deformer has it
    NodeId falloff, deformer;
    int element, geometry;
  };
  void ConnectFalloffs();
  std::optional<PlugRef> FalloffOf(const YamlNode& name, const Made& deformer, std::size_t geometry,
                                   int depth);
  void PlaceFalloffs();
  bool FitsDriver(NodeId falloff, const Made& deformer);

  // lights.cpp: what illuminations see
  void ConnectLights();
  std::optional<NodeId> FindWithOutputs(const YamlNode& name, std::initializer_list<const char*> outputs,
                                        const char* what);

  // request.cpp: controls and acceleration
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
  std::deque<RigNode> own_nodes_;  // the file's own deformers of which overrides set keys that are no
  std::vector<Made> own_made_;     // attributes
  std::deque<RigAttribute> own_attributes_;
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
      written_plugs_[2];                // by nodes, by overrides: a plug has several spellings
  std::set<PlugKey> connected_plugs_;   // of those, the ones that name another plug
  std::set<PlugKey> overridden_plugs_;  // the same
  std::set<PlugKey> stacked_;           // what a stack or a constraint drives
  // Plugs that constraints own, and which one does so where
  std::map<PlugKey, std::pair<std::string, SourceLocation>> constrained_;
  std::vector<ChainJoint> chain_joints_;
  std::unordered_map<Index, Places> curves_;  // by graph node: rest cvs in the world
  std::vector<FalloffUse> falloff_uses_;
  std::map<Index, int> falloff_elements_;  // by falloff node: how many geometries it measures
  std::map<std::size_t, std::shared_ptr<const TriangleUvs>> uvs_;  // by mesh, of those that were asked for
  std::vector<std::optional<SourceLocation>> stack_of_mesh_;
  std::map<std::string, std::optional<WeightFile>> weight_files_;  // by path; none: it could not be read
};

}  // namespace kpsa::engine
