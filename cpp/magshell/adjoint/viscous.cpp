#include "magshell/adjoint/viscous.h"

namespace magshell {

ViscousAdjoint::ViscousAdjoint(Model& model, ViscousTerms& terms, const Viscosity& law,
                               ViscousStage::Kind kind, const StepAlgebra& step, const SubstepRecord& substep,
                               std::span<const LoadParameters> load_parameters, const ViscousGradient& by_end)
    : terms_(terms), unknowns_(model.size()), law_(law), kind_(kind), step_(step) {
    if (!law.any() || terms.empty()) return;
    model.set_angle_branches(substep.begin.angle_branches);
    model.parameters().set_time_varying(load_parameters.front());
    const StrainSet d_begin = terms.strains(substep.begin.q), zero = d_begin.times(0.0);
    rates_ = first_rates(model, step.tableau(), substep.begin);
    first_ = rates_.size();
    for (std::size_t i = 0; i < substep.stages.size(); ++i) {
        stages_.push_back(ViscousStage(law, step.stage_time(), step.dt(), step.tableau().a[i], rates_, kind,
                                       d_begin, substep.begin.e));
        model.set_angle_branches(substep.stages[i].angle_branches);
        model.parameters().set_time_varying(load_parameters[i + 1]);
        stages_.back().finish(law, step.stage_time(), terms.strains(substep.stages[i].q),
                              rates_.emplace_back().*kind);
    }
    const std::size_t n = substep.stages.size();
    const MaxwellStrains zeros(law.branches.size(), zero);
    by_d_hat_.assign(n, zero);
    by_e_.assign(n, zeros);
    by_e_hat_.assign(n, zeros);
    by_d_rate_.assign(rates_.size(), zero);
    by_e_rate_.assign(rates_.size(), zeros);
    by_ratio_.assign(n, std::vector<double>(law.branches.size(), 0.0));
    by_stage_time_.assign(n, 0.0);
    by_law.branches.assign(law.branches.size(), {0.0, 0.0});
    if (!by_end.e.empty()) by_e_.back() = by_end.e;
    if (!by_end.d_rate.empty()) by_d_rate_.back() = by_end.d_rate;
    if (!by_end.e_rate.empty()) by_e_rate_.back() = by_end.e_rate;
    by_d_begin = zero;
    by_begin.e = zeros;
}

void ViscousAdjoint::set_history(int i) const {
    if (!idle()) terms_.set_history(law_.scale(step_.stage_time()), &stages_[i].shift);
}

StrainSet ViscousAdjoint::before_solve(int i, VectorXd& by_q, Gradient& scene) {
    if (idle()) return {};
    const ViscousStage& stage = stages_[i];
    const StrainRates& rates = this->rates(first_ + i);
    const StrainSet& by_d_rate = by_d_rate_[first_ + i];
    const double T = step_.stage_time();
    StrainSet by_d = by_d_rate.times(1.0 / T);  // d' = (d - d^)/T
    by_d_hat_[i].add(-1.0 / T, by_d_rate);
    by_stage_time_[i] -= by_d_rate.dot(rates.d) / T;
    for (std::size_t k = 0; k < law_.branches.size(); ++k) {
        const double tau = law_.branches[k].time, r = law_.branches[k].ratio(T);
        const StrainSet& by_e_rate = by_e_rate_[first_ + i][k];
        StrainSet& by_e = by_e_[i][k];
        by_d.add(1.0 / tau, by_e_rate);  // e' = (d - e)/tau
        by_e.add(-1.0 / tau, by_e_rate);
        by_law.branches[k].time -= by_e_rate.dot(rates.e[k]) / tau;
        by_e_hat_[i][k].add(1.0 / (1.0 + r), by_e);  // e = (e^ + r d)/(1 + r)
        by_d.add(r / (1.0 + r), by_e);
        by_ratio_[i][k] += (by_e.dot(stage.d) - by_e.dot(stage.e_hat[k])) / ((1.0 + r) * (1.0 + r));
    }
    by_q += terms_.forces(by_d, unknowns_);
    terms_.strains_vjp(by_d, scene);
    return by_d;
}

void ViscousAdjoint::after_solve(int i, const VectorXd& lambda) {
    if (idle()) return;
    add_stress_gradient(i, stages_[i].d, lambda);
    for (std::size_t k = 0; k < law_.branches.size(); ++k) {
        const MaxwellBranch& branch = law_.branches[k];
        by_stage_time_[i] += by_ratio_[i][k] / branch.time;
        by_law.branches[k].time -= by_ratio_[i][k] * branch.ratio(step_.stage_time()) / branch.time;
    }
    by_dt += step_.tableau().diagonal * by_stage_time_[i];
    pass_on(i);
}

void ViscousAdjoint::at_nearby_state(int i, const VectorXd& q, const VectorXd& lambda) {
    if (!idle()) add_stress_gradient(i, terms_.strains(q), lambda);
}

// Adds the gradients through the stress; d: the strains at the evaluated state.
void ViscousAdjoint::add_stress_gradient(int i, const StrainSet& d, const VectorXd& lambda) {
    const ViscousStage& stage = stages_[i];
    const double T = step_.stage_time(), beta = law_.stiffness_damping;
    // The gradient of lambda . J^T C (scale d - shift).
    const StrainSet along = terms_.stresses(terms_.rates(lambda));
    const double by_scale = along.dot(d), by_d_share = -along.dot(stage.d_hat);
    by_d_hat_[i].add(-beta / T, along);
    by_law.stiffness_damping += (by_scale + by_d_share) / T;
    by_stage_time_[i] -= beta / (T * T) * (by_scale + by_d_share);
    for (std::size_t k = 0; k < law_.branches.size(); ++k) {
        const double r = law_.branches[k].ratio(T), relaxed = law_.branches[k].relaxed(T);
        const double by_relaxed = by_scale - along.dot(stage.e_hat[k]);
        by_e_hat_[i][k].add(-relaxed, along);
        by_law.branches[k].modulus += by_relaxed / (1.0 + r);
        by_ratio_[i][k] -= by_relaxed * relaxed / (1.0 + r);
    }
}

// Distributes the gradients with respect to d^_i = d + dt sum a_ij d'_j, and to e^_i. The part of the start of the step is complete after
// all stages.
void ViscousAdjoint::pass_on(int i) {
    const std::size_t branches = law_.branches.size();
    by_d_begin.add(1.0, by_d_hat_[i]);
    for (std::size_t k = 0; k < branches; ++k) by_begin.e[k].add(1.0, by_e_hat_[i][k]);
    for (std::size_t j = 0; j < first_ + i; ++j) {
        const double a = step_.tableau().a[i][j];
        by_d_rate_[j].add(a * step_.dt(), by_d_hat_[i]);
        by_dt += a * rates(j).d.dot(by_d_hat_[i]);
        for (std::size_t k = 0; k < branches; ++k) {
            by_e_rate_[j][k].add(a * step_.dt(), by_e_hat_[i][k]);
            by_dt += a * rates(j).e[k].dot(by_e_hat_[i][k]);
        }
    }
    if (i > 0 || first_ == 0) return;
    by_begin.d_rate = by_d_rate_.front();
    by_begin.e_rate = by_e_rate_.front();
}

}  // namespace magshell
