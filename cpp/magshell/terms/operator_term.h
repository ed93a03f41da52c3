// OperatorTerm: the base class of terms whose Hessian couples all of their nodes with full rank, as the magnetic field of the bodies
// themselves does. It is never assembled but multiplied with (linalg/operator_factor.h).
#pragma once

#include <memory>

#include "magshell/assembly/hessian_operator.h"
#include "magshell/terms/term.h"

namespace magshell {

class OperatorTerm : public Term {
  public:
    /// Returns the Hessian at q; nullptr if it is zero. It keeps its own copy of the state, because gradients need it after the solve.
    virtual std::shared_ptr<const HessianOperator> hessian_operator(
        const double* q, const LoadParameters& load_parameters) const = 0;
};

}  // namespace magshell
