#include "magshell/adjoint/viscous.h"

namespace magshell {

ViscousAdjoint::ViscousAdjoint(Model& model, const Viscosity& law, const StepAlgebra& step,
                               const MotionState& begin, const std::vector<StageState>& stages,
                               const SheetStrains& by_e)
    : model_(model), law_(law), step_(step) {
    if (!law.any()) return;
    const SheetStrains d_begin = model.strains(begin.q);
    for (std::size_t i = 0; i < stages.size(); ++i) {
        stages_.push_back(
            ViscousStage(law, step.stage_time(), step.dt(), step.tableau().a[i], stages_, d_begin, begin.e));
        stages_.back().finish(law, step.stage_time(), model.strains(stages[i].q));
    }
    const std::size_t n = stages.size();
    const SheetStrains zero = d_begin.times(0.0);
    by_d_rate_.assign(n, zero);
    by_d_hat_.assign(n, zero);
    by_e_.assign(n, zero);
    by_e_rate_.assign(n, zero);
    by_e_hat_.assign(n, zero);
    by_ratio_.assign(n, 0.0);
    by_stage_time_.assign(n, 0.0);
    if (!by_e.empty()) by_e_.back() = by_e;
    by_d_begin = by_e_begin = zero;
}

double ViscousAdjoint::dot(const SheetStrains& a, const SheetStrains& b) const {
    return a.dot(b, model_.sheet().n_faces());
}

void ViscousAdjoint::set_history(int i) const {
    if (law_.any()) model_.set_history(law_.scale(step_.stage_time()), &stages_[i].shift);
}

void ViscousAdjoint::before_solve(int i, VectorXd& by_q) {
    if (!law_.any()) return;
    const ViscousStage& stage = stages_[i];
    const double T = step_.stage_time();
    SheetStrains by_d = by_d_rate_[i].times(1.0 / T);  // d' = (d - d^)/T
    by_d_hat_[i].add(-1.0 / T, by_d_rate_[i]);
    by_stage_time_[i] -= dot(by_d_rate_[i], stage.d_rate) / T;
    if (law_.maxwell()) {
        const double tau = law_.maxwell_time, r = law_.ratio(T);
        by_d.add(1.0 / tau, by_e_rate_[i]);  // e' = (d - e)/tau
        by_e_[i].add(-1.0 / tau, by_e_rate_[i]);
        by_law.maxwell_time -= dot(by_e_rate_[i], stage.e_rate) / tau;
        by_e_hat_[i].add(1.0 / (1.0 + r), by_e_[i]);  // e = (e^ + r d)/(1 + r)
        by_d.add(r / (1.0 + r), by_e_[i]);
        by_ratio_[i] += (dot(by_e_[i], stage.d) - dot(by_e_[i], stage.e_hat)) / ((1.0 + r) * (1.0 + r));
    }
    by_q += model_.strain_forces(by_d);
}

void ViscousAdjoint::after_solve(int i, const VectorXd& lambda) {
    if (!law_.any()) return;
    const ViscousStage& stage = stages_[i];
    const double T = step_.stage_time(), beta = law_.stiffness_damping;
    // lambda . J^T C (scale d - shift)
    const SheetStrains along = model_.stresses(model_.strain_rates(lambda));
    const double by_scale = dot(along, stage.d), by_d_share = -dot(along, stage.d_hat);
    by_d_hat_[i].add(-beta / T, along);
    by_law.stiffness_damping += (by_scale + by_d_share) / T;
    by_stage_time_[i] -= beta / (T * T) * (by_scale + by_d_share);
    if (law_.maxwell()) {
        const double r = law_.ratio(T), relaxed = law_.relaxed(T);
        const double by_relaxed = by_scale - dot(along, stage.e_hat);
        by_e_hat_[i].add(-relaxed, along);
        by_law.maxwell_modulus += by_relaxed / (1.0 + r);
        by_ratio_[i] -= by_relaxed * relaxed / (1.0 + r);
        by_stage_time_[i] += by_ratio_[i] / law_.maxwell_time;
        by_law.maxwell_time -= by_ratio_[i] * r / law_.maxwell_time;
    }
    by_dt += step_.tableau().diagonal() * by_stage_time_[i];
    pass_on(i, by_d_hat_[i], by_e_hat_[i]);
}

// d^_i = d + dt sum a_ij d'_j, and e^_i alike.
void ViscousAdjoint::pass_on(int i, const SheetStrains& by_d_hat, const SheetStrains& by_e_hat) {
    by_d_begin.add(1.0, by_d_hat);
    if (law_.maxwell()) by_e_begin.add(1.0, by_e_hat);
    for (int j = 0; j < i; ++j) {
        const double a = step_.tableau().a[i][j];
        by_d_rate_[j].add(a * step_.dt(), by_d_hat);
        by_dt += a * dot(stages_[j].d_rate, by_d_hat);
        if (!law_.maxwell()) continue;
        by_e_rate_[j].add(a * step_.dt(), by_e_hat);
        by_dt += a * dot(stages_[j].e_rate, by_e_hat);
    }
}

}  // namespace magshell
