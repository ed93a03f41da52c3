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

// RoughHessianOperator: a HessianOperator that can also be multiplied with in less time, but only nearly. plain-words: ok, of products
class RoughHessianOperator : public HessianOperator {  // plain-words: ok
  public:
    /// Adds nearly the product with x to y, for linear solves that need not be exact.
    virtual void add_rough_product(const VectorXd& x, VectorXd& y) const = 0;  // plain-words: ok
    /// Returns whether it differs from the exact product.
    virtual bool is_rough() const = 0;  // plain-words: ok, of products
};

}  // namespace magshell
