// Magnetic: the law of a magnetization that is carried by the deformation gradient, M = F_0 M~_r (magnetic_face.h).
//
// F_0 maps the reference tangents to the current ones and the reference normal to the current unit normal,
// [Chen22] (20). With the coordinates (alpha, beta, gamma) of M~_r [A/m] in (a~_1, a~_2, n~)
//
//   F_0 M~_r = alpha a_1 + beta a_2 + gamma n,     a_1 = x_1 - x_0,  a_2 = x_2 - x_0.
//
// Derivatives follow [Chen22] (62), (63) without their misprints: the factor is (n~ . M~_r), and the signs are
// those of face_frame.h (checked against automatic differentiation).
#pragma once

#include <string_view>

#include "magshell/energy/magnetic_face.h"

namespace magshell {

struct Magnetic : MagneticFace<Magnetic> {
    static constexpr std::string_view name = "magnetic";
    using Field = FieldAtPoint;

    struct Element {
        SimdDouble volume;              // A~ h [m3]
        SimdDouble alpha, beta, gamma;  // M~_r [A/m] in (a~_1, a~_2, n~)
    };

    explicit Magnetic(const SimdVec3 x[3]) : MagneticFace(x) {}
    Magnetic(const SimdVec3 x[3], const Element&) : MagneticFace(x) {}

    /// Returns the matrix (a~_1, a~_2, n~) of edge vectors at rest.
    static Mat3 rest_frame(const Vec3& a1, const Vec3& a2) {
        Mat3 frame;
        frame << a1, a2, a1.cross(a2).normalized();
        return frame;
    }
    static void set_rest(const Vec3&, const Vec3&, Element&, int /*lane*/) {}
    /// Returns true if a magnetization of these coordinates is linear in the positions.
    static bool is_linear(const Vec3& coordinates) { return coordinates[2] == 0.0; }

    SimdVec3 magnetization(const Element& e) const { return e.alpha * a1 + e.beta * a2 + e.gamma * normal; }

    void frame(SimdVec3 columns[3]) const { columns[0] = a1, columns[1] = a2, columns[2] = normal; }
    void frame_rate(const SimdVec3 rate[3], SimdVec3 columns[3]) const {
        columns[0] = rate[1] - rate[0], columns[1] = rate[2] - rate[0], columns[2] = normal_rate(rate);
    }

    void by_edges(const Element& e, const SimdVec3& b, SimdVec3& d1, SimdVec3& d2) const {
        const SimdVec3 p = tangential(b);
        d1 = e.alpha * b + e.gamma * cross(a2, p);
        d2 = e.beta * b - e.gamma * cross(a1, p);
    }

    void edge_hessian(const Element& e, const SimdVec3& b, SimdMat3& h11, SimdMat3& h12,
                      SimdMat3& h22) const {
        normal_hessian(-e.volume * e.gamma, b, h11, h12, h22);
    }
};

}  // namespace magshell
