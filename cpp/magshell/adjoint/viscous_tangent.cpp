#include "magshell/adjoint/viscous_tangent.h"

#include <utility>

namespace magshell {

ViscousTangent::ViscousTangent(ViscousTerms& terms, const Viscosity& law, const Viscosity& law_tangent,
                               ViscousStage::Kind kind)
    : terms_(terms), law_(law), law_tangent_(law_tangent), kind_(kind), acts_(law.any() && !terms.empty()) {}

void ViscousTangent::begin(const StepAlgebra& step, double dt_tangent, StrainSet d, StrainSet d_tangent,
                           const MaxwellStrains& e, const MaxwellStrains& e_tangent, const StageRates* first,
                           const StageRates* first_tangent) {
    step_ = &step;
    dt_tangent_ = dt_tangent;
    d_begin_ = std::move(d);
    d_begin_tangent_ = std::move(d_tangent);
    e_begin_ = e;
    e_begin_tangent_ = e_tangent;
    rates_.clear();
    rate_tangents_.clear();
    if (!first) return;
    rates_.push_back(*first);
    rate_tangents_.push_back(*first_tangent);
}

double ViscousTangent::ratio_tangent(std::size_t k) const {
    const MaxwellBranch& branch = law_.branches[k];
    return (stage_time_tangent() - branch.ratio(step_->stage_time()) * law_tangent_.branches[k].time) /
           branch.time;
}

double ViscousTangent::relaxed_tangent(std::size_t k) const {
    const MaxwellBranch& branch = law_.branches[k];
    const double T = step_->stage_time();
    return (law_tangent_.branches[k].modulus - branch.relaxed(T) * ratio_tangent(k)) /
           (1.0 + branch.ratio(T));
}

void ViscousTangent::set_history(int i) {
    if (idle()) return;
    const double T = step_->stage_time(), dt = step_->dt(), beta = law_.stiffness_damping;
    const double* a = step_->tableau().a[i];
    now_ = ViscousStage(law_, T, dt, a, rates_, kind_, d_begin_, e_begin_);
    stage_ = ViscousStage();
    stage_.d_hat = d_begin_tangent_;
    stage_.e_hat = e_begin_tangent_;
    for (std::size_t j = 0; j < rates_.size(); ++j) {
        const StrainRates &rates = rates_[j].*kind_, &tangents = rate_tangents_[j].*kind_;
        stage_.d_hat.add(dt * a[j], tangents.d);
        stage_.d_hat.add(dt_tangent_ * a[j], rates.d);
        for (std::size_t k = 0; k < law_.branches.size(); ++k) {
            stage_.e_hat[k].add(dt * a[j], tangents.e[k]);
            stage_.e_hat[k].add(dt_tangent_ * a[j], rates.e[k]);
        }
    }
    const double share_tangent = (law_tangent_.stiffness_damping - beta / T * stage_time_tangent()) / T;
    scale_tangent_ = share_tangent;
    stage_.shift = stage_.d_hat.times(beta / T);
    stage_.shift.add(share_tangent, now_.d_hat);
    for (std::size_t k = 0; k < law_.branches.size(); ++k) {
        scale_tangent_ += relaxed_tangent(k);
        stage_.shift.add(law_.branches[k].relaxed(T), stage_.e_hat[k]);
        stage_.shift.add(relaxed_tangent(k), now_.e_hat[k]);
    }
    terms_.set_history(law_.scale(T), &now_.shift);
}

VectorXd ViscousTangent::forces(const VectorXd& q, Index unknowns) const {
    if (idle()) return VectorXd::Zero(unknowns);
    StrainSet change = terms_.strains(q).times(scale_tangent_);
    change.add(-1.0, stage_.shift);
    return terms_.forces(terms_.stresses(change), unknowns);
}

void ViscousTangent::finish(StrainSet d, const StrainSet& d_tangent) {
    if (idle()) return;
    const double T = step_->stage_time(), T_tangent = stage_time_tangent();
    StageRates& rates = rates_.emplace_back();
    now_.finish(law_, T, std::move(d), rates.*kind_);
    StrainRates& tangents = rate_tangents_.emplace_back().*kind_;
    tangents.d = d_tangent.times(1.0 / T);
    tangents.d.add(-1.0 / T, stage_.d_hat);
    tangents.d.add(-T_tangent / T, (rates.*kind_).d);
    for (std::size_t k = 0; k < law_.branches.size(); ++k) {
        const double tau = law_.branches[k].time, r = law_.branches[k].ratio(T);
        StrainSet& e = stage_.e.emplace_back(stage_.e_hat[k]);  // e = (e^ + r d)/(1 + r)
        e.add(r, d_tangent);
        e.add(ratio_tangent(k), now_.d);
        e.add(-ratio_tangent(k), now_.e[k]);
        e = e.times(1.0 / (1.0 + r));
        tangents.e.push_back(d_tangent.times(1.0 / tau));  // e' = (d - e)/tau
        tangents.e.back().add(-1.0 / tau, e);
        tangents.e.back().add(-law_tangent_.branches[k].time / tau, (rates.*kind_).e[k]);
    }
}

}  // namespace magshell
