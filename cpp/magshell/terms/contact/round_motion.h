// RoundMotion: a ball, a capsule or an ellipsoid that a rigid body carries, and the obstacle next to it, at one state.
//
//   x(t) = sum a_k x_k,   a_k = 1/4 + w_k . (y + H t)        point of the shape's core, at rest from the mean of the corners x_k
//   g = min_t f(x(t)) + b |t|^2/2 - r                        gap, with the distance f of the obstacle
//   p = x - r n                                              where they touch, on the surface of the shape
//
// shape_core.h has y, H, the radius r and the crown b; w_k are the gradients of the barycentric coordinates of the corners x_k, which move with
// the rigid body.
//
// nearest_point.h finds t, with the directions d in which it moves, s = e . n + b t . d = 0 for e = dx/dt d, and the second derivatives S
// in them. By the theorem of the envelope, the gap changes with the state as f does at constant t, and
//
//   dt = - sum d ds/S,   d2g = d2f - sum ds ds^T/S           over the directions
//
// The normal force acts at x, friction at p, which has the same moment for a force along n. relative_motion.h has the motion relative to
// a rigid body that carries the obstacle.
#pragma once

#include <array>
#include <vector>

#include "magshell/assembly/nonsymmetric_tangent.h"
#include "magshell/force/friction.h"
#include "magshell/obstacle/obstacle_state.h"
#include "magshell/terms/contact/nearest_point.h"
#include "magshell/terms/contact/relative_motion.h"

namespace magshell {

/// A shape and an obstacle that it may touch, both by their numbers among the obstacles.
struct RoundInput {
    Index shape = 0, obstacle = 0;
    ShapeCore core;
};

class RoundMotion {
  public:
    /// The corners of the rigid body that carries the shape, and of the one that carries the obstacle, if any does.
    static constexpr int places = 8;
    using Nodes = std::array<Index, places>;
    /// The blocks (i, j) of a matrix between the nodes, at places * i + j.
    using Blocks = std::vector<Mat3>;

    /// placed: where the shape is at rest. other: nullptr if no body carries the obstacle. distance: f at a point of the world.
    RoundMotion(const RoundInput& input, const Placement& placed, const CornerFrame& own,
                const CornerFrame* other, const NearestPoint::DistanceAt& distance, const double* q);

    static Nodes nodes(const CornerFrame& own, const CornerFrame* other);
    Nodes nodes() const { return nodes(*own_, other_); }
    /// Returns the gap g, with the normal and the curvature of f.
    Distance gap() const {
        const Distance& at = nearest_.at;
        return {at.value + nearest_.rise - radius_, at.normal, at.curvature};
    }
    /// Returns the same contact with all motions and forces at p instead of x.
    RoundMotion on_surface() const;
    /// Returns x, or p on the surface.
    Vec3 point() const { return nearest_.point - inset_ * normal(); }

    /// Returns the derivative of the motion relative to the obstacle by that of a node, at constant t.
    Mat3 jacobian(int place) const;
    Vec3 motion(const double* all) const;
    Vec3 reaction(int place, const Vec3& force) const;
    /// Returns a block of the Hessian of the energy, given the normal force and its stiffness; at x.
    Mat3 hessian(int i, int j, double force, double stiffness) const;
    /// Returns the friction's derivative by positions at constant velocities v of all degrees of freedom; on the surface.
    /// stiffness: of the normal force. spin: angular velocity of an obstacle that no body carries.
    Blocks by_positions(const Friction& friction, double stiffness, const Vec3& spin,
                        const VectorXd& v) const;
    /// Adds factor times such blocks to a tangent.
    void add(const Blocks& blocks, double factor, NonsymmetricTangent& out) const;

    /// A function of the normal force, the normal, the velocity u = G v and the motion l = G lambda at the point: its derivatives.
    struct Slopes {
        double by_force = 0.0;
        Vec3 by_normal = Vec3::Zero(), by_velocity = Vec3::Zero(), by_motion = Vec3::Zero();
        const double *v = nullptr, *lambda = nullptr;
        Vec3 spin = Vec3::Zero();  // of an obstacle that no body carries
    };
    struct ByObstacle {
        double by_distance;
        Vec3 by_normal;
    };
    /// Adds the gradient of that function by the placement of the shape to `by_shape`; returns that by the distance and the normal of the
    /// obstacle at x.
    ByObstacle vjp(const Slopes& slopes, double stiffness, const Placement& placed,
                   Placement& by_shape) const;

  private:
    static constexpr int corners = 4;
    double weight(int k) const { return weights_[k] - inset_ * own_levers_[k].dot(normal()); }
    const Vec3& normal() const { return nearest_.at.normal; }
    Vec3 arm() const { return arm_ - inset_ * normal(); }
    /// Returns ds of a direction by the motion of a node.
    Vec3 sliding(int direction, int place) const;

    const CornerFrame *own_, *other_;
    double radius_, inset_ = 0.0;                    // inset_: 0 at x, r on the surface
    Mat3 own_axes_;                                  // R of the rigid body that carries the shape
    std::array<Vec3, corners> own_levers_, levers_;  // R w_k of that and of the other body
    std::array<double, corners> weights_;            // a_k
    NearestPoint nearest_;                           // t, x, d, S
    std::array<Vec3, 2> at_rest_, along_;            // H d in the axes of the rigid body at rest, e
    Vec3 from_center_, arm_ = Vec3::Zero();          // y + H t from the shape's center, x from the other body
};

}  // namespace magshell
