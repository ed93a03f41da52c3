// RoughHessianOperator: a HessianOperator that can also be multiplied with in less time, but only nearly. plain-words: ok, of products
#pragma once

#include "magshell/assembly/hessian_operator.h"

namespace magshell {

class RoughHessianOperator : public HessianOperator {  // plain-words: ok
  public:
    /// Adds nearly the product with x to y, for linear solves that need not be exact.
    virtual void add_rough_product(const VectorXd& x, VectorXd& y) const = 0;  // plain-words: ok
};

}  // namespace magshell
