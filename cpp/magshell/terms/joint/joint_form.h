// JointForm: a scalar coordinate of the relative pose of two links, computed from their corners
// (corner_form.h), with the derivatives that Newton's method needs.
//
//   s = sum y_p . y_c + a_p . (o_c - o_p),  or an angle s = arg(C + i S) with two such sums; see JointCoordinate
//
//   d2s/dx2 = pairs (x) I + cross (first other^T + other first^T),  first = ds/dx; for an angle other = d(log |C + i S|)/dx
#pragma once

#include "magshell/dofs/joint.h"
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
    /// Creates a coordinate of a joint. origin: that of the joint, in the reference configuration.
    JointForm(const JointCoordinate& coordinate, const Vec3& origin, const LinkPair& links);
    /// Creates a_p . b_c for two vectors given in the reference configuration, or the sum of such products over
    /// the columns of two matrices.
    static JointForm product(const LinkPair& links, const Vec3& of_parent, const Vec3& of_child);
    static JointForm product(const LinkPair& links, const Mat3& of_parent, const Mat3& of_child);

    bool angle() const { return angle_; }
    /// Returns the coordinate; an angle lies in [-pi, pi].
    double value(const Corners& at) const;
    /// Returns the coordinate; an angle is taken on the branch nearest to `near`, and a screw's on that of its displacement.
    double value(const Corners& at, double near) const;
    Local at(const Corners& at) const;

  private:
    bool angle_ = false, slides_ = false;
    CornerForm form_, sine_;  // for an angle: cosine and sine
    CornerForm slide_;        // of a screw: the displacement over the pitch
};

}  // namespace magshell
