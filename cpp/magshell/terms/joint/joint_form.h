// JointForm: a scalar coordinate of the relative pose of two links, computed from their corners
// (corner_form.h), with the derivatives that Newton's method needs.
//
//   revolute   s = arg(C + i S),  C = u_p . u_c + v_p . v_c,  S = v_p . u_c - u_p . v_c      u, v perpendicular to the axis
//   prismatic  s = a_p . (o_c - o_p)
//   ball       s = sum e_p . e_c = 1 + 2 cos(angle);  or one product of the rotation, a_p . b_c
//
//   d2s/dx2 = pairs (x) I + cross (first other^T + other first^T),  first = ds/dx; for an angle other = d(log |C + i S|)/dx
#pragma once

#include "magshell/body/joint.h"
#include "magshell/terms/joint/corner_form.h"

namespace magshell {

class JointForm {
  public:
    using Corners = CornerForm::Corners;
    struct Local {
        double value;
        Corners first, other = Corners::Zero();
        Eigen::Matrix<double, 8, 8> pairs;
        double cross = 0.0;

        /// Returns d2s/dx2 times a motion of the corners.
        Corners second(const Corners& along) const {
            Corners product = along * pairs;
            if (cross != 0.0)
                product += cross * (other.cwiseProduct(along).sum() * first +
                                    first.cwiseProduct(along).sum() * other);
            return product;
        }
    };

    JointForm() = default;
    /// Creates the coordinate of a joint.
    JointForm(const Joint& joint, const LinkPair& links);
    /// Creates a_p . b_c for two vectors given in the reference configuration, or the sum of such products over
    /// the columns of two matrices.
    static JointForm product(const LinkPair& links, const Vec3& of_parent, const Vec3& of_child);
    static JointForm product(const LinkPair& links, const Mat3& of_parent, const Mat3& of_child);

    bool angle() const { return angle_; }
    /// Returns the coordinate; an angle lies in [-pi, pi].
    double value(const Corners& at) const;
    /// Returns the coordinate; an angle is taken on the branch nearest to `near`.
    double value(const Corners& at, double near) const;
    Local at(const Corners& at) const;

  private:
    bool angle_ = false;
    CornerForm form_, sine_;  // for an angle: cosine and sine
};

}  // namespace magshell
