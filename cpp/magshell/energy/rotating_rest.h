// The gradient of the power of a magnetization that turns and does not stretch by the rest shape, at a point of a body.
//
//   E = - V m . b,   m = R M~,   F = R U = S R       with a fixed b; [v] w = v x w
//
// A deformation I + H of the rest shape turns F into F (I - H) and V into V (1 + tr H). By magnetic_solid_rotating.h R turns about
// - Y^-1 sum_j e_j x (S R H R^T) e_j, so that dE = B : H with
//
//   B = - V ((m . b) I - F^T [y] R),   Y y = m x b,   Y = (tr S) I - S
//
// The power is the rate of E along a motion of the nodes, which changes b too, and its derivative with respect to H is the rate of B:
//
//   Y y' = m' x b + m x b' - Y' y,   Y' = (tr S') I - S',   S' = F' R^T - S [w],   m' = w x m,   R' = [w] R
#pragma once

#include <Eigen/LU>

#include "magshell/energy/rest_corners.h"

namespace magshell {

/// The applied flux density [T] at a point, and its rate along a motion.
struct FluxAndRate {
    Vec3 flux, rate;
};

/// Returns the derivative with respect to H. f, rate: the deformation gradient and its rate; rotation: R; volume [m3] at rest.
inline Mat3 rotating_by_rest_deformation(const Mat3& f, const Mat3& rate, const Mat3& rotation,
                                         const Vec3& remanence, double volume, const FluxAndRate& applied) {
    const auto cross_matrix = [](const Vec3& v) {
        Mat3 matrix;
        matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
        return matrix;
    };
    const auto without = [](const Mat3& m) -> Mat3 { return m.trace() * Mat3::Identity() - m; };
    const Mat3 stretch = f * rotation.transpose(), moved = rate * rotation.transpose();
    const Mat3 inverse = without(stretch).inverse();  // Y^-1
    const Vec3 spin =
        inverse * Vec3(moved(2, 1) - moved(1, 2), moved(0, 2) - moved(2, 0), moved(1, 0) - moved(0, 1));
    const Vec3 m = rotation * remanence, m_rate = spin.cross(m);
    const Vec3 y = inverse * m.cross(applied.flux);
    const Mat3 stretch_rate = moved - stretch * cross_matrix(spin);
    const Vec3 y_rate =
        inverse * (m_rate.cross(applied.flux) + m.cross(applied.rate) - without(stretch_rate) * y);
    const double power = m_rate.dot(applied.flux) + m.dot(applied.rate);
    const Mat3 turning = cross_matrix(y) * rotation;
    return -volume * (power * Mat3::Identity() - rate.transpose() * turning -
                      f.transpose() * (cross_matrix(y_rate) * rotation +
                                       cross_matrix(y) * cross_matrix(spin) * rotation));
}

/// A triangle that moves: its edges from corner 0 with their rates [m], and the rotation R from the shape at rest.
struct MovingFace {
    std::array<Vec3, 2> edges, rates;
    Mat3 rotation;
};

/// Returns the gradient with respect to the edge vectors at rest as magnetic_by_rest_edges does. Normals go over into normals, so a motion
/// of a corner along n~ adds dn~ (x) n~ to H, dn~ = - sum_k g_k (n~ . dX_k).
inline std::array<Vec3, 2> rotating_by_rest_edges(const RestShape& rest, const MovingFace& face,
                                                  const Vec3& remanence, double volume,
                                                  const FluxAndRate& applied) {
    const Vec3 across = face.edges[0].cross(face.edges[1]);
    const Vec3 normal = across.normalized();
    const Vec3 across_rate = face.rates[0].cross(face.edges[1]) + face.edges[0].cross(face.rates[1]);
    Mat3 now, rate;
    now << face.edges[0], face.edges[1], normal;
    rate << face.rates[0], face.rates[1], (across_rate - normal.dot(across_rate) * normal) / across.norm();
    const Mat3 to_rest = rest.frame().inverse();
    const Mat3 by = rotating_by_rest_deformation(now * to_rest, rate * to_rest, face.rotation, remanence,
                                                 volume, applied);
    std::array<Vec3, 2> edges;
    for (int k = 0; k < 2; ++k) {
        const Vec3& slope = rest.gradients[k + 1];
        edges[k] = by * slope - slope.dot(by * rest.normal) * rest.normal;
    }
    return edges;
}

}  // namespace magshell
