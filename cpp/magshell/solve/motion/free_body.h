// Mass properties and momenta of rigid bodies that no joint holds.
//
// A body has the masses m of its points and of the vertices that belong to it. With their positions rho from the center of mass in the
// reference configuration, and their positions x and velocities v in a motion,
//
//   J  = sum m (|rho|^2 I - rho rho^T)                  inertia about the center of mass [kg m2]
//   c  = sum m x / sum m                                center of mass [m]
//   Pi = R^T sum m (x - c) cross (v - dc/dt)            angular momentum in the axes of the body, R: its rotation [kg m2/s]
#pragma once

#include <vector>

#include "magshell/core/types.h"
#include "magshell/dofs/dof_map.h"
#include "magshell/dofs/rigid_nodes.h"

namespace magshell {

/// The motion of a body: its center of mass with its velocity, its rotation, and its angular momentum in its own axes. Also gradients by
/// these.
struct RigidMotion {
    Vec3 center = Vec3::Zero(), velocity = Vec3::Zero();
    Mat3 turn = Mat3::Zero();
    Vec3 momentum = Vec3::Zero();
};

/// The gradient with respect to the arms rho of a body: by a displacement of all of them, and by each.
struct ArmsGradient {
    Vec3 together = Vec3::Zero();
    std::vector<Vec3> each;
};

class FreeBody {
  public:
    /// masses: of all dofs [kg]. The nodes must outlive it.
    FreeBody(const RigidNodes& nodes, const VectorXd& masses);

    /// Returns true if it has a mass and an inertia about every axis.
    bool has_inertia() const { return has_inertia_; }
    const std::vector<Index>& nodes() const { return nodes_->nodes(); }
    /// Returns rho of each node [m].
    const std::vector<Vec3>& arms() const { return arms_; }
    const Mat3& inverse_inertia() const { return inverse_inertia_; }

    RigidMotion motion(const VectorXd& q, const VectorXd& v) const;
    /// Sets its rows of q to the rigid body nearest to those of `predicted`.
    void make_rigid(const VectorXd& predicted, VectorXd& q) const {
        nodes_->set_positions(nodes_->pose(predicted), q);
    }
    /// Adds the gradients with respect to positions, velocities and masses of all dofs. motion: what motion(q, v) returned; by: the
    /// gradients with respect to it.
    void motion_vjp(const RigidMotion& motion, const VectorXd& q, const VectorXd& v, const RigidMotion& by,
                    VectorXd& by_q, VectorXd& by_v, VectorXd& by_masses) const;
    /// Adds the gradients with respect to the masses of all dofs, given those with respect to the inverse inertia and to a displacement of
    /// all arms.
    void inertia_vjp(const Mat3& by_inverse_inertia, const Vec3& by_arms, VectorXd& by_masses) const;
    /// Adds the gradient with respect to the rest positions of the vertices that belong to it, three numbers per node, given those with
    /// respect to the inverse inertia and to the arms.
    void rest_vjp(const Mat3& by_inverse_inertia, const ArmsGradient& by_arms, VectorXd& by_nodes) const;
    /// Adds a matrix times rho to the rows of its nodes.
    void add(const Mat3& matrix, VectorXd& rows) const {
        for (std::size_t k = 0; k < arms_.size(); ++k) rows.segment<3>(3 * nodes()[k]) += matrix * arms_[k];
    }
    /// Returns the gradient with respect to that matrix, given the one with respect to the rows. Adds that with respect to the arms.
    Mat3 add_vjp(const Mat3& matrix, const VectorXd& by_rows, ArmsGradient& by_arms) const;

  private:
    Mat3 by_inertia(const Mat3& by_inverse_inertia) const {
        return -inverse_inertia_ * by_inverse_inertia * inverse_inertia_;
    }

    const RigidNodes* nodes_;
    std::vector<double> masses_;  // of its nodes [kg]
    std::vector<Vec3> arms_;
    double mass_ = 0.0;  // [kg]
    Mat3 inverse_inertia_ = Mat3::Zero();
    bool has_inertia_ = false;
};

/// Returns the bodies that no joint holds and that have an inertia about every axis.
std::vector<FreeBody> free_bodies(const DofMap& dof_map, const VectorXd& masses);

}  // namespace magshell
