// DihedralAngleSix: the dihedral angle between two quadratic triangles at the two Gauss points of their common
// edge.
//
// At a point of the edge, the tangent t along it and, in each face, the derivative u towards the opposite
// corner span the tangent planes. All three are linear in the nine nodes
//
//   0, 1, 2            the edge: from, to, middle
//   3, 4, 5; 6, 7, 8   left and right face: opposite corner, middle between `to` and it, middle between it and `from`
//
// so the angle is that of strain/dihedral_angle.h about the edge (0, t) with the half-planes of u_left and
// u_right. A given direction across the edge, in place of the right face, is node 6 alone.
#pragma once

#include "magshell/energy/symmetric3.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/strain/relative_to_first_node.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

class DihedralAngleSix {
  public:
    DihedralAngleSix(const SimdVec3 x[9], const SimdDouble& right_is_face, int point)
        : point_(point), right_is_face_(right_is_face), dihedral_(angle_of(x, right_is_face, point)) {}

    SimdDouble angle() const { return dihedral_.angle(); }

    void gradient(SimdVec3 g[9]) const {
        SimdVec3 by[4];
        dihedral_.gradient(by);
        for (int a = 0; a < 3; ++a)
            g[a] = SimdDouble(tangent(a)) * by[1] +
                   SimdDouble(inward_weight(a)) * (by[2] + right_is_face_ * by[3]);
        for (int a = 3; a < 6; ++a) {
            g[a] = SimdDouble(inward_weight(a)) * by[2];
            g[a + 3] = right(a) * by[3];
        }
    }

    /// The gradient split into the two sides, if the right side is a face. A side rotates about the edge by
    /// along . sum_a weight_a x_a, with its own nodes 0, 1, 2 and 3, 4, 5 (left) or 6, 7, 8 (right). The sum of
    /// both sides is the gradient.
    struct Side {
        SimdVec3 along;
        SimdDouble foot;
    };
    std::array<Side, 2> sides() const {
        return {{{dihedral_.left.by_point(), dihedral_.left.foot},
                 {-dihedral_.right.by_point(), dihedral_.right.foot}}};
    }
    /// Returns the weight of a node in the rotation of its side. place: position among the six nodes of the
    /// side.
    static double side_weight(int point, int place, double foot) {
        return inward_weights_[point][place] - (place < 3 ? foot * tangents_[point][place] : 0.0);
    }

    /// Adds moment d2theta as lower blocks of the nine nodes at lower_index.
    void add_curvature(const SimdDouble& moment, SimdMat3 h[45]) const {
        const DihedralHessian c(dihedral_, moment);
        const SimdMat3 &tt = c.block[DihedralHessian::B11], &lt = c.block[DihedralHessian::B21],
                       &rt = c.block[DihedralHessian::B31], &ll = c.block[DihedralHessian::B22],
                       &rr = c.block[DihedralHessian::B33];
        // Blocks of the edge's nodes, which enter through t, and through u on both sides alike.
        const SimdMat3 both_t = lt + right_is_face_ * rt, both = ll + right_is_face_ * rr,
                       t_both = transpose(both_t);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b <= a; ++b) {
                SimdMat3& into = h[lower_index(a, b)];
                into += SimdDouble(tangent(a) * tangent(b)) * tt;
                into += SimdDouble(inward_weight(a) * tangent(b)) * both_t;
                into += SimdDouble(tangent(a) * inward_weight(b)) * t_both;
                into += SimdDouble(inward_weight(a) * inward_weight(b)) * both;
            }
        for (int a = 3; a < 6; ++a)
            for (int b = 0; b < 3; ++b) {
                SimdMat3 &left = h[lower_index(a, b)], &opposite = h[lower_index(a + 3, b)];
                left += SimdDouble(inward_weight(a) * tangent(b)) * lt;
                left += SimdDouble(inward_weight(a) * inward_weight(b)) * ll;
                opposite += (SimdDouble(tangent(b)) * right(a)) * rt;
                opposite += (SimdDouble(inward_weight(b)) * right(a) * right_is_face_) * rr;
            }
        for (int a = 3; a < 6; ++a)
            for (int b = 3; b <= a; ++b) {
                h[lower_index(a, b)] += SimdDouble(inward_weight(a) * inward_weight(b)) * ll;
                h[lower_index(a + 3, b + 3)] += (right(a) * right(b)) * rr;
            }
    }

  private:
    static constexpr std::array<std::array<double, 3>, 2> tangents_ = {six_nodes::along(six_nodes::gauss[0]),
                                                                       six_nodes::along(six_nodes::gauss[1])};
    static constexpr std::array<std::array<double, 6>, 2> inward_weights_ = {
        six_nodes::inward(six_nodes::gauss[0]), six_nodes::inward(six_nodes::gauss[1])};
    double tangent(int a) const { return tangents_[point_][a]; }
    double inward_weight(int a) const { return inward_weights_[point_][a]; }
    /// Weight of node a + 3 in the right half-plane; a direction is the half-plane's vector itself.
    SimdDouble right(int a) const {
        const double alone = a == 3 ? 1.0 : 0.0;
        return SimdDouble(alone) + right_is_face_ * SimdDouble(inward_weight(a) - alone);
    }

    static DihedralAngle angle_of(const SimdVec3 places[9], const SimdDouble& right_is_face, int point) {
        const std::array<double, 3>& t = tangents_[point];
        const std::array<double, 6>& u = inward_weights_[point];
        std::array<SimdVec3, 9> x = relative_to_first_node<9>(places);
        x[6] = places[6] - right_is_face * places[0];  // a direction does not depend on the origin
        SimdVec3 tangent = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)}, shared = tangent;
        for (int a = 1; a < 3; ++a) {
            tangent += SimdDouble(t[a]) * x[a];
            shared += SimdDouble(u[a]) * x[a];
        }
        SimdVec3 left = shared, right = right_is_face * shared;
        for (int a = 3; a < 6; ++a) {
            const double alone = a == 3 ? 1.0 : 0.0;
            left += SimdDouble(u[a]) * x[a];
            right += (SimdDouble(alone) + right_is_face * SimdDouble(u[a] - alone)) * x[a + 3];
        }
        const SimdVec3 zero = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
        return DihedralAngle(zero, tangent, left, right, SimdDouble(0.0));
    }

    const int point_;
    const SimdDouble right_is_face_;
    const DihedralAngle dihedral_;
};

}  // namespace magshell
