// Self-intersections of a triangulated surface.
#pragma once

#include <utility>
#include <vector>

#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// Returns the pairs of faces, lower number first, sorted, that pass through each other with the vertices at
/// `positions` (n_v, 3) [m]. Faces that share an edge never do; those that share a vertex may, beyond it. Faces
/// that only touch are not included; the .cpp explains how they are distinguished.
std::vector<std::pair<Index, Index>> self_intersections(const TriangleMesh& mesh, const Rows3& positions);

}  // namespace magshell
