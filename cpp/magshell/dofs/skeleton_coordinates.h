// Reduced coordinates of rigid links in a tree of joints.                                    [Qiao21] 4, Algorithm 2
//
// Each joint connects a link to its parent and has one to six coordinates, or none if it is fixed. A coordinate moves the nodes of its link
// and of all links further from the root: it rotates them about an axis w through o, or translates them along w. This motion is a column of
// B = dx/dz:
//
//   rotation:        dx/dz_b = (w_b x (x - o_b) + h_b w_b) / l_b            translation:     dx/dz_b = w_b
//
// h_b is the pitch of a screw, zero for other rotations. l_b, the length of the link (rigid_nodes.h), makes all coordinates lengths. The
// second derivatives, for a coordinate a that belongs to an earlier joint on the path from the root than b, are
//
//   a rotates:       d2x/dz_a dz_b = w_a x dx/dz_b / l_a        a translates:    d2x/dz_a dz_b = 0
//
// For two rotations of one joint (ball or free) it is the part of this that is symmetric in a and b.
//
// The pose of each link is computed from its joint coordinates and the pose of its parent, from the root on, so that no round-off accumulates
// at the joints. A single rigid body is a skeleton of one link with a free joint.
#pragma once

#include "magshell/dofs/joint.h"
#include "magshell/dofs/reduced_coordinates.h"
#include "magshell/dofs/rigid_nodes.h"

namespace magshell {

class SkeletonCoordinates final : public ReducedCoordinates {
  public:
    /// The parameters of a joint, empty if it has none: the target of its motor, its origin, its axis, and numbers of its kind. A joint
    /// with an axis or numbers has an origin.
    struct ParameterSlices {
        ParameterSlice motor, origin, axis;
        std::vector<ParameterSlice> numbers = {};
    };
    /// joints[k] connects links[k] to its parent; parents come first.
    SkeletonCoordinates(std::vector<RigidNodes> links, std::vector<Joint> joints,
                        std::vector<ParameterSlices> slices = {});

