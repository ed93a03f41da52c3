#include "magshell/adjoint/static.h"

#include "magshell/core/errors.h"
#include "magshell/solve/unsymmetric.h"

namespace magshell {

Gradient pull_back(Model& model, const StaticsResult& equilibrium, const VectorXd& by_state) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium was found without keeping its factorization");
    const VectorXd& q = equilibrium.state;
    const Controls& controls = equilibrium.controls;
    const Reduction& reduction = model.reduction();

    model.set_turns(equilibrium.turns);
    model.evaluate(q, controls);
    if (model.follows() || reduction.has_values()) model.assemble(q, controls, false);
    VectorXd reduced = -reduction.vector(by_state);
    solve_at_equilibrium(model, *equilibrium.factor, true, reduced);
    const VectorXd lambda = reduction.expand(reduced);
    Gradient gradient(model.registry());
    model.vjp(q, controls, lambda, gradient);
    if (reduction.has_values()) {
        VectorXd reaction(q.size());
        model.multiply(lambda, reaction);
        model.remainder().add_product(lambda, true, reaction);
        reaction += by_state;
        reduction.vjp(reaction, lambda, model.residual().gradient, controls, gradient);
    }
    return gradient;
}

}  // namespace magshell
