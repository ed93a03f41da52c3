// Gradients with respect to the corners of a face at rest, from those by a homogeneous deformation I + H of the face in its plane there.
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

/// The gradients g_k of the shape functions, the edges, the unit normal n~ and the area A~ [m2] of a face at rest.
struct RestShape {
    std::array<Vec3, 3> gradients;
    std::array<Vec3, 2> edges;  // from corner 0 [m]
    Vec3 normal;
    double area;

    explicit RestShape(const std::array<Vec3, 3>& x) {
        edges = {x[1] - x[0], x[2] - x[0]};
        const Vec3 across = edges[0].cross(edges[1]);
        const double twice = across.norm();
        normal = across / twice;
        area = 0.5 * twice;
        for (int k = 0; k < 3; ++k) gradients[k] = normal.cross(x[(k + 2) % 3] - x[(k + 1) % 3]) / twice;
    }

    /// Returns (a~_1, a~_2, n~), with the edges from corner 0.
    Mat3 frame() const {
        Mat3 columns;
        columns << edges[0], edges[1], normal;
        return columns;
    }
    /// Returns dA~/dX_k.
    Vec3 area_by_corner(int k) const { return area * gradients[k]; }
};

/// Adds the gradient with respect to the corners, nodes of `out`, for the derivative B with respect to H, in world axes with B n~ = 0.
template <class Corners>
void add_by_rest_corners(const RestShape& face, const Mat3& by_deformation, const Corners& corners,
                         VectorXd& out) {
    for (int k = 0; k < 3; ++k) out.segment<3>(3 * corners[k]) += by_deformation * face.gradients[k];
}

/// Adds the gradient with respect to the corners through the plane of the face, from the derivative with respect to the components in that
/// plane of a symmetric tensor T that is fixed in space, such as growth: by_tensor, a symmetric tensor in world axes with by_tensor n~ = 0.
/// A motion of a corner tilts the plane: a vector a in it changes by - (dn~ . a) n~, dn~ = - sum_k g_k (n~ . dX_k).
template <class Corners>
void add_by_rest_plane(const RestShape& face, const Mat3& by_tensor, const Mat3& tensor,
                       const Corners& corners, VectorXd& out) {
    const Vec3 tilted = 2.0 * by_tensor * (tensor * face.normal);
    for (int k = 0; k < 3; ++k) out.segment<3>(3 * corners[k]) += face.gradients[k].dot(tilted) * face.normal;
}

/// Returns the gradient with respect to the edge vectors a~_1, a~_2 at rest of a power that is proportional to the area and linear in the
/// coordinates
/// c = R^-1 M~ of a magnetization M~, R = (a~_1, a~_2, n~), from its gradient with respect to M~. As M~ = R c stays, by_c . dc = - by_M~ .
/// dR c, and the motion of a corner tilts n~: dn~ = - sum_k g_k (n~ . dX_k).
inline std::array<Vec3, 2> magnetic_by_rest_edges(const RestShape& face, const Vec3& coordinates,
                                                  const Vec3& by_magnetization) {
    const double power = by_magnetization.dot(face.frame() * coordinates);
    std::array<Vec3, 2> by;
    for (int k = 0; k < 2; ++k) {
        const Vec3& slope = face.gradients[k + 1];
        by[k] = power * slope - coordinates[k] * by_magnetization +
                coordinates[2] * by_magnetization.dot(slope) * face.normal;
    }
    return by;
}

}  // namespace magshell
