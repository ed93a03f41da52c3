#include "magshell/solve/response.h"

#include "magshell/core/errors.h"

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
    if (!change.isZero(0.0)) {
        model.assemble(q, to, false);
        VectorXd pull(q.size());
        model.multiply(change, pull);
        force += pull;
    }
    VectorXd reduced = -reduction.vector(force);
    equilibrium.factor->solve(reduced);
    change += reduction.expand(reduced);
    return change;
}

}  // namespace magshell
