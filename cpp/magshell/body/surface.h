// Triangles with the scene's nodes, numbered along a curve for locality: what magnetization, water, contact
// and area loads act on.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

class Surface {
  public:
    /// `vertices`: the scene's vertex of each vertex of the mesh, in the caller's numbers. `owner`: the body
    /// under whose name its parameters stand.
    Surface(std::string owner, const TriangleMesh& mesh, const std::vector<Index>& vertices,
            NodeNumbering& numbering);
    Surface(const Surface&) = delete;
    Surface& operator=(const Surface&) = delete;

    Index n_faces() const { return faces.size(); }
    /// The corners of a face at rest [m].
    const std::array<Vec3, 3>& rest_corners(Index face) const { return rest_corners_[face]; }
    /// The largest coordinate at rest of the corners of a face [m]. A unit of its round-off is how exactly
    /// they are known.
    double largest_coordinate(Index face) const;
    /// The smallest height of a face at rest [m].
    double smallest_height(Index face) const;
    /// Of the bounding box at rest: its diagonal [m].
    double extent() const;

    const std::string owner;
    Renumbering faces;                          // the caller's <-> ours
    std::vector<std::array<Index, 3>> corners;  // per face, our nodes

  private:
    std::vector<std::array<Vec3, 3>> rest_corners_;
};

}  // namespace magshell
