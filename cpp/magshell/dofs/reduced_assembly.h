// Assembly in reduced coordinates: computes B^T H B, with its curvature terms, and transforms vectors, for all rigid bodies and skeletons.
//
// Their generalized coordinates are the last of the free dofs, one body or skeleton after another. A scene without any does not use this.
// It holds the ties of displacements as well, which reduce single dofs and have no coordinates here.
#pragma once

#include <Eigen/Cholesky>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "magshell/assembly/system_matrix.h"
#include "magshell/dofs/linear_ties.h"
#include "magshell/dofs/link_coupling.h"
#include "magshell/dofs/reduced_coordinates.h"
#include "magshell/linalg/factor.h"

namespace magshell {

using ReducedCoordinatesList = std::vector<std::unique_ptr<ReducedCoordinates>>;  // as in dof_map.h

class ReducedAssembly {
  public:
    ReducedAssembly(ReducedCoordinatesList maps, const SystemMatrix& matrix);

    Index coordinates() const { return coordinates_; }
    /// Returns true if a dof belongs to a node with reduced coordinates, or is tied.
    bool is_reduced(Index dof) const { return system_of_[dof] >= 0 || (ties_ && ties_->is_tied(dof)); }
    /// Returns the ties of displacements, null if there are none.
    LinearTies* ties() const { return ties_.get(); }

    /// Build the reduced pattern, called in this order. The matrix is the sum of `matrices`. reduced: index of each dof among the
    /// free ones, negative if it is prescribed or reduced; free: number of the free ones.
    void collect_couplings(const std::vector<const SystemMatrix*>& matrices,
                           const std::vector<Index>& reduced, Index free);
    void append_rows(Index free, std::vector<Index>& rows) const;
    void append_columns(SparsePattern& pattern) const;
    void find_entries(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                      const SparsePattern& pattern);

    /// Sets B to the Jacobian at q.
    void linearize(const VectorXd& q);

    /// Add B^T H B of one of the matrices; B^T w B of a diagonal matrix; the curvature sum_i g_i d2x_i/dz2 for a gradient g, and its
    /// product with a reduced vector.
    void add_matrix(std::size_t which, const SystemMatrix& full, double* values) const;
    void add_weights(const VectorXd& weights, double* values) const;
    void add_curvature(const VectorXd& gradient, double* values) const;
    void add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const;

