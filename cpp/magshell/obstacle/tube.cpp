#include "magshell/obstacle/tube.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "magshell/core/errors.h"
#include "magshell/obstacle/obstacle.h"

namespace magshell {
namespace {

constexpr int samples_a_segment = 4;
// [knots] Length beyond an open end after which the tube is straight and round: a spline coefficient acts over this range.
constexpr int transition = 3;

// Extends the radius of an open tube beyond its ends by constant values, so that its spline becomes constant
// there.
void settle_radius(std::vector<Vec4>& coefficients, std::span<const double> radii) {
    std::vector<Vec4> longer(radii.size() + 2 * transition);
    for (std::size_t k = 0; k < longer.size(); ++k) {
        const std::size_t inner =
            std::clamp<std::size_t>(k, transition, radii.size() - 1 + transition) - transition;
        longer[k] = Vec4(0.0, 0.0, 0.0, radii[inner]);
    }
    longer = spline_coefficients(longer);
    for (std::size_t k = 0; k < coefficients.size(); ++k) coefficients[k][3] = longer[k + transition][3];
}

// Appends coefficients beyond the last ones, on the straight line through the last two, with the radius of the
// end.
void continue_straight(std::vector<Vec4>& c, double radius) {
    for (int k = 0; k < transition; ++k) {
        Vec4 next = 2.0 * c[c.size() - 1] - c[c.size() - 2];
        next[3] = radius;
        c.push_back(next);
    }
}

}  // namespace

Tube::Tube(std::span<const Vec3> points, std::span<const double> radii, bool closed) : closed_(closed) {
    if (points.size() < 2 || points.size() != radii.size())
        throw InvalidInput("a tube needs at least two points, and one radius a point");
    std::vector<Vec4> values;
    for (std::size_t k = 0; k < points.size(); ++k)
        values.emplace_back(points[k].x(), points[k].y(), points[k].z(), radii[k]);
    coefficients_ = spline_coefficients(values);
    if (!closed) {
        settle_radius(coefficients_, radii);
        for (const double radius : {radii.back(), radii.front()}) {
            continue_straight(coefficients_, radius);
            std::reverse(coefficients_.begin(), coefficients_.end());
        }
    }
    const int segments = static_cast<int>(coefficients_.size()) - 3;
    last_ = segments;
    samples_.resize(samples_a_segment * segments + 1, 4);
    for (int k = 0; k < samples_.rows(); ++k)
        samples_.row(k) = section(static_cast<double>(k) / samples_a_segment).value.transpose().array();
    check(closed ? 0.0 : transition);

    for (const int side : {0, 1}) {
        const Section at = section(side * last_);
        rays_[side] = {at.value.head<3>(), (side ? 1.0 : -1.0) * at.first.head<3>().normalized(),
                       at.value[3]};
    }
}

void Tube::check(double first_knot) const {
    for (int k = 0; k < samples_.rows(); ++k) {
        const double s = static_cast<double>(k) / samples_a_segment;
        const Section at = section(s);
        std::ostringstream problem;
        if (!(at.value[3] > 0.0)) {
            problem << "the radius of the tube is " << at.value[3] << " m";
        } else if (!(std::abs(at.first[3]) < at.first.head<3>().norm())) {
            problem << "the radius of the tube changes by " << at.first[3]
                    << " m a knot while its center advances by " << at.first.head<3>().norm()
                    << " m, so that its balls lie in each other";
        } else {
            continue;
        }
        problem << " near knot " << s - first_knot << " (point 0 is knot 0)";
        throw InvalidInput(problem.str());
    }
}

Tube::Section Tube::section(double s) const {
    const double i = std::clamp(std::floor(s), 0.0, last_ - 1.0);
    const SplineWeights w = spline_weights(s - i);
    const Vec4* c = coefficients_.data() + static_cast<std::size_t>(i);
    const auto sum = [c](const std::array<double, 4>& weights) -> Vec4 {
        return weights[0] * c[0] + weights[1] * c[1] + weights[2] * c[2] + weights[3] * c[3];
    };
    return {sum(w[0]), sum(w[1]), sum(w[2])};
}

Tube::Slope Tube::slope_at(const Section& at, const Vec3& point) {
    const Vec3 offset = point - at.value.head<3>(), c1 = at.first.head<3>(), c2 = at.second.head<3>();
    const double d = std::max(offset.norm(), std::numeric_limits<double>::min());
    const double along = offset.dot(c1) / d;
    const double second = (c1.squaredNorm() - along * along - offset.dot(c2)) / d - at.second[3];
    return {d - at.value[3], -along - at.first[3], second};
}

// Finds the minimum of psi between the neighbours of a sample that is lower than they are: psi_s = 0 by
// Newton's method, safeguarded by bisection. At an end of the curve psi may still fall outwards.
double Tube::nearest(const Vec3& point, Eigen::Index sample) const {
    // [knots] Length of the last step. Newton's method converges quadratically, so the next one is below round-off.
    constexpr double close = 1e-8;
    const double spacing = 1.0 / samples_a_segment;
    double s = static_cast<double>(sample) * spacing;
    double low = std::max(s - spacing, 0.0), high = std::min(s + spacing, last_);
    for (int iteration = 0; iteration < 60; ++iteration) {
        const Slope psi = slope_at(section(s), point);
        if ((s == 0.0 && psi.first >= 0.0) || (s == last_ && psi.first <= 0.0)) return s;
        (psi.first > 0.0 ? high : low) = s;
        double next = psi.second > 0.0 ? s - psi.first / psi.second : low - 1.0;
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        const double step = std::abs(next - s);
        s = next;
        if (step <= close) break;
    }
    return s;
}

Distance Tube::distance_at(double s, const Vec3& point) const {
    // [-] Lower bound of d psi_ss / |c'|^2, which is zero at a center of curvature.
    constexpr double least_curvature = 1e-6;
    const Section at = section(s);
    const Vec3 offset = point - at.value.head<3>(), along = at.first.head<3>();
    const Vec3 straight = along.normalized();
    Distance result = ball_distance(offset, at.value[3], Mat3::Identity(), straight.unitOrthogonal());
    const bool at_an_end = s == 0.0 || s == last_;  // at its ball the center does not follow the point
    if (at_an_end || result.curvature.isZero(0.0)) return result;
    const double d = offset.norm();
    const double squared = along.squaredNorm();
    const Vec3 across = along - along.dot(result.normal) * result.normal;
    const double second = across.squaredNorm() - offset.dot(at.second.head<3>()) - d * at.second[3];
    result.curvature -= across * across.transpose() / (d * std::max(second, least_curvature * squared));
    return result;
}

bool Tube::beyond(const Ray& ray, const Vec3& point, double value, Distance& out) {
    const Vec3 offset = point - ray.origin;
    const double place = ray.outwards.dot(offset);
    const Vec3 across = offset - place * ray.outwards;
    if (place < 0.0 || across.norm() - ray.radius > value) return false;
    const Mat3 held = Mat3::Identity() - ray.outwards * ray.outwards.transpose();
    out = ball_distance(across, ray.radius, held, ray.outwards.unitOrthogonal());
    return true;
}

Distance Tube::distance(const Vec3& point) const {
    const Eigen::Index count = samples_.rows();
    thread_local Eigen::ArrayXd of_this_thread;
    Eigen::ArrayXd& psi = of_this_thread;
    psi = ((samples_.col(0) - point.x()).square() + (samples_.col(1) - point.y()).square() +
           (samples_.col(2) - point.z()).square())
              .sqrt() -
          samples_.col(3);
    const double least = psi.minCoeff();

    // Refines every sampled minimum that may be the lowest: it lies at most as far below its sample as a
    // neighbour lies above it.
    double best = std::numeric_limits<double>::infinity(), place = 0.0;
    for (Eigen::Index k = 0; k < count; ++k) {
        const double before = k > 0 ? psi[k - 1] : psi[k], after = k + 1 < count ? psi[k + 1] : psi[k];
        if (psi[k] > before || psi[k] > after || 2.0 * psi[k] - std::max(before, after) > least) continue;
        const double s = nearest(point, k);
        const double value = slope_at(section(s), point).value;
        if (value < best) best = value, place = s;
    }
    Distance result;
    bool on_a_ray = false;
    if (!closed_) {
        const double slack = on_the_center * std::abs(best);
        for (const Ray& ray : rays_) {
            if (!beyond(ray, point, best + slack, result)) continue;
            on_a_ray = true;
            best = result.value;
        }
    }
    return on_a_ray ? result : distance_at(place, point);
}

}  // namespace magshell
