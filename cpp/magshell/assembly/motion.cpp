#include "magshell/assembly/motion.h"

#include <Eigen/Geometry>
#include <cmath>

namespace magshell {
namespace {

Mat3 rotation(const Vec3& vector) {
    const double angle = vector.norm();
    if (angle == 0.0) return Mat3::Identity();
    return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// J(phi)^T v. The series where the closed form cancels.
Vec3 transposed_jacobian_times(const Vec3& phi, const Vec3& v) {
    const double a = phi.norm(), a2 = a * a;
    const bool small = a < 1e-2;
    const double half_angle_sine = std::sin(0.5 * a);
    const double first = small ? 0.5 - a2 / 24.0 + a2 * a2 / 720.0 : 2.0 * half_angle_sine * half_angle_sine / a2;
    const double second = small ? 1.0 / 6.0 - a2 / 120.0 + a2 * a2 / 5040.0 : (a - std::sin(a)) / (a2 * a);
    const Vec3 across = phi.cross(v);
    return v - first * across + second * phi.cross(across);
}

}  // namespace

Vec3 Motion::point(const Vec3& rest, double progress) const {
    return centre + direction(rest - centre, progress) + progress * translation;
}

Vec3 Motion::direction(const Vec3& rest, double progress) const { return rotation(progress * rotation_vector) * rest; }

Vec3 Motion::point_rate(const Vec3& rest, double progress) const {
    return direction_rate(rest - centre, progress) + translation;
}

Vec3 Motion::direction_rate(const Vec3& rest, double progress) const {
    return rotation_vector.cross(direction(rest, progress));
}

void Motion::point_vjp(const Vec3& rest, double progress, const Vec3& by_place, Motion& out) const {
    out.translation += progress * by_place;
    out.centre += by_place - rotation(progress * rotation_vector).transpose() * by_place;
    direction_vjp(rest - centre, progress, by_place, out);
}

void Motion::direction_vjp(const Vec3& rest, double progress, const Vec3& by_place, Motion& out) const {
    const Vec3 torque = direction(rest, progress).cross(by_place);
    out.rotation_vector += progress * transposed_jacobian_times(progress * rotation_vector, torque);
}

}  // namespace magshell
