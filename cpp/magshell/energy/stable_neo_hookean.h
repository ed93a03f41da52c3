// Stable neo-Hookean laws, which stay finite for flat and inverted elements and restore them.
//
//   Smith, de Goes, Kim 2018, without the barrier, split into w + U with all of lam in U:
//       mu/2 (I1 - 3) - mu (J - 1) + mu/2 (J - 1)^2     + lam/2 (J - 1)^2
//   with their logarithmic barrier (14), reparametrized so that small strains have the moduli lam and mu:
//       m/2 (I1 - 3) + l/2 (J - a)^2 - m/2 ln(I1 + 1),   m = 4/3 mu,  l = lam + 5/6 mu,  a = 1 + m/l - m/(4 l)
//   minus its reference value, and with l (J - a) = l (J - 1) - mu:
//       m/2 (I1 - 3) - m/2 ln((I1 + 1)/4) - mu (J - 1) + 5/12 mu (J - 1)^2     + lam/2 (J - 1)^2
#pragma once

#include "magshell/core/pack_functions.h"
#include "magshell/energy/invariant_solid.h"
#include "magshell/energy/neo_hookean.h"

namespace magshell {

struct StableNeoHookean {
    static constexpr bool refuses_inversion = false, constant_shear = true;

    static InvariantDerivatives derivatives(const Pack c[], const Pack& i1, const Pack& j) {
        const Pack &mu = c[1], change = j - Pack(1.0), half = Pack(0.5) * mu;
        return {half * (i1 - Pack(3.0)) - mu * change + half * change * change,
                half,
                mu * (change - Pack(1.0)),
                Pack(0.0),
                Pack(0.0),
                mu};
    }
    static Volumetric volumetric(const Pack c[], const Pack& j) { return quadratic_volume(c[0], j); }
};

struct StableNeoHookeanBarrier {
    static constexpr bool refuses_inversion = false, constant_shear = false;

    static InvariantDerivatives derivatives(const Pack c[], const Pack& i1, const Pack& j) {
        const Pack half = Pack(2.0 / 3.0) * c[1], above = i1 + Pack(1.0), inverse = Pack(1.0) / above;
        const Pack change = j - Pack(1.0), resists = Pack(5.0 / 6.0) * c[1];
        return {half * (i1 - Pack(3.0) - log(Pack(0.25) * above)) +
                    (Pack(0.5) * resists * change - c[1]) * change,
                half * (Pack(1.0) - inverse),
                resists * change - c[1],
                half * inverse * inverse,
                Pack(0.0),
                resists};
    }
    static Volumetric volumetric(const Pack c[], const Pack& j) { return quadratic_volume(c[0], j); }
};

}  // namespace magshell
