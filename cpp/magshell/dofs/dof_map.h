// The map between all dofs of a scene and its free ones, which solvers work with. Supports prescribe nodes along some directions and may
// move them as rigid bodies. Reduced coordinates replace the nodes of rigid bodies and skeletons; they are the last of the free dofs.
//
// A node that is prescribed along directions other than x, y, z is rotated into a frame of its own, in which it is prescribed along the
// first one or two axes. Nodes without supports cost nothing here.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "magshell/assembly/system_matrix.h"
#include "magshell/body/nodes.h"
#include "magshell/core/parameters.h"
#include "magshell/dofs/support_move.h"
#include "magshell/linalg/factor.h"

namespace magshell {

class ReducedAssembly;
class ReducedCoordinates;
class RigidNodes;
using ReducedCoordinatesList = std::vector<std::unique_ptr<ReducedCoordinates>>;

/// A node and the orthonormal directions along which it is prescribed, the first n_prescribed columns of `frame`; each direction follows
/// the move of one support, or stays if that is -1.
struct PrescribedNode {
    Index node;
    int n_prescribed;
    Mat3 frame;
    std::array<Index, 3> moves = {-1, -1, -1};
};

class DofMap {
  public:
    /// moves: number of support moves that `prescribed` refers to. The nodes must outlive the map. No node may be both prescribed and
    /// reduced.
    DofMap(const SystemMatrix& matrix, std::vector<PrescribedNode> prescribed, const Nodes& nodes,
           Index moves, Registry& registry, ReducedCoordinatesList reduced);
    ~DofMap();
    DofMap(const DofMap&) = delete;
    DofMap& operator=(const DofMap&) = delete;

    void set_values(const Values& values);
    /// Returns true if supports or motors can move.
    bool has_prescribed_motion() const { return !moves_.empty() || has_motors(); }
    /// Returns true if motors prescribe coordinates of skeletons.
    bool has_motors() const;
    /// Returns true if vjp adds gradients with respect to parameters: of support moves, motors or joints.
    bool has_values() const;

    /// The free dofs that are not reduced coordinates, ascending; they come first in the reduced order. Those of a rotated node count
    /// along its frame.
    const std::vector<Index>& free_dofs() const { return free_dofs_; }
    bool is_rotated(Index node) const { return !frame_of_.empty() && frame_of_[node] >= 0; }

    /// Returns the amplitude of the prescribed support moves: 0 at rest, 1 at their end.
    double support_factor(const LoadParameters& load_parameters) const {
        return load_parameters[support_factor_.first];
    }

    Index size() const { return pattern_->size; }
    const std::shared_ptr<const SparsePattern>& pattern() const { return pattern_; }
    /// Sets the matrix to the sum of `matrix` and `layer`, which may couple other nodes. The last patterns with and without a layer are
    /// reused as the same objects if they are unchanged.
    void set_pattern(const SystemMatrix& matrix, const SystemMatrix* layer);

    /// Returns the increment of all dofs to the targets of supports and motors; zero elsewhere.
    VectorXd prescribed_increment(const VectorXd& q, const LoadParameters& load_parameters) const;

    /// Returns d(prescribed positions of supports)/d(support factor).
    VectorXd prescribed_rate(const LoadParameters& load_parameters) const;

