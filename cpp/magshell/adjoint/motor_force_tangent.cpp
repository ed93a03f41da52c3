#include "magshell/adjoint/motor_force_tangent.h"

#include "magshell/core/errors.h"
#include "magshell/solve/motion/motor_reactions.h"

namespace magshell {

VectorXd MotorForceTangent::at_end(const StepAlgebra& algebra, const StepRates& at, const StageTangent& last,
                                   const VectorXd& q_last, const ProximalTerm& there,
                                   const VectorXd& v_begin_tangent, const StageRates& rates_tangent,
                                   double dt_tangent, const ViscousTangent& strains,
                                   const ViscousTangent& joints) {
    const DofMap& dof_map = model_.dof_map();
    const Index coordinates = model_.n_coordinates();
    StageTangent stage = last;
    stage.contact_factor = 1.0;
    const MotionState& begin = stage.record.begin;
    derivatives_.set_stage(stage);
    const VectorXd& v_hat = stage.v_hat;
    const MotorReactions end(newton_, input_.inertia, begin, algebra, q_last, stage.load_parameters, there,
                             v_hat, at.all.back());
    if (!end.converged())
        throw InvalidInput(
            "the motor forces have no tangent in a step in which they could not be computed (NaN)");
    const ProximalTerm proximal = end.proximal();
    const VectorXd& q = end.q();
    const ForceTangent forces = derivatives_.forces(stage, q, false);
    newton_.evaluate(q, stage.load_parameters, proximal);
    VectorXd v = VectorXd::Zero(q.size());
    v.head(coordinates) = (q - stage.x_hat).head(coordinates) / stage.T;
    VectorXd residual = forces.gradient + solver_.inertia(stage, v, (v - v_hat) / stage.T) +
                        strains.forces(q, q.size()) + joints.forces(q, q.size());
    if (end.acceleration_change().size() > 0) {
        residual += along_.mass.cwiseProduct(end.acceleration_change());
        VectorXd change = VectorXd::Zero(q.size());
        if (end.is_first_step()) {
            change = end.contact_weight() * rates_tangent.c;
        } else {
            // The acceleration is homogeneous of degree -1 in the lengths of this substep and the one before.
            const VectorXd w = algebra.stage_acceleration(at.all.back(), v_hat);
            const VectorXd by_dt =
                -(end.acceleration_change() + w + begin.dt_before * end.change_by_dt_before()) / algebra.dt();
            change = end.weight_last() * rates_tangent.v + end.weight_begin() * v_begin_tangent +
                     end.weight_before() * v_before_ + dt_tangent * by_dt +
                     dt_before_tangent_ * end.change_by_dt_before() -
                     (rates_tangent.v - stage.v_hat_tangent - stage.T_tangent * w) / stage.T;
        }
        residual += input_.inertia.mass.cwiseProduct(change);
    }
    const VectorXd gradient = newton_.gradient(q, proximal);
    const PrescribedTangent change = derivatives_.prescribed(stage, q, gradient);
    const VectorXd q_tangent = solver_.solve(q, stage.load_parameters, proximal, change, residual, nullptr);
    // Assembles again, because the factorization has rotated the blocks of rotated nodes.
    newton_.evaluate(q, stage.load_parameters, proximal);
    model_.assemble(q, stage.load_parameters, false);
    model_.assemble_forces(stage.load_parameters);
    VectorXd found = dof_map.motor_forces(residual + solver_.product(q_tangent, *proximal.weights));
    found += derivative_.of(
        [&](double t) {
            Model& there = derivatives_.set(t, stage.load_parameters + t * stage.tangent);
            there.linearize(q + t * q_tangent);
            return there.dof_map().motor_forces(gradient);
        },
        derivatives_.step_along({{along_.length, largest(q_tangent)}}), 0.0, "the force of a motor");
    derivatives_.set(0.0, stage.load_parameters);
    model_.linearize(q);
    return found;
}

}  // namespace magshell
