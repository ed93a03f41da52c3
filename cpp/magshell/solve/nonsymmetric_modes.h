// Eigenvalues near zero of a nonsymmetric tangent, which decide about the stability of equilibria under forces without potential.
//
// A motion against friction, M dx/dt = -K x with the area metric M, comes back if all eigenvalues of K v = lambda M v have positive real
// parts. With K = S + N, S symmetric and N skew, they have if S is positive definite; if S is not, they are computed.
// Re lambda >= mu for every eigenvalue, with mu the lowest eigenvalue of S v = mu M v, since Re lambda = x* S x / x* M x (Bendixson). A real
// negative eigenvalue therefore lies within |mu| of zero, where shift-invert Arnoldi finds it [Saad 2011].
#pragma once

#include <complex>
#include <vector>

#include "magshell/solve/newton/newton.h"

namespace magshell {

struct NonsymmetricMode {
    std::complex<double> eigenvalue;  // [N/m3]; of a pair only that with the positive imaginary part
    VectorXd shape;                   // of all dofs, largest displacement 1; the real part if complex
};

/// The eigenvalues within a radius around zero.
struct NonsymmetricSpectrum {
    std::vector<NonsymmetricMode> modes;  // converged, from the smallest eigenvalue on
    bool complete = false;                // whether all within the radius have converged
    Index unstable_directions = 0;        // those of the converged ones with a negative real part
};

/// Computes the eigenvalues within `radius` [N/m3] around zero, and at least the nearest one, by block Arnoldi iteration with the inverse
/// of the tangent, by GMRES with the last factorization. transposed: of K^T.
NonsymmetricSpectrum spectrum_near_zero(Newton& newton, double radius, bool transposed = false);

/// Returns the number of unstable directions at the state factorized last, with this report: the number of negative pivots of a symmetric
/// tangent; of a nonsymmetric one the number of eigenvalues with a negative real part and no larger than the lowest eigenvalue of its
/// symmetric part, which includes all real ones. If they cannot be computed, the negative pivots of the symmetric part.
Index count_unstable_directions(Newton& newton, const FactorReport& factor);

}  // namespace magshell