    Index coordinates() const override { return coordinates_ - n_motor_coordinates(); }
    Index n_motor_coordinates() const override { return n_motor_coordinates_; }
    void set_values(const Values& values) override;
    VectorXd motor_increment(const VectorXd& q) const override;
    VectorXd motor_units() const override;
    void motor_vjp(const VectorXd& q, const VectorXd& by_motors, Gradient& out) const override;
    VectorXd motor_force_change(const VectorXd& q, const VectorXd& gradient,
                                const VectorXd& motor_rates) const override;
    bool has_joint_parameters() const override;
    void joint_parameters_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                              const VectorXd& gradient, Gradient& out) const override;
    void rest_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z, const VectorXd& gradient,
                  VectorXd& by_nodes) const override;
    std::vector<const RigidNodes*> free_bodies() const override;
    LinkTwists twists(const VectorXd& q) const override;
    Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const override;
    void retract(VectorXd& q, const VectorXd& z) const override;
    VectorXd rounding(const VectorXd& q) const override;
    void project_state(VectorXd& q, VectorXd* v) const override;
    void project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                           Gradient& out, VectorXd* by_rest) const override;

  private:
    using Pose = RigidNodes::Pose;

    Index n_links() const { return static_cast<Index>(links_.size()); }
    std::vector<Pose> poses(const VectorXd& q) const;
    /// Returns the columns of all coordinates, joint by joint.
    std::vector<JointColumn> columns(const std::vector<Pose>& poses) const;
    /// Returns the current rotation of a link's parent; the identity for a root.
    Mat3 frame(Index link, const std::vector<Pose>& poses) const;
    /// Return the two sides of a link's joint.
    JointSide parent_side(Index link, const std::vector<Pose>& poses) const;
    JointSide child_side(Index link, const std::vector<Pose>& poses) const;
    /// Returns the length [m] of a unit of the coordinates of a link's joint: 1 for lengths, l for angles.
    double unit(Index link) const;
    /// Returns the pose of a link after the coordinates of its joint change by z. from: poses before; to: poses after, already set for the
    /// parent.
    Pose moved_pose(Index link, const std::vector<Pose>& from, const std::vector<Pose>& to,
                    const double* z) const;
    /// Sums over the nodes x of a link and of all its descendants in the tree, for joint_parameters_vjp. by_state and gradient are the
    /// arguments of that function, three numbers per node; c is the center of the link, and v its velocity in the motion B z.
    struct SubtreeSums {
        Vec3 by_translation = Vec3::Zero();  // sum by_state
        Vec3 force = Vec3::Zero();           // sum gradient
        // sum (x - c) x by_state + (B z - v) x gradient, minus the moments of ball joints (ball_moments): by a rotation about c
        Vec3 by_rotation = Vec3::Zero();
        Vec3 moment = Vec3::Zero();  // sum (x - c) x gradient
        Vec3 center, velocity;       // c and v
        Vec3 rate = Vec3::Zero();    // angular velocity of the link in the motion B z

        /// Adds the sums of a child link, converted to c and v of this one.
        void add(const SubtreeSums& child);
    };
    /// Returns the angular velocity of each link in the motion B z.
    std::vector<Vec3> turning_rates(const VectorXd& z, const std::vector<JointColumn>& columns) const;
    /// Returns the sums of every link.
    std::vector<SubtreeSums> subtree_sums(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                                          const VectorXd& gradient, const std::vector<Pose>& poses,
                                          const std::vector<JointColumn>& columns) const;
    /// Adds the gradients with respect to the axis and the numbers of a link's joint. sums: those of the link; parent_rate: angular velocity
    /// of its parent.
    void add_joint_gradients(Index link, const SubtreeSums& sums, const Vec3& parent_rate, const VectorXd& z,
                             const std::vector<Pose>& poses, const std::vector<JointColumn>& columns,
                             Gradient& out) const;
    /// Returns a moment for each link, zero unless its joint is a ball joint. The columns of a ball joint are rotations about the world axes,
    /// also if earlier links rotate; so the derivative of sum g . B z by a rotation of an earlier link is smaller by this moment than if
    /// the columns rotated with that link. The moment is zero where B^T g is zero, as at an equilibrium without a motor in the joint.
    std::vector<Vec3> ball_moments(const VectorXd& q, const VectorXd& gradient, const VectorXd& z,
                                   const std::vector<JointColumn>& columns) const;
    /// Returns sum_i g_i d2x_i/dz2 before the blocks of rotations of one joint are symmetrized.
    Eigen::MatrixXd second_derivative(const VectorXd& q, const VectorXd& gradient) const;
    /// Moves all links along z, counted from the poses `from`, and sets the positions of their nodes in q.
    void move_links(VectorXd& q, std::vector<Pose> from, const VectorXd& z) const;
    /// Returns the pose of each link that fits its own vertices best, regardless of the joints; without vertices, its pose at q.
    std::vector<Pose> first_fit(const VectorXd& q) const;
    /// Returns the rows of the nodes that determine a start (leading_).
    Eigen::MatrixXd leading(const Eigen::MatrixXd& rows) const;
    /// Writes these rows back into a vector with the rows of all nodes.
    void scatter_leading(const Eigen::VectorXd& leading, Eigen::VectorXd& rows) const;

    std::vector<RigidNodes> links_;
    std::vector<Joint> joints_;
    std::vector<Index> first_, row_;  // per link: first coordinate of its joint; its first node in nodes()
    std::vector<Index> column_of_;    // per coordinate, joint by joint: its column of B; motors come last
    struct Motor {
        Index link;
        ParameterSlice slice;
        Index first;                 // among the motor coordinates
        Vec3 target = Vec3::Zero();  // a rotation vector for a ball joint, else one number
    };
    std::vector<Motor> motors_;
    Index n_motor_coordinates_ = 0;
    std::vector<ParameterSlices> slices_;  // per joint
    // Nodes from which project_state() takes a start: all vertices of shells and solids, or, if there are none, the ten points with mass of
    // each link.
    std::vector<Index> leading_;
    Index coordinates_ = 0;  // of all joints, those of motors included
    std::shared_ptr<const LinkPaths> paths_;
};

}  // namespace magshell
