// Where a sheet passes through itself.
#pragma once

#include <utility>
#include <vector>

#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// The pairs of faces, lower number first, sorted, that pass through each other with the vertices at
/// `positions` (n_v, 3) [m]. Faces that share an edge never do, those that share a vertex may, beyond it.
/// What only touches is not among them: see the .cpp for how it is told apart.
std::vector<std::pair<Index, Index>> self_intersections(const TriangleMesh& mesh, const Rows3& positions);

}  // namespace magshell
