// Normals of point caches. Nothing but writers of caches includes this.
#pragma once

#include <vector>

#include "files/point_cache.h"

namespace kpsa::engine {

// 3V: unit normals of frame `frame`, the sum of the triangles' areas around a vertex and all that it is
// smooth with; +Y where that is nothing. A vertex of flat triangles has the sum of its own. Empty for a mesh without
// triangles.
std::vector<float> CacheNormals(const PointCacheMesh& mesh, std::size_t frame);

// The mesh's parts; the one that stands for all vertices where it names none.
std::vector<CachePart> CacheParts(const PointCacheMesh& mesh);

// The vertices of the part's triangles, three each, counted within the mesh.
std::vector<Index> PartTriangles(const PointCacheMesh& mesh, const CachePart& part);

// Whether all triangles of the part are flat: readers give those that come without normals the ones of their
// faces (glTF 2.0, 3.7.2.1; UsdGeomMesh likewise).
bool PartIsFlat(const PointCacheMesh& mesh, const CachePart& part);

// Whether all vertices of the part have texture coordinates.
bool PartHasUvs(const PointCacheMesh& mesh, const CachePart& part);

}  // namespace kpsa::engine
