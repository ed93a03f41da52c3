// A point of a quadratic triangle at rest: the flat triangle (0, a~_1, a~_2) of its tangents, and gradients with respect to the nodes from
// those with respect to it.
#pragma once

#include "magshell/energy/rest_corners.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

class RestPointSix {
  public:
    RestPointSix(const std::array<Vec3, 6>& rest, const std::array<double, 3>& at)
        : first_(six_nodes::derivative(2, at)), second_(six_nodes::derivative(1, at)), corners_(of(rest)) {}

    /// Returns the corners of the triangle of its tangents: edge i of it is dx/dt_i.
    const std::array<Vec3, 3>& corners() const { return corners_; }

    /// Adds to `out` the gradient with respect to the nodes, for gradients with respect to a~_1 and a~_2.
    void add_by_edges(const std::array<Vec3, 2>& by, const std::array<Index, 6>& nodes, VectorXd& out) const {
        for (int a = 0; a < 6; ++a) out.segment<3>(3 * nodes[a]) += first_[a] * by[0] - second_[a] * by[1];
    }
    /// Adds that for a derivative with respect to a homogeneous deformation of the triangle in its plane, as in rest_corners.h.
    void add_by_deformation(const Mat3& by, const std::array<Index, 6>& nodes, VectorXd& out) const {
        const RestShape shape(corners_);
        add_by_edges({by * shape.gradients[1], by * shape.gradients[2]}, nodes, out);
    }

  private:
    std::array<Vec3, 3> of(const std::array<Vec3, 6>& rest) const {
        std::array<Vec3, 3> corners = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
        for (int a = 0; a < 6; ++a) {
            const Vec3 place = rest[a] - rest[0];
            corners[1] += first_[a] * place;
            corners[2] -= second_[a] * place;
        }
        return corners;
    }

    std::array<double, 6> first_, second_;
    std::array<Vec3, 3> corners_;
};

}  // namespace magshell
