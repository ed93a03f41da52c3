// A body bounded by a closed triangle mesh.
//
// Its exact signed distance is sampled once on a regular grid and interpolated by tricubic B-splines phi,
// whose zero surface is a smooth copy of the mesh: edges are rounded within about a cell, details finer than
// two cells are lost. The distance is that to this surface, exactly: to the point p with phi(p) = 0 and x - p
// parallel to dphi(p).
//
// In the middle of the body, or far outside a hollow, there is no such point near by; there it is phi, and
// the normal that of phi's level surface.
#pragma once

#include <vector>

#include "magshell/mesh/triangle_mesh.h"
#include "magshell/obstacle/box.h"
#include "magshell/obstacle/obstacle.h"

namespace magshell {

class MeshObstacle final : public Obstacle {
  public:
    /// A mesh without boundary, its normals outwards; `resolution` cells along its longest side. Throws
    /// InvalidInput on other meshes: with a boundary, or with space outside that counts as inside.
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
    Box bounds_;  // around the mesh: a bound of the distance outside the grid
};

}  // namespace magshell
