// MagneticSixFine: the Zeeman energy of a magnetized quadratic triangle at a point over or under its middle surface, where it samples the
// applied field finely.
//
//   E_p = - V_p M . B(X + z n),   X = sum_k N_k x_k                 [J]   energy/magnetic_six.h
//
// It is that of a flat triangle with corners c_0 = X, c_1 = X + a_1, c_2 = X + a_2 at the height z over c_0 (energy/magnetic_face_fine.h).
// These are sums c_a = sum_k L_ak x_k, so that dE/dx_k = sum_a L_ak dE/dc_a.
#pragma once

#include <array>

#include "magshell/energy/face_points.h"
#include "magshell/energy/magnetic_face_fine.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

/// A point of each face of a SIMD vector: the weights of the nodes in X, a_1 and a_2, and z [m].
struct PointOverSix {
    SimdDouble shapes[6], first[6], second[6], height;

    void set(int lane, const FacePoint& point, double thickness) {
        const std::array<double, 6> at = six_nodes::shapes(point.at),
                                    towards = six_nodes::derivative(2, point.at),
                                    back = six_nodes::derivative(1, point.at);
        for (int k = 0; k < 6; ++k) {
            shapes[k].set(lane, at[k]);
            first[k].set(lane, towards[k]);
            second[k].set(lane, -back[k]);
        }
        height.set(lane, point.height * thickness);
    }
};

template <class Law>
class MagneticSixFine {
  public:
    using Element = typename Law::Element;

    MagneticSixFine(const SimdVec3 x[6], const PointOverSix& place, const Element& e)
        : point_(place), x_(x), frame_(of(x, place, e)) {}

    const Law& frame() const { return frame_; }
    SimdVec3 position() const { return sum(point_.shapes, x_) + point_.height * frame_.normal; }
    /// Returns the vectors a_1 and a_2 of nodes at x, or their rates for nodal velocities.
    std::array<SimdVec3, 2> edges(const SimdVec3 x[6]) const {
        return {sum(point_.first, x), sum(point_.second, x)};
    }
    /// Computes the rates of the law's frame for given nodal velocities.
    void rates(const SimdVec3 along[6], SimdVec3 rate[3]) const {
        const std::array<SimdVec3, 2> by = edges(along);
        const SimdVec3 ends[3] = {{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)}, by[0], by[1]};
        frame_.frame_rate(ends, rate);
    }
    /// Returns the velocity of the point, from nodal velocities and those of the frame.
    SimdVec3 velocity(const SimdVec3 along[6], const SimdVec3 rate[3]) const {
        return sum(point_.shapes, along) + point_.height * rate[2];
    }

    void add_gradient(const Element& e, const FieldAtPoint& field, bool varies, SimdVec3 g[6]) const {
        SimdVec3 by_corner[3];
        magnetic_face_fine::gradient(frame_, e, over_face(field, varies), by_corner);
        for (int k = 0; k < 6; ++k) {
            SimdDouble weights[3];
            of_corners(k, weights);
            for (int a = 0; a < 3; ++a) g[k] += weights[a] * by_corner[a];
        }
    }

    /// Adds lower blocks at lower_index(k, l).
    void add_hessian(const Element& e, const FieldAtPoint& field, bool varies, SimdMat3 h[21]) const {
        SimdMat3 by_corner[6];
        magnetic_face_fine::hessian(frame_, e, over_face(field, varies), by_corner);
        for (int l = 0; l < 6; ++l) {
            SimdDouble weights[3];
            of_corners(l, weights);
            SimdMat3 rows[3];  // d2E/dc_a dx_l
            for (int a = 0; a < 3; ++a) {
                rows[a] = weights[0] * block(by_corner, a, 0);
                for (int b = 1; b < 3; ++b) rows[a] += weights[b] * block(by_corner, a, b);
            }
            for (int k = l; k < 6; ++k) {
                SimdDouble of_node[3];
                of_corners(k, of_node);
                for (int a = 0; a < 3; ++a) h[lower_index(k, l)] += of_node[a] * rows[a];
            }
        }
    }

  private:
    static SimdVec3 sum(const SimdDouble weights[6], const SimdVec3 x[6]) {
        SimdVec3 all = weights[0] * x[0];
        for (int k = 1; k < 6; ++k) all += weights[k] * x[k];
        return all;
    }
    static Law of(const SimdVec3 x[6], const PointOverSix& place, const Element& e) {
        const SimdVec3 corners[3] = {
            {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)}, sum(place.first, x), sum(place.second, x)};
        return Law(corners, e);
    }
    static SimdMat3 block(const SimdMat3 by_corner[6], int a, int b) {
        return a >= b ? by_corner[lower_index(a, b)] : transpose(by_corner[lower_index(b, a)]);
    }
    void of_corners(int k, SimdDouble weights[3]) const {
        weights[0] = point_.shapes[k];
        weights[1] = point_.shapes[k] + point_.first[k];
        weights[2] = point_.shapes[k] + point_.second[k];
    }
    FieldOverFace over_face(const FieldAtPoint& field, bool varies) const {
        FieldOverFace all{};
        all.flux = field.flux;
        if (!varies) return all;
        const SimdDouble& z = point_.height;
        all.gradient[0] = field.gradient;
        all.gradient[3] = z * field.gradient;
        all.curvature[lower_index(0, 0)] = field.curvature;
        all.curvature[lower_index(3, 0)] = z * field.curvature;
        all.curvature[lower_index(3, 3)] = (z * z) * field.curvature;
        return all;
    }

    const PointOverSix& point_;
    const SimdVec3* x_;
    const Law frame_;
};

}  // namespace magshell
