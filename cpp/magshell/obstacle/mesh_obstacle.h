// MeshObstacle: a body bounded by a closed triangle mesh, as a smoothed signed-distance field.
//
// The exact signed distance is sampled once on a regular grid and interpolated by tricubic B-splines phi, whose
// zero level set is a smooth copy of the mesh: edges are rounded within about a cell, and details finer than
// two cells are lost. The distance is the exact distance to this level set: to the point p with phi(p) = 0 and
// x - p parallel to dphi(p).
//
// In the middle of the body, or far outside a concave part, there is no such point nearby; there the distance
// is phi, and the normal that of phi's level set. Outside the grid, which reaches four cells beyond the mesh, the
// distance is that to the box around the mesh: never more than the true one.
#pragma once

#include <vector>

#include "magshell/mesh/triangle_mesh.h"
#include "magshell/obstacle/obstacle.h"
#include "magshell/obstacle/simple_shapes.h"

namespace magshell {

class MeshObstacle final : public Obstacle {
  public:
    /// Creates the obstacle from a mesh without boundary whose normals point outwards; `resolution` is the
    /// number of cells along its longest side. Throws InvalidInput for meshes with a boundary, or where space
    /// outside counts as inside.
    MeshObstacle(const TriangleMesh& mesh, Index resolution);

    Distance distance(const Vec3& point) const override;

  private:
    struct Level {
        double value;
        Vec3 gradient;
        Mat3 second;
    };
    bool contains(const Vec3& point) const;
    Level level(const Vec3& point) const;
    bool nearest(const Vec3& point, const Level& start, Distance& out) const;

    Vec3 origin_;
    double cell_;
    std::array<Index, 3> samples_;
    std::vector<double> coefficients_;
    Vec3 middle_;
    Box bounds_;  // around the mesh, about `middle_`
};

}  // namespace magshell
