// RoundMotion: a ball or a capsule that a rigid body carries, and the obstacle next to it, at one state.
//
//   x(t) = sum a_k x_k,   a_k = 1/4 + w_k . (y + t h)        point of the axis; y, h: its middle and half of it, at rest from the corners' mean
//   g = min_t f(x(t)) + b t^2/2 - r,   -1 <= t <= 1          gap, with the distance f of the obstacle; h = 0 for a ball
//   p = x - r n                                              where they touch, on the surface of the ball or capsule
//
// A crown b > 0 makes the ends of the axis thinner by b/2, as those of bearing rollers are. Where a capsule lies along a flat or straight
// surface, its place of contact then moves continuously with the tilt. By the theorem of the envelope, the gap changes with the state as
// f does at constant t. With e = dx/dt, s = n . e + b t = 0 and S = ds/dt = e . C e + b (C: curvature of f) in the inner of the axis,
//
//   dt = - ds/S,   d2g = d2f - ds ds^T/S
//
// The normal force acts at x, friction at p, which has the same moment for a force along n. relative_motion.h has the motion relative to
// a rigid body that carries the obstacle.
#pragma once

#include <array>
#include <functional>

#include "magshell/assembly/nonsymmetric_tangent.h"
#include "magshell/force/friction.h"
#include "magshell/obstacle/obstacle_state.h"
#include "magshell/terms/contact/relative_motion.h"

namespace magshell {

/// A ball or a capsule and an obstacle that it may touch, both by their numbers among the obstacles.
struct RoundInput {
    Index shape = 0, obstacle = 0;
    Vec3 middle = Vec3::Zero(), half = Vec3::Zero();  // of the axis, in the shape's own frame [m]
    double radius = 0.0, crown = 0.0;                 // r, b [m]
};

class RoundMotion {
  public:
    /// The corners of the rigid body that carries the shape, and of the one that carries the obstacle, if any does.
    static constexpr int places = 8;
    using Nodes = std::array<Index, places>;
    using DistanceAt = std::function<Distance(const Vec3&)>;

    /// placed: where the shape is at rest. other: nullptr if no body carries the obstacle. distance: f at a point of the world.
    RoundMotion(const RoundInput& input, const Placement& placed, const CornerFrame& own,
                const CornerFrame* other, const DistanceAt& distance, const double* q);

    static Nodes nodes(const CornerFrame& own, const CornerFrame* other);
    Nodes nodes() const { return nodes(*own_, other_); }
    /// Returns the gap g, with the normal and the curvature of f.
    Distance gap() const {
        return {at_.value + 0.5 * crown_ * place_ * place_ - radius_, at_.normal, at_.curvature};
    }
    /// Returns the same contact with all motions and forces at p instead of x.
    RoundMotion on_surface() const;
    /// Returns x, or p on the surface.
    Vec3 point() const { return point_ - inset_ * at_.normal; }

    /// Returns the derivative of the motion relative to the obstacle by that of a node, at constant t.
    Mat3 jacobian(int place) const;
    Vec3 motion(const double* all) const;
    Vec3 reaction(int place, const Vec3& force) const;
    /// Returns a block of the Hessian of the energy, given the normal force and its stiffness; at x.
    Mat3 hessian(int i, int j, double force, double stiffness) const;
    /// Adds factor times the friction's derivative by positions at constant velocities v of all degrees of freedom; on the surface.
    /// stiffness: of the normal force. spin: angular velocity of an obstacle that no body carries.
    void add_friction(const Friction& friction, double stiffness, const Vec3& spin, double factor,
                      const VectorXd& v, NonsymmetricTangent& out) const;

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
    double weight(int k) const { return weights_[k] - inset_ * own_levers_[k].dot(at_.normal); }
    Vec3 arm() const { return arm_ - inset_ * at_.normal; }
    bool moves_along() const { return stretch_ > 0.0; }
    /// Returns ds by the motion of a node.
    Vec3 sliding(int place) const;

    const CornerFrame *own_, *other_;
    double radius_, crown_, inset_ = 0.0;            // inset_: 0 at x, r on the surface
    Mat3 own_axes_;                                  // R of the rigid body that carries the shape
    std::array<Vec3, corners> own_levers_, levers_;  // R w_k of that and of the other body
    std::array<double, corners> weights_;            // a_k
    Vec3 from_center_, half_at_rest_, along_;        // y + t h from the shape's center, h, e
    Vec3 point_, arm_ = Vec3::Zero();                // x, and x from the other body
    Distance at_;                                    // f at x
    double place_ = 0.0, stretch_ = 0.0;             // t, S; S = 0 where t is constant
};

}  // namespace magshell
