// Rigid links in a tree of joints: nodes as functions of the joints' coordinates.            [Qiao21] 4, Algorithm 2
//
// A column of B is what one coordinate does to the nodes of its joint's link and of all links after it: a turn about an
// axis w through o, or a slide along it,
//
//   dx/dz_b = w_b x (x - o_b) / l   or   w_b,      d2x/dz_a dz_b = w_a x dx/dz_b / l_a   (a turns, on the way to b),  0 (a slides)
//
// and of two turns of one joint the symmetric half. l, the length of the link, makes all coordinates lengths. Links are
// rebuilt from their joints' coordinates top down, so that no rounding adds up at the joints. A rigid part is a skeleton of
// one link with a free joint.
#pragma once

#include "magshell/assembly/carrier.h"
#include "magshell/assembly/rigid_nodes.h"
#include "magshell/body/joint.h"

namespace magshell {

class SkeletonCarrier final : public Carrier {
  public:
    /// Where values of a joint stand, empty where there are none: what its motor prescribes, its origin and its axis.
    struct Slots {
        Slot motor, origin, axis;
    };
    /// joints[k] leads to links[k]; parents come first.
    SkeletonCarrier(std::vector<RigidNodes> links, std::vector<Joint> joints, std::vector<Slots> slots = {});

    Index coordinates() const override { return coordinates_ - driven(); }
    Index driven() const override { return n_driven_; }
    void set_values(const Values& values) override;
    VectorXd driven_increment(const VectorXd& q) const override;
    VectorXd driven_units() const override;
    void driven_vjp(const VectorXd& q, const VectorXd& by_driven, Gradient& out) const override;
    VectorXd driving_change(const VectorXd& q, const VectorXd& gradient,
                            const VectorXd& driven) const override;
    bool placed() const override;
    void places_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z, const VectorXd& gradient,
                    Gradient& out) const override;
    LinkTwists twists(const VectorXd& q) const override;
    Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const override;
    void advance(VectorXd& q, const VectorXd& z) const override;
    VectorXd rounding(const VectorXd& q) const override;
    void settle(VectorXd& q, VectorXd* v) const override;
    void settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                    Gradient& out) const override;

  private:
    using Pose = RigidNodes::Pose;
    struct Column {
        bool turns;
        Vec3 axis;
        Vec3 origin;   // of turns
        double share;  // of a unit of the coordinate: radians, or meters
    };

    Index n_links() const { return static_cast<Index>(links_.size()); }
    std::vector<Pose> poses(const VectorXd& q) const;
    /// Of all coordinates, joint by joint.
    std::vector<Column> columns(const std::vector<Pose>& poses) const;
    Vec3 joint_place(Index link, const std::vector<Pose>& poses) const;
    /// How the parent of a link is turned.
    Mat3 frame(Index link, const std::vector<Pose>& poses) const;
    /// The angle or displacement of a joint with an axis.
    double coordinate(Index link, const std::vector<Pose>& poses) const;
    /// Where a link comes to, its parent being there already, as its own coordinates change by z.
    Pose moved(Index link, const std::vector<Pose>& from, const std::vector<Pose>& to, const double* z) const;
    /// What the links beyond a joint get of forces and of by_state, as places_vjp takes them.
    struct Beyond {
        Vec3 slide = Vec3::Zero(), force = Vec3::Zero();  // sums of by_state, of gradient
        Vec3 twist = Vec3::Zero(),
             moment = Vec3::Zero();  // (x - c) x by_state + B z x gradient, (x - c) x gradient
        Vec3 center, velocity;       // c, the place about which those are, and how it moves
        Vec3 rate = Vec3::Zero();    // at which B z turns the link

        void take(const Beyond& later);
    };
    std::vector<Beyond> beyond(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                               const VectorXd& gradient, const std::vector<Pose>& poses,
                               const std::vector<Column>& columns) const;
    Vec3 axis_gradient(Index link, const Beyond& of, const Vec3& parent_rate, const VectorXd& z,
                       const std::vector<Pose>& poses, const std::vector<Column>& columns) const;
    /// Of each ball joint, by its link, what its columns at the rates z do not turn along with the links before it: the
    /// couple that this takes off sum g . B z. Zero where a ball joint is free and B^T g is zero.
    std::vector<Vec3> ball_couples(const VectorXd& q, const VectorXd& gradient, const VectorXd& z,
                                   const std::vector<Column>& columns) const;
    /// sum_i g_i d2x_i/dz2, where columns of turns of one joint do not turn with it.
    Eigen::MatrixXd second_derivative(const VectorXd& q, const VectorXd& gradient) const;
    void move_on(VectorXd& q, std::vector<Pose> from, const VectorXd& z) const;
    /// Poses that fit the vertices well enough to begin with, and the joints exactly.
    std::vector<Pose> first_fit(const VectorXd& q) const;
    /// The rows of B of what a start says: of vertices, or of all nodes where there are none.
    Eigen::MatrixXd leading(const Eigen::MatrixXd& rows) const;
    void scatter_leading(const Eigen::VectorXd& leading, Eigen::VectorXd& rows) const;

    std::vector<RigidNodes> links_;
    std::vector<Joint> joints_;
    std::vector<Index> first_, row_;  // of each link: its joint's first coordinate; its first node among all
    std::vector<Index> place_;        // of each coordinate, joint by joint: its column, those of motors last
    struct Motor {
        Index link;
        Slot slot;
        Index first;                 // of what is driven
        Vec3 target = Vec3::Zero();  // of a ball joint a rotation vector, else one number
    };
    std::vector<Motor> driven_;
    Index n_driven_ = 0;
    std::vector<Slots> slots_;    // of each joint
    std::vector<Index> leading_;  // nodes, among all
    Index coordinates_ = 0;
    std::shared_ptr<const LinkPaths> paths_;
};

}  // namespace magshell
