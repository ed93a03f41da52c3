// Neo-Hookean laws that have no energy for inverted elements, by their measure of volume change.
//
//   ln J        mu/2 (I1 - 3) - mu ln J              + lam/2 (ln J)^2
//   J           mu/2 (I1 - 3) - mu ln J              + lam/2 (J - 1)^2
//   isochoric   mu/2 (J^(-2/3) I1 - 3)               + K/2 (J - 1)^2,   K = lam + 2/3 mu
//
// The last summand may be evaluated at the mean J of an element.
#pragma once

#include "magshell/core/simd_functions.h"
#include "magshell/energy/invariant_solid.h"

namespace magshell {

/// Returns mu/2 (I1 - 3) - mu ln J and its derivatives.
inline InvariantDerivatives shear_and_logarithm(const SimdDouble& mu, const SimdDouble& i1,
                                                const SimdDouble& j) {
    const SimdDouble inverse = SimdDouble(1.0) / j, half = SimdDouble(0.5) * mu;
    return {half * (i1 - SimdDouble(3.0)) - mu * log(j),
            half,
            -mu * inverse,
            SimdDouble(0.0),
            SimdDouble(0.0),
            mu * inverse * inverse};
}

/// Returns k/2 (v - 1)^2 and its derivatives.
inline Volumetric quadratic_volume(const SimdDouble& k, const SimdDouble& v) {
    const SimdDouble change = v - SimdDouble(1.0);
    return {SimdDouble(0.5) * k * change * change, k * change, k};
}

struct NeoHookeanLogarithm {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        const SimdDouble ln = log(j), inverse = SimdDouble(1.0) / j;
        return {SimdDouble(0.5) * c[0] * ln * ln, c[0] * ln * inverse,
                c[0] * (SimdDouble(1.0) - ln) * inverse * inverse};
    }
};

struct NeoHookeanVolume {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0], j);
    }
};

struct NeoHookeanIsochoric {
    static constexpr bool refuses_inversion = true, constant_shear = false;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        const SimdDouble inverse = SimdDouble(1.0) / j, root = cbrt(inverse),
                         half = SimdDouble(0.5) * c[1] * root * root;
        const SimdDouble by_ij = SimdDouble(-2.0 / 3.0) * half * inverse, by_j = by_ij * i1;
        return {half * i1 - SimdDouble(1.5) * c[1],     half, by_j, SimdDouble(0.0), by_ij,
                SimdDouble(-5.0 / 3.0) * by_j * inverse};
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0] + SimdDouble(2.0 / 3.0) * c[1], j);
    }
};

}  // namespace magshell
