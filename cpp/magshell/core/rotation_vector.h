// Rotation vectors: R(phi) rotates about the axis phi by the angle |phi| [rad].
#pragma once

#include "magshell/core/types.h"

namespace magshell {

Mat3 rotation(const Vec3& vector);

/// Returns J(phi)^T v with the left Jacobian of SO(3): if phi changes by dphi, R y is rotated by J(phi) dphi,
/// J(phi) = I + (1 - cos a)/a^2 [phi] + (a - sin a)/a^3 [phi]^2, a = |phi|.
Vec3 transposed_jacobian_times(const Vec3& phi, const Vec3& v);

}  // namespace magshell
