// Neo-Hookean laws that have no energy for inverted elements, by their measure of volume change.
//
//   ln J        mu/2 (I1 - 3) - mu ln J              + lam/2 (ln J)^2
//   J           mu/2 (I1 - 3) - mu ln J              + lam/2 (J - 1)^2
//   isochoric   mu/2 (J^(-2/3) I1 - 3)               + K/2 (J - 1)^2,   K = lam + 2/3 mu
//
// The last summand may be evaluated at the mean J of an element.
#pragma once

#include "magshell/core/pack_functions.h"
#include "magshell/energy/invariant_solid.h"

namespace magshell {

/// Returns mu/2 (I1 - 3) - mu ln J and its derivatives.
inline InvariantDerivatives shear_and_logarithm(const Pack& mu, const Pack& i1, const Pack& j) {
    const Pack inverse = Pack(1.0) / j, half = Pack(0.5) * mu;
    return {half * (i1 - Pack(3.0)) - mu * log(j),
            half,
            -mu * inverse,
            Pack(0.0),
            Pack(0.0),
            mu * inverse * inverse};
}

/// Returns k/2 (v - 1)^2 and its derivatives.
inline Volumetric quadratic_volume(const Pack& k, const Pack& v) {
    const Pack change = v - Pack(1.0);
    return {Pack(0.5) * k * change * change, k * change, k};
}

struct NeoHookeanLogarithm {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const Pack c[], const Pack& i1, const Pack& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const Pack c[], const Pack& j) {
        const Pack ln = log(j), inverse = Pack(1.0) / j;
        return {Pack(0.5) * c[0] * ln * ln, c[0] * ln * inverse, c[0] * (Pack(1.0) - ln) * inverse * inverse};
    }
};

struct NeoHookeanVolume {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const Pack c[], const Pack& i1, const Pack& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const Pack c[], const Pack& j) { return quadratic_volume(c[0], j); }
};

struct NeoHookeanIsochoric {
    static constexpr bool refuses_inversion = true, constant_shear = false;

    static InvariantDerivatives derivatives(const Pack c[], const Pack& i1, const Pack& j) {
        const Pack inverse = Pack(1.0) / j, root = cbrt(inverse), half = Pack(0.5) * c[1] * root * root;
        const Pack by_ij = Pack(-2.0 / 3.0) * half * inverse, by_j = by_ij * i1;
        return {half * i1 - Pack(1.5) * c[1],     half, by_j, Pack(0.0), by_ij,
                Pack(-5.0 / 3.0) * by_j * inverse};
    }
    static Volumetric volumetric(const Pack c[], const Pack& j) {
        return quadratic_volume(c[0] + Pack(2.0 / 3.0) * c[1], j);
    }
};

}  // namespace magshell
