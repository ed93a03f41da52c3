// TriangleTree: the exact signed distance to a closed triangle mesh, by a tree of boxes around its faces.
#pragma once

#include <array>
#include <vector>

#include "magshell/mesh/box_tree.h"
#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// Distances are negative inside. The sign is that of (x - p) . n at the nearest point p, where n is the normal
/// of the face, the sum of the normals of an edge's two faces, or the sum of those around a vertex weighted by
/// their angles (Baerentzen and Aanaes 2005): the only weights for which the sign is always right.
class TriangleTree {
  public:
    /// Creates the tree of a mesh without boundary whose normals point outwards. The mesh must outlive the
    /// tree.
    explicit TriangleTree(const TriangleMesh& mesh);

    /// Returns the signed distance [m] at a point. bound: known upper bound of its magnitude; the smaller, the
    /// faster.
    double signed_distance(const Vec3& point, double bound) const;

  private:
    // The nearest point of a face, and the feature it lies on: the interior (0), an edge (1 + i) or a vertex (4
    // + i).
    struct Nearest {
        Vec3 point;
        int feature;
    };

    Nearest nearest_on(Index face, const Vec3& point) const;
    Vec3 corner(Index face, int i) const {
        return mesh_.rest_positions().row(mesh_.faces()(face, i)).transpose();
    }
    Vec3 pseudo_normal(Index face, int feature) const;

    const TriangleMesh& mesh_;
    BoxTree tree_;
    std::vector<Vec3> face_normals_, edge_normals_, vertex_normals_;
};

}  // namespace magshell
