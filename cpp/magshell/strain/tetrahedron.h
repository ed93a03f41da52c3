// Shape functions of tetrahedra with four and ten nodes, and their gradients, at the integration points.
//
// At a point with barycentric coordinates l_i, whose gradients in the reference configuration are a_i:
//   four nodes   N_i = l_i                              g_i = a_i
//   ten nodes    N_i = l_i (2 l_i - 1)                  g_i = (4 l_i - 1) a_i
//                N_ij = 4 l_i l_j                       g_ij = 4 (l_i a_j + l_j a_i)
// In a curved element the a_i differ from point to point. Middle nodes are in the order 01 12 20 03 13 23.
#pragma once

#include <array>

#include "magshell/core/vector3.h"

namespace magshell {

/// The two corners that each middle node of a ten-node tetrahedron lies between.
constexpr int middle_of[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

struct LinearTetrahedron {
    static constexpr int nodes = 4, points = 1;

    /// Returns the derivatives of the shape functions by (l_1, l_2, l_3) at a point.
    static Eigen::Matrix<double, nodes, 3> shape_derivatives(int) {
        Eigen::Matrix<double, nodes, 3> d;
        d << -1.0, -1.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0;
        return d;
    }
    static constexpr double reference_weight = 1.0 / 6.0;

    static void gradients(const SimdVec3 a[3], int, SimdVec3 g[nodes]) {
        g[0] = -(a[0] + a[1] + a[2]);
        for (int k = 0; k < 3; ++k) g[k + 1] = a[k];
    }
};

struct QuadraticTetrahedron {
    static constexpr int nodes = 10, points = 4;
    static constexpr double reference_weight = 1.0 / 24.0;

    /// Returns the barycentric coordinates of an integration point; point p is nearest to corner p. The rule is
    /// exact to second degree.
    static constexpr double barycentric(int point, int corner) {
        return point == corner ? 0.58541019662496845446
                               : 0.13819660112501051518;  // (5 + 3 sqrt 5)/20, (5 - sqrt 5)/20
    }

    static Eigen::Matrix<double, nodes, 3> shape_derivatives(int point) {
        const Eigen::Matrix<double, 4, 3> by_corner = LinearTetrahedron::shape_derivatives(0);
        Eigen::Matrix<double, nodes, 3> d;
        for (int i = 0; i < 4; ++i) d.row(i) = (4.0 * barycentric(point, i) - 1.0) * by_corner.row(i);
        for (int m = 0; m < 6; ++m) {
            const auto [i, j] = middle_of[m];
            d.row(4 + m) =
                4.0 * (barycentric(point, i) * by_corner.row(j) + barycentric(point, j) * by_corner.row(i));
        }
        return d;
    }

    static void gradients(const SimdVec3 a[3], int point, SimdVec3 g[nodes]) {
        SimdVec3 corner[4];
        LinearTetrahedron::gradients(a, 0, corner);
        for (int i = 0; i < 4; ++i) g[i] = SimdDouble(4.0 * barycentric(point, i) - 1.0) * corner[i];
        for (int m = 0; m < 6; ++m) {
            const auto [i, j] = middle_of[m];
            g[4 + m] = SimdDouble(4.0 * barycentric(point, i)) * corner[j] +
                       SimdDouble(4.0 * barycentric(point, j)) * corner[i];
        }
    }
};

/// Returns the shape functions at the integration point of a linear element, its center.
inline std::array<double, 4> shapes_at(LinearTetrahedron, int /*point*/) {
    return {0.25, 0.25, 0.25, 0.25};
}

inline std::array<double, 10> shapes_at(QuadraticTetrahedron, int point) {
    std::array<double, 10> shapes;
    const auto at = [&](int corner) { return QuadraticTetrahedron::barycentric(point, corner); };
    for (int i = 0; i < 4; ++i) shapes[i] = at(i) * (2.0 * at(i) - 1.0);
    for (int m = 0; m < 6; ++m) shapes[4 + m] = 4.0 * at(middle_of[m][0]) * at(middle_of[m][1]);
    return shapes;
}

/// An element in the reference configuration: at each integration point the gradients of l_1, l_2, l_3 and the
/// volume that the point represents [m3].
template <class Element>
struct RestElement {
    Mat3 gradients[Element::points];  // one per row
    double volume[Element::points];   // negative where the element is inverted

    explicit RestElement(const Vec3 x[Element::nodes]) {
        for (int p = 0; p < Element::points; ++p) {
            const Eigen::Matrix<double, Element::nodes, 3> by_reference = Element::shape_derivatives(p);
            Mat3 jacobian = Mat3::Zero();  // dX/d(l_1, l_2, l_3), by columns
            for (int k = 1; k < Element::nodes; ++k) jacobian += (x[k] - x[0]) * by_reference.row(k);
            volume[p] = Element::reference_weight * jacobian.determinant();
            gradients[p] = jacobian.inverse();
        }
    }
};

}  // namespace magshell
