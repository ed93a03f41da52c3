// ViscousStrain: strains and stresses of a solid's linear viscosity at a point, with the moduli of the
// reference configuration.
//
//   d = (E_00 E_11 E_22 2 E_12 2 E_02 2 E_01),   s_ii = 2 mu d_i + lam tr E,   s_ij = mu d_k
//
// so that s . d = S : E.
#pragma once

#include "magshell/energy/st_venant_kirchhoff.h"

namespace magshell {

struct ViscousStrain {
    static constexpr int size = 6;

    static void at(const SimdMat3& f, SimdDouble d[size]) {
        Green::strain(f, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void rate(const SimdMat3& f, const SimdMat3& along, SimdDouble d[size]) {
        Green::rate(f, along, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void stress(const RestModuli& moduli, const SimdDouble d[size], SimdDouble s[size]) {
        const SimdDouble pressure = moduli.lambda * (d[0] + d[1] + d[2]);
        for (int i = 0; i < 3; ++i) s[i] = SimdDouble(2.0) * moduli.mu * d[i] + pressure;
        for (int i = 3; i < size; ++i) s[i] = moduli.mu * d[i];
    }
    /// Returns the derivatives of stress(d) . rate by the moduli.
    static RestModuli work_by_moduli(const SimdDouble d[size], const SimdDouble rate[size]) {
        RestModuli by{(d[0] + d[1] + d[2]) * (rate[0] + rate[1] + rate[2]), SimdDouble(0.0)};
        for (int i = 0; i < 3; ++i) by.mu += SimdDouble(2.0) * d[i] * rate[i];
        for (int i = 3; i < size; ++i) by.mu += d[i] * rate[i];
        return by;
    }
};

}  // namespace magshell
