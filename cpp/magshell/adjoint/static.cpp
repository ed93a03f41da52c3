#include "magshell/adjoint/static.h"

#include "magshell/core/errors.h"
#include "magshell/solve/linear_response.h"

namespace magshell {

Gradient equilibrium_vjp(Model& model, const StaticsResult& equilibrium, const VectorXd& by_state,
                         const VectorXd& by_motor_forces, RestGradient& rest) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium has no factorization: it was solved without gradients");
    const VectorXd& q = equilibrium.state;
    const LoadParameters& load_parameters = equilibrium.load_parameters;
    const DofMap& dof_map = model.dof_map();
    const bool has_motor_gradient = !by_motor_forces.isZero(0.0);

    model.set_angle_branches(equilibrium.angle_branches);
    model.evaluate(q, load_parameters);
    if (needs_hessian(model, equilibrium) || dof_map.has_values() || rest.asked)
        model.assemble(q, load_parameters, false);
    // Adds H^T times a motion of all dofs.
    const auto add_product = [&](const VectorXd& motion, VectorXd& forces) {
        VectorXd product(q.size());
        model.multiply(motion, product);
        model.nonsymmetric_tangent().add_product(motion, true, product);
        forces += product;
    };
    VectorXd by_q = by_state, motors = VectorXd::Zero(q.size());
    // motors: B z of static.h, the motion along the prescribed joints, whose part of the adjoint needs no solve.
    if (has_motor_gradient) {
        motors = dof_map.motor_motion(by_motor_forces);
        add_product(motors, by_q);
    }
    VectorXd by_free = by_q;
    if (has_motor_gradient)
        dof_map.add_motor_force_change(model.residual().gradient, by_motor_forces, by_free);
    VectorXd reduced = -dof_map.vector(by_free);
    solve_at_equilibrium(model, equilibrium, true, reduced);
    const VectorXd lambda = dof_map.expand(reduced);
    Gradient gradient(model.parameters().registry());
    model.parameters().vjp(q, load_parameters, lambda + motors, gradient);
    // by_q: dF/dq + H lambda; its prescribed part acts on the values of supports and joints, and on rest positions.
    if (dof_map.has_values() || rest.asked) add_product(lambda, by_q);
    if (rest.asked) {
        rest.clear(model);
        rest.add(model, q, load_parameters, lambda + motors);
        rest.add_constrained(dof_map, by_q, lambda, model.residual().gradient, load_parameters,
                             has_motor_gradient ? by_motor_forces : VectorXd());
    }
    if (dof_map.has_values()) {
        dof_map.vjp(by_q, lambda, model.residual().gradient, load_parameters, gradient,
                    has_motor_gradient ? by_motor_forces : VectorXd());
    }
    return gradient;
}

}  // namespace magshell
