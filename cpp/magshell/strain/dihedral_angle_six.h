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
// u_right. A fixed director in place of the right face is node 6 alone.
#pragma once

#include "magshell/energy/symmetric3.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/strain/relative_to_first_node.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

class DihedralAngleSix {
  public:
    DihedralAngleSix(const Pack3 x[9], const Pack& right_is_face, int point)
        : point_(point), right_is_face_(right_is_face), dihedral_(angle_of(x, right_is_face, point)) {}

    Pack angle() const { return dihedral_.angle(); }

    void gradient(Pack3 g[9]) const {
        Pack3 by[4];
        dihedral_.gradient(by);
        for (int a = 0; a < 3; ++a)
            g[a] = Pack(tangent(a)) * by[1] + Pack(inward_weight(a)) * (by[2] + right_is_face_ * by[3]);
        for (int a = 3; a < 6; ++a) {
            g[a] = Pack(inward_weight(a)) * by[2];
            g[a + 3] = right(a) * by[3];
        }
    }

    /// The gradient split into the two sides, if the right side is a face. A side rotates about the edge by
    /// along . sum_a weight_a x_a, with its own nodes 0, 1, 2 and 3, 4, 5 (left) or 6, 7, 8 (right). The sum of
    /// both sides is the gradient.
    struct Side {
        Pack3 along;
        Pack foot;
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
    void add_curvature(const Pack& moment, Pack33 h[45]) const {
        const DihedralHessian c(dihedral_, moment);
        const Pack33 &tt = c.block[DihedralHessian::B11], &lt = c.block[DihedralHessian::B21],
                     &rt = c.block[DihedralHessian::B31], &ll = c.block[DihedralHessian::B22],
                     &rr = c.block[DihedralHessian::B33];
        // Blocks of the edge's nodes, which enter through t, and through u on both sides alike.
        const Pack33 both_t = lt + right_is_face_ * rt, both = ll + right_is_face_ * rr,
                     t_both = transpose(both_t);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b <= a; ++b) {
                Pack33& into = h[lower_index(a, b)];
                into += Pack(tangent(a) * tangent(b)) * tt;
                into += Pack(inward_weight(a) * tangent(b)) * both_t;
                into += Pack(tangent(a) * inward_weight(b)) * t_both;
                into += Pack(inward_weight(a) * inward_weight(b)) * both;
            }
        for (int a = 3; a < 6; ++a)
            for (int b = 0; b < 3; ++b) {
                Pack33 &left = h[lower_index(a, b)], &opposite = h[lower_index(a + 3, b)];
                left += Pack(inward_weight(a) * tangent(b)) * lt;
                left += Pack(inward_weight(a) * inward_weight(b)) * ll;
                opposite += (Pack(tangent(b)) * right(a)) * rt;
                opposite += (Pack(inward_weight(b)) * right(a) * right_is_face_) * rr;
            }
        for (int a = 3; a < 6; ++a)
            for (int b = 3; b <= a; ++b) {
                h[lower_index(a, b)] += Pack(inward_weight(a) * inward_weight(b)) * ll;
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
    /// Weight of node a + 3 in the right half-plane; a director is the half-plane's vector itself.
    Pack right(int a) const {
        const double alone = a == 3 ? 1.0 : 0.0;
        return Pack(alone) + right_is_face_ * Pack(inward_weight(a) - alone);
    }

    static DihedralAngle angle_of(const Pack3 places[9], const Pack& right_is_face, int point) {
        const std::array<double, 3>& t = tangents_[point];
        const std::array<double, 6>& u = inward_weights_[point];
        std::array<Pack3, 9> x = relative_to_first_node<9>(places);
        x[6] = places[6] - right_is_face * places[0];  // a director does not depend on the origin
        Pack3 tangent = {Pack(0.0), Pack(0.0), Pack(0.0)}, shared = tangent;
        for (int a = 1; a < 3; ++a) {
            tangent += Pack(t[a]) * x[a];
            shared += Pack(u[a]) * x[a];
        }
        Pack3 left = shared, right = right_is_face * shared;
        for (int a = 3; a < 6; ++a) {
            const double alone = a == 3 ? 1.0 : 0.0;
            left += Pack(u[a]) * x[a];
            right += (Pack(alone) + right_is_face * Pack(u[a] - alone)) * x[a + 3];
        }
        const Pack3 zero = {Pack(0.0), Pack(0.0), Pack(0.0)};
        return DihedralAngle(zero, tangent, left, right, Pack(0.0));
    }

    const int point_;
    const Pack right_is_face_;
    const DihedralAngle dihedral_;
};

}  // namespace magshell