    /// Motors prescribe some of the coordinates, which are not among the free dofs then. Returns true if there are motors.
    bool has_motors() const { return has_motors_; }
    /// Returns the rigid bodies that no joint holds.
    std::vector<const RigidNodes*> free_bodies() const;
    /// Returns true if the origins and axes of joints are parameters.
    bool has_joint_parameters() const { return has_joint_parameters_; }
    void set_values(const Values& values);
    /// Adds the displacement of the nodes that brings the coordinates of motors to their targets.
    void add_motor_increment(const VectorXd& q, VectorXd& increment) const;
    /// Adds the forces due to the curved paths of motor-driven nodes, for a prescribed motion `move` under a gradient.
    void add_motor_increment_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const;
    /// Adds the gradients with respect to the parameters of motors and joints, given the gradient with respect to all nodes, by_state, and
    /// by the motor forces, at an adjoint lambda of all dofs under a gradient g of the energy.
    void vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
             const VectorXd& by_motor_forces, Gradient& out) const;
    /// Adds the gradient with respect to rest positions of vertices that are carried along, three numbers per node; arguments as in vjp.
    void rest_vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                  const VectorXd& by_motor_forces, VectorXd& by_nodes) const;
    /// Returns the forces [N] and moments [N m] of the motors for a gradient of the energy.
    VectorXd motor_forces(const VectorXd& gradient) const;
    /// Returns the motion B z of all nodes along the motors at which the power of motor_forces(g) is the weighted sum `by_motor_forces`.
    VectorXd motor_motion(const VectorXd& by_motor_forces) const;
    /// Adds forces f such that B^T f is the derivative of that power along the free coordinates, at constant g.
    void add_motor_force_change(const VectorXd& gradient, const VectorXd& by_motor_forces,
                                VectorXd& forces) const;

    /// Compute the entries of a reduced vector for the coordinates: B^T f, and the diagonal of B^T w B.
    void pull_back(const VectorXd& full, VectorXd& reduced) const;
    void diagonal(const VectorXd& weights, VectorXd& reduced) const;
    /// Computes B z on the reduced nodes.
    void push_forward(const VectorXd& reduced, VectorXd& full) const;
    /// Projects the reduced nodes' part of a vector of all dofs onto the motions B z.
    void project(VectorXd& full) const;
    /// Copies the rows of the reduced nodes from one vector of all dofs to another.
    void replace(const VectorXd& from, VectorXd& to) const;

    /// Writes into the rows of the reduced nodes the motion B z whose generalized inertia B^T M B z balances B^T f, for masses [kg] and
    /// forces [N] of all dofs; motors stay.
    void accelerate(const VectorXd& mass, const VectorXd& force, VectorXd& full) const;
    /// Adds forces f on the nodes with B^T f = sum_i g_i d2x_i/dz2 z, for the free coordinates z of a motion of all nodes.
    void add_curvature_forces(const VectorXd& gradient, const VectorXd& motion, VectorXd& forces) const;

    /// Moves q by p; reduced nodes follow the motion along their coordinates that is nearest to p (retraction).
    void retract(VectorXd& q, const VectorXd& p) const;
    /// See ReducedCoordinates; of all dofs, zero for nodes that are not reduced.
    VectorXd rounding(const VectorXd& q) const;
    void project_state(VectorXd& q, VectorXd* v) const;
    void project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                           Gradient& out, VectorXd* by_rest) const;

    /// Appends a point for each coordinate: the mean of the nodes that it moves.
    void append_points(const std::vector<Vec3>& full, std::vector<Vec3>& points) const;

    std::size_t bytes() const;

  private:
    struct Entries {                           // positions in one of the matrices
        LinkCoupling mixed, inner;             // entries with free dofs, and within this system
        std::map<Index, LinkCoupling> across;  // by later system: entries with it
    };
    struct System {                               // a rigid body or a skeleton
        std::unique_ptr<ReducedCoordinates> map;  // from its coordinates to its nodes
        Index first = 0;                          // index of its first coordinate among those of all systems
        LinkTwists twists;                        // B
        // of B^T B of the free coordinates, computed on demand
        mutable std::optional<Eigen::LDLT<Eigen::MatrixXd>> normal;
        std::vector<Entries> entries;
        std::set<Index> later;  // later systems that it is coupled with
        // Where the rows of this system, and of each later one, begin in its columns of the pattern.
        std::vector<Index> own;
        std::map<Index, std::vector<Index>> across_rows;
    };

    void find_entries(std::size_t which, const SystemMatrix& matrix, const std::vector<Index>& reduced,
                      const SparsePattern& pattern);
    /// Return the free coordinates and those of the motors of the motion B z nearest to a motion of all nodes; and the factorization of
    /// B^T B for the free coordinates.
    VectorXd free_part(const System& system, const VectorXd& full) const;
    VectorXd motor_part(const System& system, const VectorXd& full) const;
    static const Eigen::LDLT<Eigen::MatrixXd>& normal_matrix(const System& system);
    /// Return the part of B^T rows for the motors, and for the free coordinates.
    static VectorXd pull_back_motors(const System& system, const VectorXd& rows);
    static VectorXd pull_back_free(const System& system, const VectorXd& rows);
    /// Adds forces f on the nodes with B^T f equal to these generalized forces on the free coordinates.
    void add_nodal_forces(const System& system, const VectorXd& by_coordinates, VectorXd& forces) const;
    /// Returns the coordinate rates [m] of the motors of a system, from numbers for all motors in their own units; moves `first` to the
    /// next system.
    static VectorXd motor_rates(const System& system, const VectorXd& all, Index& first);
    /// Returns the rates of all coordinates of a system in the motion lambda, those of motors from the gradient with respect to their
    /// forces. `first` as in motor_rates.
    VectorXd adjoint_rates(const System& system, const VectorXd& lambda, const VectorXd& by_motor_forces,
                           Index& first) const;
    /// Adds the lower half of a block of the matrix for the coordinates of one system.
    void add_lower(const System& system, const Eigen::MatrixXd& block, double* values) const;

    std::vector<System> systems_;
    std::unique_ptr<LinearTies> ties_;
    Index coordinates_ = 0;  // of all systems, without those of motors
    Index n_free_ = 0;       // number of free dofs before them
    bool has_motors_ = false, has_joint_parameters_ = false;
    VectorXd state_;                            // the state q of the linearization
    std::vector<Index> system_of_, row_of_;     // by dof: its system, and its row of B
    std::map<Index, std::set<Index>> coupled_;  // by free dof: the systems that it is coupled with
};

}  // namespace magshell
