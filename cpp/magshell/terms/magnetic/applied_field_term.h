// AppliedFieldTerm: the base class of terms of magnetized bodies in the applied field.
#pragma once

#include <vector>

#include "magshell/terms/term.h"

namespace magshell {

class AppliedFieldTerm : public Term {
  public:
    /// Adds the points [m] and magnetic moments [A m2] with which the term is in the applied field: that of a source with the flux density B
    /// pulls each with the force (dB/dx)^T m, and turns it with m x B.
    virtual void add_moments(const double* q, const LoadParameters& load_parameters,
                             std::vector<Vec3>& points, std::vector<Vec3>& moments) const = 0;

    /// Returns true if the gradient is quadratic in the load parameters; else it is linear, as that of any term.
    virtual bool is_quadratic_in_loads() const { return false; }
};

}  // namespace magshell
