#include "magshell/core/rotation_vector.h"

#include <cmath>

namespace magshell {

Mat3 rotation(const Vec3& vector) {
    const double angle = vector.norm();
    if (angle == 0.0) return Mat3::Identity();
    return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Vec3 transposed_jacobian_times(const Vec3& phi, const Vec3& v) {
    const double a = phi.norm(), a2 = a * a;
    const bool small = a < 1e-2;  // below that the closed form loses digits
    const double half_angle_sine = std::sin(0.5 * a);
    const double first =
        small ? 0.5 - a2 / 24.0 + a2 * a2 / 720.0 : 2.0 * half_angle_sine * half_angle_sine / a2;
    const double second = small ? 1.0 / 6.0 - a2 / 120.0 + a2 * a2 / 5040.0 : (a - std::sin(a)) / (a2 * a);
    const Vec3 across = phi.cross(v);
    return v - first * across + second * phi.cross(across);
}

}  // namespace magshell
