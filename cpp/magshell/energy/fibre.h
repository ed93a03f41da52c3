// FibreLaw: energy and tension of a muscle's fibres at an integration point of an element with N nodes.
//
//   E_p = V_p w psi(l, a),   l = |F m|,  F m = sum alpha_k x_k = y,  alpha_k = g_k . m                       [J]
//
//   target stretch   psi = (l - r)^2/2, r = 1 - a                                         Du et al. 2021 (DiffPD)
//   active stress    psi = a l^2/2, P = w a (F m) m^T                                     Lee et al. 2018, [Qiao21]
//   Hill             psi = a int f_L dl + int f_P dl; in motion also the force a f_L (f_V - 1)
//
// with the stretch l, the strength w [Pa] and the activation a. With T = psi' the tension over w, n = y/l and
// T/l where l > 0:
//
//   dE/dx_k = V_p w alpha_k T n,     d2E/dx_k dx_l = V_p w alpha_k alpha_l (T/l (I - n n^T) + T' n n^T)
//
// Nothing depends on det F, so flat and inverted elements need no special care. Where l = 0, n is set to zero,
// its mean over all directions, and T/l to T'. One element per SIMD lane.
#pragma once

#include "magshell/core/simd_functions.h"
#include "magshell/core/vector3.h"
#include "magshell/energy/fibre_curve.h"
#include "magshell/strain/deformation.h"
#include "magshell/strain/push_forward.h"

namespace magshell {

enum class FibreForm { target_stretch, active_stress, hill };

/// The law of a fibre of unit strength.
struct FibreLaw {
    FibreForm form = FibreForm::active_stress;
    FibreCurve force_length, passive;  // f_L(l), f_P(l)
    FibreCurve force_velocity;         // f_V(u), u: rate of l over its largest; empty: 1

    struct Response {
        SimdDouble energy, tension, slope;  // psi, T, T'
        SimdDouble by_activation;           // dT/da
    };

    Response at(const SimdDouble& length, const SimdDouble& activation) const {
        if (form == FibreForm::target_stretch) {
            const SimdDouble off = length - SimdDouble(1.0) + activation;
            return {SimdDouble(0.5) * off * off, off, SimdDouble(1.0), SimdDouble(1.0)};
        }
        if (form == FibreForm::active_stress)
            return {SimdDouble(0.5) * activation * length * length, activation * length, activation, length};
        Response all;
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const FibreCurve::Sample active = force_length.at(length[lane]);
            const FibreCurve::Sample rest =
                passive.empty() ? FibreCurve::Sample{0.0, 0.0, 0.0} : passive.at(length[lane]);
            const double a = activation[lane];
            all.energy.set(lane, a * active.integral + rest.integral);
            all.tension.set(lane, a * active.value + rest.value);
            all.slope.set(lane, a * active.slope + rest.slope);
            all.by_activation.set(lane, active.value);
        }
        return all;
    }

    /// Returns f_V - 1 and its slope.
    FibreCurve::Sample excess_over_isometric(double rate) const {
        FibreCurve::Sample sample = force_velocity.at(rate);
        sample.value -= 1.0;
        return sample;
    }
};

/// The current vector y of a fibre, its direction n and its stretch.
struct DeformedFibre {
    SimdVec3 y, n;
    SimdDouble length, inverse;  // l, and 1/l, which is zero where l is

    explicit DeformedFibre(const SimdVec3& pushed_forward)
        : y(pushed_forward), length(sqrt(squared_norm(pushed_forward))) {
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            inverse.set(lane, length[lane] > 0.0 ? 1.0 / length[lane] : 0.0);
        n = inverse * y;
    }

    /// Returns T/l, or T' where l is zero.
    SimdDouble over_length(const FibreLaw::Response& law) const {
        return law.tension * inverse + (SimdDouble(1.0) - length * inverse) * law.slope;
    }

    /// Returns along n n^T + across (I - n n^T).
    SimdMat3 stiffness(const SimdDouble& along, const SimdDouble& across) const {
        SimdMat3 m = outer((along - across) * n, n);
        add_to_diagonal(m, across);
        return m;
    }
    /// Returns the part of v perpendicular to the fibre.
    SimdVec3 across(const SimdVec3& v) const { return v - dot(n, v) * n; }
};

}  // namespace magshell
