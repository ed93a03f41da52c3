// Nodes whose positions are functions of a few generalized coordinates z: those of a rigid body or of a skeleton.
//
//   x = P(z),  B = dx/dz        gradient B^T g,  Hessian B^T H B + sum_i g_i d2x_i/dz2,  adjoint of the nodes B lambda_z
//
// The coordinates are counted from the current state: each iterate is a new origin, so that derivatives are needed at z = 0 only, and the
// positions of the nodes are the only state. All coordinates are lengths [m].
#pragma once

#include <utility>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/core/types.h"
#include "magshell/dofs/link_twists.h"

namespace magshell {

class RigidNodes;

class ReducedCoordinates {
  public:
    explicit ReducedCoordinates(std::vector<Index> nodes) : nodes_(std::move(nodes)) {}
    virtual ~ReducedCoordinates() = default;

    const std::vector<Index>& nodes() const { return nodes_; }
    /// Returns the number of free coordinates. n_motor_coordinates() more, the last of all, are prescribed by motors.
    virtual Index coordinates() const = 0;
    virtual Index n_motor_coordinates() const { return 0; }

    /// Returns B at q: a row per component of its nodes, a column per coordinate, including those of motors; as twists of the links.
    virtual LinkTwists twists(const VectorXd& q) const = 0;
    /// Returns B at q as a matrix.
    Eigen::MatrixXd jacobian(const VectorXd& q) const { return twists(q).matrix(); }

    /// Returns sum_i g_i d2x_i/dz2 at q for a gradient of all dofs, symmetric, of all coordinates.
    virtual Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const = 0;

    /// Sets the targets of motors and the joint parameters.
    virtual void set_values(const Values&) {}
    /// Returns the increments of the motor coordinates to their targets, zero within round-off [m].
    virtual VectorXd motor_increment(const VectorXd& /*q*/) const { return {}; }
    /// Returns the motor coordinates per unit of their parameters [m per rad or m].
    virtual VectorXd motor_units() const { return {}; }
    /// Adds the gradients with respect to the motor parameters, given those with respect to the motor coordinates.
    virtual void motor_vjp(const VectorXd& /*q*/, const VectorXd& /*by_motors*/, Gradient& /*out*/) const {}
    /// Returns the derivative of sum g . B z along all coordinates, for rates z of the motors alone, at constant g.
    virtual VectorXd motor_force_change(const VectorXd& /*q*/, const VectorXd& /*gradient*/,
                                        const VectorXd& /*motor_rates*/) const {
        return {};
    }

    /// Returns true if the origins and axes of its joints are parameters.
    virtual bool has_joint_parameters() const { return false; }
    /// Adds gradients with respect to the joint parameters at q: of a function whose gradient with respect to all nodes is by_state, and of
    /// sum g . B z for rates z of all coordinates and a gradient g.
    virtual void joint_parameters_vjp(const VectorXd& /*q*/, const VectorXd& /*by_state*/,
                                      const VectorXd& /*z*/, const VectorXd& /*gradient*/,
                                      Gradient& /*out*/) const {}

    /// Adds to `by_nodes`, three numbers per node, the gradient of the same by the rest positions of vertices that are carried along.
    virtual void rest_vjp(const VectorXd& /*q*/, const VectorXd& /*by_state*/, const VectorXd& /*z*/,
                          const VectorXd& /*gradient*/, VectorXd& /*by_nodes*/) const {}

    /// Returns the rigid bodies that no joint holds.
    virtual std::vector<const RigidNodes*> free_bodies() const { return {}; }

    /// Moves its nodes in q along z, which has all coordinates.
    virtual void retract(VectorXd& q, const VectorXd& z) const = 0;

    /// Makes a given start consistent: sets the nodes of its own from the vertices, and removes the round-off by which the vertices violate
    /// rigidity and joints. Given the velocities v of the vertices, sets those of all of its nodes.
    virtual void project_state(VectorXd& q, VectorXd* v) const = 0;

    /// Transforms gradients with respect to the result of project_state, at q after it, to those with respect to its arguments and by
    /// parameters; v and by_v may be empty. by_rest: the gradient with respect to rest positions, as in rest_vjp; nullptr if it is not
    /// asked for.
    virtual void project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                                   Gradient& out, VectorXd* by_rest) const = 0;

    /// Returns the displacement of each node at q due to round-off of the coordinates that are computed from nodes [m], over the machine
    /// epsilon. With long arms it exceeds the round-off of the nodes' own coordinates.
    virtual VectorXd rounding(const VectorXd& q) const = 0;

    /// Extract its rows from a vector of all dofs, and put them back.
    VectorXd gather(const VectorXd& full) const {
        VectorXd own(3 * nodes_.size());
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            own.segment<3>(3 * k) = full.segment<3>(3 * nodes_[k]);
        return own;
    }
    void scatter(const VectorXd& own, VectorXd& full) const {
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            full.segment<3>(3 * nodes_[k]) = own.segment<3>(3 * k);
    }

  private:
    std::vector<Index> nodes_;
};

}  // namespace magshell
