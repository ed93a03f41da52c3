// Reduced coordinates of rigid links in a tree of joints.                                    [Qiao21] 4, Algorithm 2
//
// A column of B is the motion of the nodes of a joint's link, and of all links after it, along one coordinate: a rotation
// about an axis w through o, or a translation along w,
//
//   dx/dz_b = w_b x (x - o_b) / l   or   w_b,      d2x/dz_a dz_b = w_a x dx/dz_b / l_a   (a rotates and precedes b),  0 (a translates)
//
// and for two rotations of one joint the symmetric half of this. l, the length of the link, makes all coordinates lengths. The links
// are placed from their joint coordinates from the root down, so that no round-off accumulates at the joints. A single rigid body is a
// skeleton of one link with a free joint.
#pragma once

#include "magshell/body/joint.h"
#include "magshell/dofs/reduced_coordinates.h"
#include "magshell/dofs/rigid_nodes.h"

namespace magshell {

class SkeletonCoordinates final : public ReducedCoordinates {
  public:
    /// The parameters of a joint, empty if it has none: the target of its motor, its origin and its axis.
    struct ParameterSlices {
        ParameterSlice motor, origin, axis;
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
                                const VectorXd& n_motor_coordinates) const override;
    bool has_joint_parameters() const override;
    void joint_parameters_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                              const VectorXd& gradient, Gradient& out) const override;
    LinkTwists twists(const VectorXd& q) const override;
    Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const override;
    void retract(VectorXd& q, const VectorXd& z) const override;
    VectorXd rounding(const VectorXd& q) const override;
    void project_state(VectorXd& q, VectorXd* v) const override;
    void project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                           Gradient& out) const override;

  private:
    using Pose = RigidNodes::Pose;
    struct Column {
        bool turns;
        Vec3 axis;
        Vec3 origin;   // of a rotation
        double scale;  // radians, or meters, per unit of the coordinate
    };

    Index n_links() const { return static_cast<Index>(links_.size()); }
    std::vector<Pose> poses(const VectorXd& q) const;
    /// Returns the columns of all coordinates, joint by joint.
    std::vector<Column> columns(const std::vector<Pose>& poses) const;
    /// Returns the current position of a joint's origin; and the rotation of a link's parent.
    Vec3 joint_position(Index link, const std::vector<Pose>& poses) const;
    Mat3 frame(Index link, const std::vector<Pose>& poses) const;
    /// Returns the angle [rad] or displacement [m] of a joint with an axis.
    double coordinate(Index link, const std::vector<Pose>& poses) const;
    /// Returns the pose of a link whose parent was moved already, after its own coordinates change by z.
    Pose moved_pose(Index link, const std::vector<Pose>& from, const std::vector<Pose>& to,
                    const double* z) const;
    /// Sums of forces over the links beyond a joint, for joint_parameters_vjp: by_state and gradient, and their moments.
    struct Beyond {
        Vec3 slide = Vec3::Zero(), force = Vec3::Zero();  // sums of by_state and of gradient
        Vec3 twist = Vec3::Zero(),
             moment = Vec3::Zero();  // (x - c) x by_state + B z x gradient, and (x - c) x gradient
        Vec3 center, velocity;       // c, the point of the moments, and its velocity
        Vec3 rate = Vec3::Zero();    // angular velocity of the link along B z

        void add(const Beyond& later);
    };
    std::vector<Beyond> beyond(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                               const VectorXd& gradient, const std::vector<Pose>& poses,
                               const std::vector<Column>& columns) const;
    Vec3 axis_gradient(Index link, const Beyond& of, const Vec3& parent_rate, const VectorXd& z,
                       const std::vector<Pose>& poses, const std::vector<Column>& columns) const;
    /// Returns for each ball joint, by link, the moment that is subtracted from the derivative of sum g . B z because its columns do not rotate with
    /// the links before it. Zero if the joint is free and B^T g is zero.
    std::vector<Vec3> ball_moments(const VectorXd& q, const VectorXd& gradient, const VectorXd& z,
                                   const std::vector<Column>& columns) const;
    /// Returns sum_i g_i d2x_i/dz2 without symmetrization: the columns of rotations of one joint do not rotate with it.
    Eigen::MatrixXd second_derivative(const VectorXd& q, const VectorXd& gradient) const;
    void move_links(VectorXd& q, std::vector<Pose> from, const VectorXd& z) const;
    /// Returns poses that fit the vertices approximately, each link by itself.
    std::vector<Pose> first_fit(const VectorXd& q) const;
    /// Select the rows of B that a start prescribes: of vertices, or of all nodes if there are none; and put them back.
    Eigen::MatrixXd leading(const Eigen::MatrixXd& rows) const;
    void scatter_leading(const Eigen::VectorXd& leading, Eigen::VectorXd& rows) const;

    std::vector<RigidNodes> links_;
    std::vector<Joint> joints_;
    std::vector<Index> first_, row_;  // per link: first coordinate of its joint; its first node among all
    std::vector<Index>
        column_of_;  // per coordinate, joint by joint: its column of B; those of motors come last
    struct Motor {
        Index link;
        ParameterSlice slice;
        Index first;                 // among the motor coordinates
        Vec3 target = Vec3::Zero();  // a rotation vector for a ball joint, else one number
    };
    std::vector<Motor> motors_;
    Index n_motor_coordinates_ = 0;
    std::vector<ParameterSlices> slices_;  // per joint
    std::vector<Index> leading_;           // the nodes that a start prescribes
    Index coordinates_ = 0;
    std::shared_ptr<const LinkPaths> paths_;
};

}  // namespace magshell
