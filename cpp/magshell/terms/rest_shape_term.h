// RestShapeTerm: the interface of terms that read the rest shape of bodies and have a derivative with respect to it.
#pragma once

#include "magshell/core/parameters.h"
#include "magshell/terms/shell/strains.h"

namespace magshell {

class RestShapeTerm {
  public:
    /// Adds lambda . dg/dX, three numbers per node, at the last evaluated state q. The last vjp() of the term had the same arguments.
    virtual void add_rest_vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                              VectorXd& out) = 0;
    /// Adds s . dd/dX of the strains d at the last evaluated state, as ElasticTerm::strains_vjp() does for parameters.
    virtual void add_rest_strains_vjp(const Strains& /*stresses*/, VectorXd& /*out*/) const {}

  protected:
    ~RestShapeTerm() = default;
};

}  // namespace magshell
