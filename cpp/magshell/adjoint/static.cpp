#include "magshell/adjoint/static.h"

#include "magshell/core/errors.h"
#include "magshell/solve/unsymmetric.h"

namespace magshell {

Gradient pull_back(Model& model, const StaticsResult& equilibrium, const VectorXd& by_state,
                   const VectorXd& by_driving) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium was found without keeping its factorization");
    const VectorXd& q = equilibrium.state;
    const Controls& controls = equilibrium.controls;
    const Reduction& reduction = model.reduction();
    const bool drives = !by_driving.isZero(0.0);

    model.set_turns(equilibrium.turns);
    model.evaluate(q, controls);
    if (model.follows() || reduction.has_values()) model.assemble(q, controls, false);
    const auto add_product = [&](const VectorXd& motion, VectorXd& forces) {
        VectorXd product(q.size());
        model.multiply(motion, product);
        model.remainder().add_product(motion, true, product);
        forces += product;
    };
    VectorXd by_q = by_state, motors = VectorXd::Zero(q.size());
    if (drives) {
        motors = reduction.driving_motion(by_driving);
        add_product(motors, by_q);
    }
    VectorXd by_free = by_q;
    if (drives) reduction.add_driving_change(model.residual().gradient, by_driving, by_free);
    VectorXd reduced = -reduction.vector(by_free);
    solve_at_equilibrium(model, *equilibrium.factor, true, reduced);
    const VectorXd lambda = reduction.expand(reduced);
    Gradient gradient(model.registry());
    model.vjp(q, controls, lambda + motors, gradient);
    if (reduction.has_values()) {
        add_product(lambda, by_q);
        reduction.vjp(by_q, lambda, model.residual().gradient, controls, gradient,
                      drives ? by_driving : VectorXd());
    }
    return gradient;
}

}  // namespace magshell
