// The exact signed distance to a closed triangle mesh, with a tree of boxes around its faces.
#pragma once

#include <array>
#include <vector>

#include "magshell/mesh/box_tree.h"
#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// Negative inside. The sign is that of (x - p) . n at the nearest point p, with n the normal of the face,
/// the sum of those of an edge's two faces, or the sum of those around a vertex weighted by their angles
/// (Baerentzen and Aanaes 2005): the only weights for which it is always right.
class TriangleTree {
  public:
    /// A mesh without boundary, its normals outwards. It must live as long as the tree.
    explicit TriangleTree(const TriangleMesh& mesh);

    /// `bound`: the magnitude is known to be at most so large; the smaller, the faster.
    double signed_distance(const Vec3& point, double bound) const;

  private:
    // Of a point, the nearest one of a face: on its inside (0), an edge (1 + i) or a vertex (4 + i).
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
