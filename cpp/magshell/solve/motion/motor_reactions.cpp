#include "magshell/solve/motion/motor_reactions.h"

#include <limits>

namespace magshell {

MotorReactions::MotorReactions(Newton& newton, const Inertia& inertia, const MotionState& begin,
                               const StepAlgebra& step, const VectorXd& q,
                               const LoadParameters& load_parameters, const ProximalTerm& proximal,
                               const VectorXd& v_hat, const StageRates& last)
    : newton_(newton), proximal_(proximal), q_(q), target_(*proximal.target) {
    Model& model = newton_.model();
    model.contacts().set_factor(1.0);
    const auto move_target = [&] {
        const VectorXd pull = inertia.mass.cwiseProduct(change_);
        target_ -=
            (proximal.weights->array() != 0.0).select(pull.array() / proximal.weights->array(), 0.0).matrix();
    };
    if (begin.dt_before == 0.0) {
        if (last.c.size() > 0) {
            contact_weight_ = 1.0 - step.tableau().contact_factor(step.tableau().stages - 1);
            change_ = contact_weight_ * last.c;
            move_target();
        }
        newton_.evaluate(q_, load_parameters, this->proximal());
        return;
    }
    const double dt = step.dt(), r = dt / begin.dt_before;
    weight_last_ = (1.0 + 2.0 * r) / (1.0 + r) / dt;
    weight_begin_ = -(1.0 + r) / dt;
    weight_before_ = r * r / (1.0 + r) / dt;
    change_ = weight_last_ * last.v + weight_begin_ * begin.v + weight_before_ * begin.v_before -
              step.stage_acceleration(last, v_hat);
    const double square = (1.0 + r) * (1.0 + r);
    by_dt_before_ = -r / (begin.dt_before * dt) *
                    (last.v / square - begin.v + (2.0 * r + r * r) / square * begin.v_before);
    move_target();
    const Model::AngleBranches angle_branches = model.angle_branches();
    converged_ = solve(load_parameters);
    model.set_angle_branches(angle_branches);
}

// Solves for the state. It is so near the end of the step that GMRES with the last factorization usually suffices.
bool MotorReactions::solve(const LoadParameters& load_parameters) {
    constexpr int most_steps = 4;  // GMRES steps before Newton takes over; see test_motor_outputs_of_a_motion
    Model& model = newton_.model();
    const ProximalTerm proximal = this->proximal();
    const VectorXd from = q_;
    const Model::AngleBranches angle_branches = model.angle_branches();
    newton_.evaluate(q_, load_parameters, proximal);
    for (int k = 0; k <= most_steps; ++k) {
        if (newton_.relative_residual(q_, proximal) <= newton_.options().tolerance) return true;
        const std::shared_ptr<Factor> nearby = newton_.factor();
        if (k == most_steps || !nearby || nearby->pattern() != model.dof_map().pattern()) break;
        VectorXd step = -newton_.gradient(q_, proximal);
        if (!newton_.solve_gmres_adjoint(q_, load_parameters, proximal, *nearby, step).converged) break;
        model.dof_map().retract(q_, step);
        newton_.evaluate(q_, load_parameters, proximal);
    }
    q_ = from;
    model.set_angle_branches(angle_branches);
    return newton_.solve(q_, load_parameters, {.proximal = proximal}).converged;
}

// Returns the motor forces. At large stiffness the residual that is left exceeds what positions can resolve, so its effect on the
// forces is removed to first order.
VectorXd MotorReactions::motor_forces(const LoadParameters& load_parameters) {
    Model& model = newton_.model();
    VectorXd force = newton_.gradient(q_, proximal());
    if (!converged_)
        return VectorXd::Constant(model.dof_map().motor_forces(force).size(),
                                  std::numeric_limits<double>::quiet_NaN());
    VectorXd left = force, pull(q_.size());
    const std::shared_ptr<Factor> nearby = newton_.factor();
    if (nearby && nearby->pattern() == model.dof_map().pattern() &&
        newton_.solve_gmres_adjoint(q_, load_parameters, proximal(), *nearby, left).converged) {
        model.multiply(left, pull);
        model.nonsymmetric_tangent().add_product(left, true, pull);
        force -= pull + proximal_.weights->cwiseProduct(left);
    }
    return model.dof_map().motor_forces(force);
}

}  // namespace magshell
