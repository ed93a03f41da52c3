// DampedTerm: terms with a viscous stress of their own, as dashpots have: joint dampers and springs.
//
// Within a stage of a time step the history of ElasticTerm::set_history makes the viscous stress
//
//   sigma = c (s - s^)/(a dt)
//
// which approximates c s' with the order of the time integrator and a symmetric matrix. strains() are the s, and stresses() the products c
// s.
#pragma once

#include "magshell/terms/shell/elastic_term.h"

namespace magshell {

class DampedTerm : public ElasticTerm {
  public:
    /// rates() returns ds/dt at q for node velocities v. rates_vjp() adds the gradients with respect to q, v and parameters
    /// of a function of these rates, given its gradient with respect to them.
    virtual Strains rates(const double* q, const double* v) const = 0;
    virtual void rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q,
                           VectorXd& by_v, Gradient& out) const = 0;

    /// Adds the magnitude [N] of the viscous forces that cancel in a stage. `beyond` [m] is how much larger the
    /// coordinates are than in the reference shape.
    virtual void add_cancelling_stage_forces(double beyond, VectorXd& out) const = 0;
};

}  // namespace magshell
