// Polar: the polar decomposition of F with signed stretches, F = U diag(s) V^T and R = U V^T, with proper
// rotations U and V. In an inverted element the smallest stretch is negative. One point per SIMD lane.
//
// Method: one-sided Jacobi rotations make the columns of F orthogonal, which keeps small stretches accurate.
// The direction of the smallest stretch is the cross product of the other two, so R exists for a flat element
// too. For an element that has shrunk to a line or a point, any fitting rotation is returned.
#pragma once

#include "magshell/core/simd_functions.h"
#include "magshell/strain/deformation.h"

namespace magshell {

struct Polar {
    SimdDouble stretch[3];  // signed; the third has the smallest magnitude
    SimdVec3 u[3];          // current principal directions
    SimdMat3 rotation;      // R

    explicit Polar(const SimdMat3& f) {
        SimdVec3 b[3] = {
            {f.at[0], f.at[3], f.at[6]}, {f.at[1], f.at[4], f.at[7]}, {f.at[2], f.at[5], f.at[8]}};
        const SimdDouble one(1.0), zero(0.0);
        SimdVec3 v[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
        for (int sweep = 0; sweep < sweeps; ++sweep) {
            bool turned = false;
            for (const auto& [i, j] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}})
                turned |= orthogonalize(b[i], b[j], v[i], v[j]);
            if (!turned) break;
        }
        SimdDouble squared[3] = {squared_norm(b[0]), squared_norm(b[1]), squared_norm(b[2])};
        for (const auto& [i, j] : {std::pair{0, 2}, std::pair{1, 2}, std::pair{0, 1}})
            larger_first(squared[i], squared[j], b[i], b[j], v[i], v[j]);
        directions(b);
        stretch[0] = dot(u[0], b[0]);
        stretch[1] = dot(u[1], b[1]);
        stretch[2] = dot(u[2], b[2]);
        rotation = outer(u[0], v[0]) + outer(u[1], v[1]) + outer(u[2], v[2]);
    }

    SimdDouble trace() const { return stretch[0] + stretch[1] + stretch[2]; }

  private:
    static constexpr int sweeps = 6;

    // Rotates two columns so that they become orthogonal; returns true if any lane was rotated. Lanes that are
    // orthogonal already stay unchanged, whatever the others do.
    static bool orthogonalize(SimdVec3& a, SimdVec3& b, SimdVec3& va, SimdVec3& vb) {
        const SimdDouble of_a = squared_norm(a), of_b = squared_norm(b), gamma = SimdDouble(2.0) * dot(a, b);
        const SimdDouble negligible = gamma * gamma - SimdDouble(1e-30) * of_a * of_b;
        if (none_positive(negligible)) return false;
        const SimdDouble delta = of_b - of_a;
        const SimdDouble root = sqrt(delta * delta + gamma * gamma) + SimdDouble(1e-300);
        const SimdDouble wanted =
            where_negative(delta, SimdDouble(-1.0) * gamma, gamma) / (abs(delta) + root);
        const SimdDouble tangent = where_negative(negligible, SimdDouble(0.0), wanted);
        const SimdDouble c = SimdDouble(1.0) / sqrt(SimdDouble(1.0) + tangent * tangent), s = c * tangent;
        rotate(c, s, a, b);
        rotate(c, s, va, vb);
        return true;
    }

    static bool none_positive(const SimdDouble& a) {
        bool none = true;
        for (int lane = 0; lane < SimdDouble::width; ++lane) none &= !(a[lane] > 0.0);
        return none;
    }

    static void rotate(const SimdDouble& c, const SimdDouble& s, SimdVec3& a, SimdVec3& b) {
        const SimdVec3 turned = c * a - s * b;
        b = s * a + c * b;
        a = turned;
    }

    // Swaps two columns where the first is shorter, by a rotation of 90 degrees, which keeps V a rotation.
    static void larger_first(SimdDouble& sa, SimdDouble& sb, SimdVec3& a, SimdVec3& b, SimdVec3& va,
                             SimdVec3& vb) {
        const SimdDouble swap = where_negative(sa - sb, SimdDouble(1.0), SimdDouble(0.0)),
                         stay = SimdDouble(1.0) - swap;
        const SimdDouble larger = max(sa, sb);
        sb = sa + sb - larger;
        sa = larger;
        rotate(stay, -swap, a, b);
        rotate(stay, -swap, va, vb);
    }

    void directions(const SimdVec3 b[3]) {
        const SimdDouble length = sqrt(squared_norm(b[0]));
        u[0] = (SimdDouble(1.0) / length) * b[0];
        const SimdVec3 across = b[1] - dot(u[0], b[1]) * u[0];
        const SimdDouble width = sqrt(squared_norm(across));
        u[1] = (SimdDouble(1.0) / width) * across;
        u[2] = cross(u[0], u[1]);
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            // the element is a line or a point
            if (length[lane] > 0.0 && width[lane] > 1e-15 * length[lane]) continue;
            Vec3 first(b[0].x[lane], b[0].y[lane], b[0].z[lane]), second;
            first = length[lane] > 0.0 ? Vec3(first / first.norm()) : Vec3(Vec3::UnitX());
            second = first.unitOrthogonal();
            const Vec3 all[3] = {first, second, first.cross(second)};
            for (int k = 0; k < 3; ++k) {
                u[k].x.set(lane, all[k].x());
                u[k].y.set(lane, all[k].y());
                u[k].z.set(lane, all[k].z());
            }
        }
    }
};

}  // namespace magshell
