#include "magshell/solve/response.h"

#include "magshell/core/errors.h"
#include "magshell/solve/unsymmetric.h"

namespace magshell {

VectorXd first_order_change(Model& model, const StaticsResult& equilibrium, const Controls& to) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium was found without keeping its factorization");
    const VectorXd& q = equilibrium.state;
    const Reduction& reduction = model.reduction();

    model.set_turns(equilibrium.turns);
    model.evaluate(q, to);
    VectorXd change = reduction.prescribed_increment(q, to);
    VectorXd force = model.residual().gradient;
    const bool moves = !change.isZero(0.0);
    if (moves || model.follows()) model.assemble(q, to, false);
    if (moves) {
        VectorXd pull(q.size());
        model.multiply(change, pull);
        model.remainder().add_product(change, false, pull);
        reduction.add_driven_forces(model.residual().gradient, change, pull);
        force += pull;
    }
    VectorXd reduced = -reduction.vector(force);
    solve_at_equilibrium(model, *equilibrium.factor, false, reduced);
    change += reduction.expand(reduced);
    return change;
}

}  // namespace magshell
