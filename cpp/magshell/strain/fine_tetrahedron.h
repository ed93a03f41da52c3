// FineTetrahedron: shape functions at the points of a tetrahedron at which a field that varies over it is sampled.
//
// Gauss' product rule of a cube, four points along each edge, collapsed to the tetrahedron: for u, v, w in (0, 1)
//
//   l_1 = u,  l_2 = v (1 - u),  l_3 = w (1 - u) (1 - v),   weight (1 - u)^2 (1 - v)
//
// It integrates polynomials of degree 5.
#pragma once

#include <array>

#include "magshell/strain/tetrahedron.h"

namespace magshell {

using Barycentric = std::array<double, 4>;

inline std::array<double, 4> shapes_at(LinearTetrahedron, const Barycentric& at) {
    return at;
}

inline std::array<double, 10> shapes_at(QuadraticTetrahedron, const Barycentric& at) {
    std::array<double, 10> shapes;
    for (int i = 0; i < 4; ++i) shapes[i] = at[i] * (2.0 * at[i] - 1.0);
    for (int m = 0; m < 6; ++m) shapes[4 + m] = 4.0 * at[middle_of[m][0]] * at[middle_of[m][1]];
    return shapes;
}

inline Eigen::Matrix<double, 4, 3> shape_derivatives_at(LinearTetrahedron, const Barycentric&) {
    return LinearTetrahedron::shape_derivatives(0);
}

/// Returns the derivatives by (l_1, l_2, l_3), linear functions that the integration points determine: at = sum c_p at_p.
inline Eigen::Matrix<double, 10, 3> shape_derivatives_at(QuadraticTetrahedron, const Barycentric& at) {
    constexpr double high = QuadraticTetrahedron::barycentric(0, 0),
                     low = QuadraticTetrahedron::barycentric(0, 1);
    Eigen::Matrix<double, 10, 3> derivatives = Eigen::Matrix<double, 10, 3>::Zero();
    for (int p = 0; p < 4; ++p)
        derivatives += (at[p] - low) / (high - low) * QuadraticTetrahedron::shape_derivatives(p);
    return derivatives;
}

template <class Element>
struct FineTetrahedron {
    static constexpr int per_edge = 4, points = per_edge * per_edge * per_edge;

    std::array<std::array<double, Element::nodes>, points> shapes;
    std::array<Eigen::Matrix<double, Element::nodes, 3>, points> derivatives;  // by (l_1, l_2, l_3)
    std::array<double, points> weights;                                        // together 1/6

    static const FineTetrahedron& get() {
        static const FineTetrahedron table;
        return table;
    }

  private:
    FineTetrahedron() {
        constexpr double line[per_edge] = {0.069431844202973712388, 0.33000947820757186760,
                                           0.66999052179242813240, 0.93056815579702628761},
                         length[per_edge] = {0.17392742256872692869, 0.32607257743127307131,
                                             0.32607257743127307131, 0.17392742256872692869};
        int n = 0;
        for (int i = 0; i < per_edge; ++i)
            for (int j = 0; j < per_edge; ++j)
                for (int k = 0; k < per_edge; ++k) {
                    const double u = line[i], v = line[j], w = line[k];
                    const double second = v * (1.0 - u), third = w * (1.0 - u) * (1.0 - v);
                    const Barycentric at = {1.0 - u - second - third, u, second, third};
                    shapes[n] = shapes_at(Element(), at);
                    derivatives[n] = shape_derivatives_at(Element(), at);
                    weights[n++] = length[i] * length[j] * length[k] * (1.0 - u) * (1.0 - u) * (1.0 - v);
                }
    }
};

}  // namespace magshell
