#include "magshell/adjoint/stage_tangent_solver.h"

#include <string>

#include "magshell/core/errors.h"
#include "magshell/solve/newton/unsymmetric.h"

namespace magshell {

VectorXd StageTangentSolver::product(const VectorXd& change, const VectorXd& weights) const {
    VectorXd forces(change.size());
    model_.multiply(change, forces);
    model_.nonsymmetric_tangent().add_product(change, false, forces);
    return forces + weights.cwiseProduct(change);
}

VectorXd StageTangentSolver::solve(const VectorXd& q, const LoadParameters& load_parameters,
                                   const ProximalTerm& proximal, const PrescribedTangent& change,
                                   VectorXd residual, const Factor* nearby) {
    newton_.watch(0.0);
    const DofMap& dof_map = model_.dof_map();
    VectorXd moved = change.motion();
    if (moved.size() == 0) moved = VectorXd::Zero(q.size());
    if (!moved.isZero(0.0)) {
        model_.assemble(q, load_parameters, false);
        model_.assemble_forces(load_parameters);
        VectorXd pull = product(moved, *proximal.weights);
        if (change.by_motors.size() > 0)
            dof_map.add_motor_increment_forces(newton_.gradient(q, proximal), change.by_motors, pull);
        residual += pull;
    }
    VectorXd reduced = -dof_map.vector(residual);
    if (change.reduced_residual.size() > 0) reduced -= change.reduced_residual;
    if (reduced.isZero(0.0)) return moved;
    const bool symmetric =
        !model_.capabilities().has_unsymmetric_tangent && !model_.capabilities().has_velocity_forces;
    if (nearby && symmetric && change.reduced_residual.size() == 0) {
        VectorXd solution = -residual;
        if (newton_.solve_gmres_adjoint(q, load_parameters, proximal, *nearby, solution).converged)
            return moved + solution;
    }
    Eigen::MatrixXd no_moves(q.size(), 0);
    const FactorReport factor = newton_.factorize(q, load_parameters, false, proximal, no_moves);
    if (!factor.succeeded)
        throw InvalidInput("the tangent of a time step cannot be computed: " + factor.reason);
    factorized_here_ = true;
    if (newton_.is_unsymmetric()) {
        const GmresReport report = solve_unsymmetric(model_, *newton_.factor(), false, to_round_off, reduced);
        if (!report.converged)
            throw InvalidInput(
                "a linear solve of the tangent of a time step did not converge: its relative residual "
                "is " +
                std::to_string(report.residual));
    } else {
        newton_.factor()->solve_approximately(reduced, to_round_off.tolerance);
    }
    return moved + dof_map.expand(reduced);
}

const Factor* StageTangentSolver::nearby_factor(const SubstepRecord& record, int i,
                                                const LoadParameters& load_parameters) {
    const StageState& stage = record.stages[i];
    if (stage.factor) return stage.factor.get();
    const bool serves = i > 0 && factorized_here_ && !model_.contacts().acts(stage.q, load_parameters);
    return serves ? newton_.factor().get() : nullptr;
}

VectorXd StageTangentSolver::inertia(const StageTangent& stage, const VectorXd& v, const VectorXd& w) const {
    const Inertia& inertia = input_.inertia;
    const VectorXd v_tangent = -(stage.x_hat_tangent + stage.T_tangent * v) / stage.T;
    const VectorXd w_tangent = (v_tangent - stage.v_hat_tangent - stage.T_tangent * w) / stage.T;
    return along_.mass.cwiseProduct(w) + inertia.mass.cwiseProduct(w_tangent) +
           along_.damping.cwiseProduct(v) + inertia.damping.cwiseProduct(v_tangent);
}

VectorXd StageTangentSolver::contact_acceleration(const StageTangent& stage, const VectorXd& q,
                                                  const VectorXd& q_tangent, const VectorXd& by_inputs,
                                                  const VectorXd& c) {
    const DofMap& dof_map = model_.dof_map();
    const VectorXd& mass = input_.inertia.mass;
    const VectorXd force = model_.contact_forces(q, stage.load_parameters) / stage.contact_factor;
    model_.multiply_contact_transposed(q, stage.load_parameters, q_tangent);  // assembles contact alone
    const VectorXd pull = product(q_tangent, VectorXd::Zero(q.size()));
    const VectorXd force_tangent = (by_inputs - pull) / stage.contact_factor;
    VectorXd found = dof_map.acceleration(mass, force_tangent - along_.mass.cwiseProduct(c));
    if (!dof_map.has_reduced_coordinates()) return found;
    found += rotation_derivative_.of(
        [&](double t) {
            Model& there = derivatives_.set(t, stage.load_parameters + t * stage.tangent);
            there.linearize(q + t * q_tangent);
            return there.dof_map().acceleration(mass, force);
        },
        derivatives_.step_along({{along_.length, largest(q_tangent)}}), 0.0, "the acceleration by contact");
    derivatives_.set(0.0, stage.load_parameters);
    model_.linearize(q);
    return found;
}

}  // namespace magshell
