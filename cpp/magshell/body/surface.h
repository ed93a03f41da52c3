// Triangles on the nodes of a scene, numbered along a space-filling curve for locality. Magnetization, drag, contact and area loads act on
// them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/nodes.h"
#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

class Surface {
  public:
    /// vertices: the scene vertex of each vertex of the mesh, in the numbering of the caller. owner: name of the body under which its parameters
    /// are registered.
    Surface(std::string owner, const TriangleMesh& mesh, const std::vector<Index>& vertices,
            NodeNumbering& numbering);
    Surface(const Surface&) = delete;
    Surface& operator=(const Surface&) = delete;

    Index n_faces() const { return faces.size(); }
    /// Returns the corners of a face at rest [m].
    const std::array<Vec3, 3>& rest_corners(Index face) const { return rest_corners_[face]; }
    /// Returns the largest coordinate of the corners of a face at rest [m]; their round-off is relative to it.
    double largest_coordinate(Index face) const;
    /// Returns the smallest height of a face at rest [m].
    double smallest_height(Index face) const;
    /// Returns twice the largest distance of a corner from the center at rest [m], which rotations keep.
    double extent() const;

    const std::string owner;
    Renumbering faces;                          // the caller's <-> ours
    std::vector<std::array<Index, 3>> corners;  // per face: our nodes

  private:
    std::vector<std::array<Vec3, 3>> rest_corners_;
};

/// A surface as a body with blocks of its own: what is assembled on its triangles is added to the body whose nodes they have.
class SurfaceBody final : public Body {
  public:
    /// The surface must outlive this object.
    explicit SurfaceBody(const Surface& surface) : surface_(surface) {}

    Index n_elements() const override { return surface_.n_faces(); }
    std::span<const Index> nodes_of(Index element) const override { return surface_.corners[element]; }

  private:
    const Surface& surface_;
};

}  // namespace magshell
