// MagneticSix: the Zeeman energy of a magnetized quadratic triangle in an applied field, at its six interior
// points.
//
//   E_p = - w_p/2 J~_p h M . B(x_p)                               [J]   energy/magnetic_face.h
//
// The law of M takes for a_1 and a_2 the derivatives of the position from corner 0 towards the other two corners. The coordinates
// (alpha, beta, gamma) of M~_r in the frame of the reference shape differ from point to point on a curved face.
#pragma once

#include "magshell/energy/magnetic_face.h"
#include "magshell/strain/deformation.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

template <class Law>
class MagneticSix {
  public:
    static constexpr int points = 6;
    using Element = typename Law::Element;

    MagneticSix(const SimdVec3 x[6], int point, const Element& e)
        : point_(point), x_(x), frame_(of(x, point, e)) {}

    const Law& frame() const { return frame_; }
    SimdVec3 position() const { return combination(shapes_[point_], x_); }
    /// Returns the vectors a_1 and a_2 of nodes at x, or their rates for nodal velocities.
    std::array<SimdVec3, 2> edges(const SimdVec3 x[6]) const {
        return {combination(first(), x), combination(second(), x)};
    }
    /// Computes the rates of the law's frame for given nodal velocities.
    void rates(const SimdVec3 along[6], SimdVec3 rate[3]) const {
        const std::array<SimdVec3, 2> by = edges(along);
        const SimdVec3 ends[3] = {{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)}, by[0], by[1]};
        frame_.frame_rate(ends, rate);
    }
    /// Returns the velocity of the point for given nodal velocities.
    SimdVec3 velocity(const SimdVec3 along[6], const SimdVec3*) const {
        return combination(shapes_[point_], along);
    }

    void add_gradient(const Element& e, const FieldAtPoint& field, bool varies, SimdVec3 g[6]) const {
        add_gradient(e, field.flux, g);
        if (varies) add_gradient_by_position(e, field, g);
    }
    /// Adds lower blocks at lower_index(k, l).
    void add_hessian(const Element& e, const FieldAtPoint& field, bool varies, SimdMat3 h[21]) const {
        add_hessian(e, field.flux, h);
        if (varies) add_hessian_by_position(e, field, h);
    }

  private:
    void add_gradient(const Element& e, const SimdVec3& flux, SimdVec3 g[6]) const {
        SimdVec3 d1, d2;
        frame_.by_edges(e, flux, d1, d2);
        for (int k = 0; k < 6; ++k)
            g[k] += (-e.volume) * (SimdDouble(first()[k]) * d1 + SimdDouble(second()[k]) * d2);
    }

    /// Adds the part of the gradient that is due to the gradient of the field.
    void add_gradient_by_position(const Element& e, const FieldAtPoint& field, SimdVec3 g[6]) const {
        const SimdVec3 pull = -e.volume * multiply(transpose(field.gradient), frame_.magnetization(e));
        for (int k = 0; k < 6; ++k) g[k] += SimdDouble(shapes_[point_][k]) * pull;
    }

    /// Adds lower blocks at lower_index(k, l) in a field taken as uniform.
    void add_hessian(const Element& e, const SimdVec3& flux, SimdMat3 h[21]) const {
        SimdMat3 by_ends[6];
        frame_.hessian(e, flux, by_ends);
        const SimdMat3 &h11 = by_ends[lower_index(1, 1)], &h21 = by_ends[lower_index(2, 1)],
                       &h22 = by_ends[lower_index(2, 2)], h12 = transpose(h21);
        for (int l = 0; l < 6; ++l) {
            const SimdDouble g1(first()[l]), g2(second()[l]);
            const SimdMat3 by_first = g1 * h11 + g2 * h12, by_second = g1 * h21 + g2 * h22;
            for (int k = l; k < 6; ++k)
                h[lower_index(k, l)] +=
                    SimdDouble(first()[k]) * by_first + SimdDouble(second()[k]) * by_second;
        }
    }

    /// Adds the part due to the variation of the field in space: d2(M . B(x_p)) with one or two derivatives by
    /// x_p.
    void add_hessian_by_position(const Element& e, const FieldAtPoint& field, SimdMat3 h[21]) const {
        SimdMat3 by_first, by_second;  // d(M . dB/dx_j)/da, row = component of a, column = j
        for (int j = 0; j < 3; ++j) {
            SimdVec3 d1, d2;
            frame_.by_edges(e, {field.gradient.at[j], field.gradient.at[3 + j], field.gradient.at[6 + j]}, d1,
                            d2);
            set_column(by_first, j, d1);
            set_column(by_second, j, d2);
        }
        const std::array<double, 6>& shape = shapes_[point_];
        SimdMat3 by_node[6];
        for (int k = 0; k < 6; ++k)
            by_node[k] = SimdDouble(first()[k]) * by_first + SimdDouble(second()[k]) * by_second;
        for (int k = 0; k < 6; ++k)
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += (-e.volume) * (SimdDouble(shape[l]) * by_node[k] +
                                                       SimdDouble(shape[k]) * transpose(by_node[l]) +
                                                       SimdDouble(shape[k] * shape[l]) * field.curvature);
    }

    const std::array<double, 6>& first() const { return firsts_[point_]; }
    const std::array<double, 6>& second() const { return seconds_[point_]; }

    static SimdVec3 combination(const std::array<double, 6>& by_node, const SimdVec3 x[6]) {
        SimdVec3 sum = SimdDouble(by_node[0]) * x[0];
        for (int k = 1; k < 6; ++k) sum += SimdDouble(by_node[k]) * x[k];
        return sum;
    }
    static Law of(const SimdVec3 x[6], int point, const Element& e) {
        const SimdVec3 corners[3] = {{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)},
                                     combination(firsts_[point], x),
                                     combination(seconds_[point], x)};
        return Law(corners, e);
    }
    static void set_column(SimdMat3& matrix, int j, const SimdVec3& column) {
        matrix.at[j] = column.x;
        matrix.at[3 + j] = column.y;
        matrix.at[6 + j] = column.z;
    }

    static constexpr std::array<std::array<double, 6>, points> firsts_ = six_nodes::inside_towards(2, 1.0),
                                                               seconds_ = six_nodes::inside_towards(1, -1.0);
    static constexpr std::array<std::array<double, 6>, points> shapes_ = [] {
        std::array<std::array<double, 6>, points> all{};
        for (int p = 0; p < points; ++p) all[p] = six_nodes::shapes(six_nodes::inside[p].at);
        return all;
    }();

    const int point_;
    const SimdVec3* x_;
    const Law frame_;
};

}  // namespace magshell
