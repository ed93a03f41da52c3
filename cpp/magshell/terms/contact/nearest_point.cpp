#include "magshell/terms/contact/nearest_point.h"

#include <cmath>

namespace magshell {
namespace {

constexpr double place_accuracy = 1e-15;  // [-] of t
constexpr int max_searches = 200;         // a bisection ends after 51

// A place on an ellipsoid's surface, with the slope H^T n and its part along the surface.
struct SurfacePlace {
    Vec3 place;
    Distance at;
    Vec3 slope, along;
    Eigen::Matrix<double, 3, 2> tangents;  // orthonormal

    SurfacePlace(const Vec3& t, const Vec3& middle, const Mat3& half,
                 const NearestPoint::DistanceAt& distance)
        : place(t), at(distance(middle + half * t)), slope(half.transpose() * at.normal) {
        along = slope - slope.dot(t) * t;
        tangents.col(0) = t.unitOrthogonal();
        tangents.col(1) = t.cross(tangents.col(0));
    }
    // The second derivatives along the tangents; beyond the nearest place a bound of them that is positive.
    Eigen::Matrix2d curvature(const Mat3& half) const {
        const Eigen::Matrix<double, 3, 2> moved = half * tangents;
        return moved.transpose() * at.curvature * moved + slope.norm() * Eigen::Matrix2d::Identity();
    }
};

}  // namespace

NearestPoint::NearestPoint(const ShapeCore& core, const Vec3& middle, const Mat3& half,
                           const DistanceAt& distance) {
    if (core.dimensions == 3) {
        search_ellipsoid(middle, half, distance);
    } else if (core.dimensions == 1) {
        search_segment(core.crown, middle, half.col(0), distance);
    } else {
        at = distance(middle);
    }
    point = middle + half * place;
}

// Newton's method on the slope, which grows with t; a bisection where it does not halve the slope.
void NearestPoint::search_segment(double crown, const Vec3& middle, const Vec3& half,
                                  const DistanceAt& distance) {
    double& t = place.x();
    const auto slope = [&](double there) {
        at = distance(middle + there * half);
        return at.normal.dot(half) + crown * there;
    };
    if (slope(-1.0) >= 0.0) {
        t = -1.0;
    } else if (slope(1.0) <= 0.0) {
        t = 1.0;
    } else {
        double low = -1.0, high = 1.0, before = INFINITY;
        for (int k = 0; k < max_searches; ++k) {
            const double now = slope(t);
            const double stretch = half.dot(at.curvature * half) + crown;
            moving = stretch > 0.0 ? 1 : 0;
            stretches[0] = stretch;
            (now > 0.0 ? high : low) = t;
            double next = t - now / stretch;
            if (!(stretch > 0.0 && std::abs(now) < 0.5 * before && next > low && next < high))
                next = 0.5 * (low + high);
            before = std::abs(now);
            if (now == 0.0 || std::abs(next - t) < place_accuracy || high - low < place_accuracy) break;
            t = next;
        }
    }
    directions[0] = Vec3::UnitX();
    rise = 0.5 * crown * t * t;
}

// Newton's method on the unit sphere, halved where neither the distance falls nor the slope halves. A zero of the slope on the side of the
// obstacle is the nearest place, since f is convex. Short steps are taken as they are, until round-off ends their decrease.
void NearestPoint::search_ellipsoid(const Vec3& middle, const Mat3& half, const DistanceAt& distance) {
    constexpr double is_short = 1e-6;  // [rad]
    constexpr double enough = 1e-4;    // [-] of the decrease that the slope predicts
    constexpr int max_halvings = 40;
    const auto look = [&](const Vec3& t) { return SurfacePlace(t, middle, half, distance); };
    SurfacePlace now = look(-(half.transpose() * distance(middle).normal).normalized());
    double before = INFINITY;
    for (int k = 0; k < max_searches; ++k) {
        const Eigen::Vector2d slope = now.tangents.transpose() * now.along;
        Eigen::Vector2d step = -now.curvature(half).inverse() * slope;
        const double length = step.norm();
        if (length < place_accuracy || (length < is_short && length > 0.5 * before)) break;
        before = length;
        const auto ahead = [&] { return look((now.place + now.tangents * step).normalized()); };
        const auto is_better = [&](const SurfacePlace& next) {
            if (next.at.value < now.at.value + enough * slope.dot(step)) return true;
            return next.along.norm() < 0.5 * now.along.norm() && next.slope.dot(next.place) < 0.0;
        };
        SurfacePlace next = ahead();
        int halvings = 0;
        for (; length >= is_short && !is_better(next) && halvings < max_halvings; ++halvings) {
            step *= 0.5;
            next = ahead();
        }
        if (halvings == max_halvings) break;
        now = next;
    }
    place = now.place;
    at = now.at;
    moving = 2;
    set_principal(now.curvature(half), now.tangents);
}

// With the angle a of the greater one, tan 2a = 2 c10/(c00 - c11): closed, as Eigen's solver takes long to compile.
void NearestPoint::set_principal(const Eigen::Matrix2d& c, const Eigen::Matrix<double, 3, 2>& tangents) {
    const double mean = 0.5 * (c(0, 0) + c(1, 1)), half_difference = 0.5 * (c(0, 0) - c(1, 1));
    const double radius = std::hypot(half_difference, c(1, 0));
    const double angle = 0.5 * std::atan2(c(1, 0), half_difference);
    const Vec3 u = tangents.col(0), v = tangents.col(1);
    directions = {std::cos(angle) * v - std::sin(angle) * u, std::cos(angle) * u + std::sin(angle) * v};
    stretches = {mean - radius, mean + radius};
}

}  // namespace magshell
