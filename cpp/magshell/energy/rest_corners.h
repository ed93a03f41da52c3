// Gradients by the corners of a face at rest, from those by a homogeneous deformation I + H of the face in its plane there.
//
//   H = sum_k dX_k (x) g_k,   g_k = n~ x t~_k / (2 A~)  the gradient of corner k's shape function   [1/m]
//   dW = B : H   gives   dW/dX_k = B g_k
//
// t~_k is the edge opposite corner k. A motion along the normal n~ tilts the face and changes nothing in its plane to first order.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "magshell/core/types.h"

namespace magshell {

/// The gradients g_k of the shape functions, the unit normal n~ and the area A~ [m2] of a face at rest.
struct RestShape {
    std::array<Vec3, 3> gradients;
    Vec3 normal;
    double area;

    explicit RestShape(const std::array<Vec3, 3>& x) {
        const Vec3 across = (x[1] - x[0]).cross(x[2] - x[0]);
        const double twice = across.norm();
        normal = across / twice;
        area = 0.5 * twice;
        for (int k = 0; k < 3; ++k) gradients[k] = normal.cross(x[(k + 2) % 3] - x[(k + 1) % 3]) / twice;
    }

    /// Returns dA~/dX_k.
    Vec3 area_by_corner(int k) const { return area * gradients[k]; }
};

/// Adds the gradient by the corners, nodes of `out`, for the derivative B by H, in world axes with B n~ = 0.
template <class Corners>
void add_by_rest_corners(const RestShape& face, const Mat3& by_deformation, const Corners& corners,
                         VectorXd& out) {
    for (int k = 0; k < 3; ++k) out.segment<3>(3 * corners[k]) += by_deformation * face.gradients[k];
}

}  // namespace magshell
