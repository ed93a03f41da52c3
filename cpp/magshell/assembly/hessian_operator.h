// HessianOperator: a part of a Hessian that couples all nodes with all others, such as the field of a magnetized sheet does. It is never
// assembled; linalg/operator_factor.h multiplies by it in GMRES.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

class HessianOperator {
  public:
    virtual ~HessianOperator() = default;

    /// Adds the product with x to y, both of all dofs.
    virtual void add_product(const VectorXd& x, VectorXd& y) const = 0;
};

}  // namespace magshell