    /// Adds the gradients with respect to the support moves, the support factor, motors and joint parameters. by_state: gradient with
    /// respect to the prescribed positions. lambda: adjoint. gradient: of the energy, with inertia in a motion. by_motor_forces: gradient
    /// with respect to the motor forces, empty if none; by_state includes its contribution through the state.
    void vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
             const LoadParameters& load_parameters, Gradient& out,
             const VectorXd& by_motor_forces = {}) const;
    /// Adds the gradient with respect to the rest positions of nodes that ties of displacements or rigid bodies move, three numbers per
    /// node; arguments as in vjp.
    void rest_vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                  const VectorXd& by_motor_forces, VectorXd& by_nodes) const;
    /// Adds the gradient with respect to the rest positions and directions of nodes that supports hold, three numbers per node. by_state:
    /// gradient with respect to where they hold them.
    void held_rest_vjp(const VectorXd& by_state, const LoadParameters& load_parameters,
                       VectorXd& by_nodes) const;
    /// Adds to the forces K p of a prescribed increment those due to the curved paths of motor-driven nodes.
    void add_motor_increment_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const;
    /// Returns the forces [N] and moments [N m] of the motors, one after another, for a gradient of the energy.
    VectorXd motor_forces(const VectorXd& gradient) const;

    /// Returns the motion of all nodes whose power under motor_forces is the weighted sum by_motor_forces; and adds the derivative of this
    /// power as forces on the free dofs. Both at the state linearized last.
    VectorXd motor_motion(const VectorXd& by_motor_forces) const;
    void add_motor_force_change(const VectorXd& gradient, const VectorXd& by_motor_forces,
                                VectorXd& forces) const;

    /// Returns true if there are supports.
    bool has_supports() const { return !prescribed_.empty(); }
    /// Returns the part of a vector of all dofs along the prescribed directions, three numbers per prescribed node in the order given.
    VectorXd along_supports(const VectorXd& full) const;

    /// Returns true if the block [axis]x, the matrix of a cross product, between two nodes acts on their free motions.
    bool acts_on_free_motion(Index a, Index b, const Vec3& axis) const;

    /// Returns the largest total rotation of a support [rad].
    double largest_rotation() const;

    /// Returns true if there are rigid bodies or skeletons. All of the following is linear at the state linearized last.
    bool has_reduced_coordinates() const { return reduced_ != nullptr; }
    /// Returns the rigid bodies that no joint holds.
    std::vector<const RigidNodes*> free_bodies() const;
    void linearize(const VectorXd& q);

    /// Computes the free rows and columns in the order of pattern(). Rotates the blocks of rotated nodes in place first. `layer`: as in
    /// set_pattern.
    void matrix(SystemMatrix& full, SystemMatrix* layer, LargeVector<double>& values) const;
    /// Adds a diagonal of all dofs that is the same along the three axes of a node, such as masses or areas.
    void add_weights(const VectorXd& full, LargeVector<double>& values) const;
    /// Adds the curvature term of reduced coordinates for a gradient of all dofs; computes its product with a reduced vector.
    void add_curvature(const VectorXd& gradient, LargeVector<double>& values) const;
    void add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const;
    /// Returns the free part of a vector of all dofs, B^T f for reduced coordinates.
    VectorXd vector(const VectorXd& full) const;
    /// Returns the diagonal of the matrix that add_weights adds.
    VectorXd weights(const VectorXd& full) const;
    /// Projects a vector of all dofs onto the motions of the free dofs.
    VectorXd project(const VectorXd& full) const;
    /// Returns the acceleration of all dofs under forces [N] alone, for masses [kg] of all dofs, which are the same along the three
    /// axes of a node: J (J^T M J)^-1 J^T f with the motions J of the free dofs. Zero where prescribed or without mass.
    VectorXd acceleration(const VectorXd& mass, const VectorXd& force) const;
    /// Adds forces f with B^T f = sum_i g_i d2x_i/dz2 z for a motion of all nodes with free coordinates z: the change of B^T g because B
    /// changes.
    void add_curvature_forces(const VectorXd& gradient, const VectorXd& motion, VectorXd& forces) const;
    /// Moves a state by p, a vector of all dofs; reduced nodes move along their coordinates.
    void retract(VectorXd& q, const VectorXd& p) const;
    /// See ReducedCoordinates; empty without reduced coordinates.
    VectorXd rounding(const VectorXd& q) const;
    /// See ReducedCoordinates: make a start consistent, and the adjoint of that.
    void project_state(VectorXd& q, VectorXd* v) const;
    void project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                           Gradient& out, VectorXd* by_rest) const;
    /// Selects from points of all dofs those of the free ones.
    std::vector<Vec3> free(const std::vector<Vec3>& full) const;
    /// Returns a vector of all dofs from a free one: zero where prescribed, B z for reduced coordinates.
    VectorXd expand(const VectorXd& reduced) const;

    std::size_t bytes() const;

  private:
    /// Returns the sum over the prescribed directions d of a node of d (d . vector_of(move)).
    template <class VectorOf>
    static Vec3 prescribed_part(const PrescribedNode& h, const VectorOf& vector_of) {
        Vec3 part = Vec3::Zero();
        for (int axis = 0; axis < h.n_prescribed; ++axis)
            part += h.frame.col(axis) * h.frame.col(axis).dot(vector_of(h.moves[axis]));
        return part;
    }
    /// Returns the position of a node that follows a move; with -1 its rest position.
    Vec3 position(Index node, Index move, double support_factor) const;
    /// Returns the derivative of that position by the support factor.
    Vec3 rate(Index node, Index move, double support_factor) const;
    /// Returns the projection of a node's motions onto its free directions.
    Mat3 free_motions(Index node) const;
    bool axis_aligned(const PrescribedNode& h) const;
    void rotate_blocks(SystemMatrix& full) const;
    VectorXd gathered(const VectorXd& full) const;
    static VectorXd rest_state(const Nodes& nodes);

    std::vector<PrescribedNode> prescribed_;
    const Nodes& nodes_;
    struct MoveSlices {
        ParameterSlice center, rotation, displacement;
    };
    std::vector<MoveSlices> slices_;
    std::vector<SupportMove> moves_;
    ParameterSlice support_factor_;
    Index full_size_;
    // Per node: its index in prescribed_ if it is rotated, else -1; empty if no node is.
    std::vector<Index> frame_of_;
    std::vector<Index> prescribed_at_;  // per node: its index in prescribed_, else -1
    std::vector<Index> free_dofs_;      // reduced -> full, ascending
    // The current pattern, and the last ones without and with a layer.
    std::shared_ptr<const SparsePattern> pattern_, without_layer_, with_layer_;
    // The free entries of the full matrix, as contiguous pieces: supports remove few entries.
    struct Pieces {
        struct Piece {
            Index from, to, count;
        };
        std::vector<Piece> all;

        void add(Index from, Index to);
    };
    Pieces pieces_, layer_pieces_;
    std::unique_ptr<ReducedAssembly> reduced_;  // nullptr without rigid bodies and skeletons
};

}  // namespace magshell
