// StressRateTerm: terms with an energy E(d(q)) of strains d, whose stresses s = dE/dd linear buckling lets grow.
//
//   K_s = sum_i s'_i d2d_i/dq2,   s' = (d2E/dd2) J u          J = dd/dq
//
// s' are the rates of the stresses as the state moves at the rates u. The rest of the derivative of the Hessian along u, in which J changes, is
// left out: it belongs to the curvature of the path, which linear theory does not have (solve/linear of the Python package).
//
// The derivatives of v . K_s v come in two parts: those at fixed J u, which are derivatives of v . g as stresses are held, and those through J u,
// which are the rate along u of the derivatives of W(q) = s(q) . c with the strain curvatures c = d2d/dq2 [v, v] fixed.
#pragma once

#include "magshell/assembly/out_of_balance.h"
#include "magshell/core/parameters.h"
#include "magshell/terms/shell/strains.h"

namespace magshell {

class StressRateTerm {
  public:
    /// Holds the stresses at their rates s' as the last evaluated state moves at the rates p, or at zero if p is nullptr. Until
    /// release_stresses(), at any state: the gradient is J^T s', the Hessian K_s, and vjp() the derivative at fixed strain rates J u.
    virtual void freeze_stress_rates(const double* p) = 0;
    virtual void release_stresses() = 0;

    /// Returns true if the following functions are implemented.
    virtual bool has_stress_work_vjp() const { return false; }
    /// Returns the strain rates J p at the last evaluated state.
    virtual Strains strain_rates(const double* /*p*/) { return Strains(); }
    /// Adds the derivatives of W at q by q, by parameters, and by the rest shape if by_rest is not nullptr. The last evaluate() was at q.
    virtual void add_stress_work_vjp(const double* /*q*/, const Strains& /*curvatures*/, Residual& /*by_q*/,
                                     Gradient& /*out*/, VectorXd* /*by_rest*/) {}

  protected:
    ~StressRateTerm() = default;
};

}  // namespace magshell
