#include "magshell/solve/motion/energy_balance.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

// [-] Gain that counts as none, over the energy that an impact can convert; see test_an_impact_gains_no_energy.
constexpr double tolerated_gain = 1e-3;
// [-] Error of the work put in, over the work, due to the quadrature between stages; see test_bodies_exchange_momentum_and_gain_no_energy.
constexpr double work_error = 0.1;
// [-] Round-off of the energies of a state, over their size; see test_an_impact_gains_no_energy.
constexpr double balance_round_off = 1e-11;

}  // namespace

double EnergyBalance::energy(const VectorXd& q, const Model::AngleBranches& angle_branches,
                             const LoadParameters& load_parameters) {
    model_.set_angle_branches(angle_branches);
    model_.parameters().set_time_varying(load_parameters);
    return model_.energy(q, load_parameters);
}

EnergyBalance::StateEnergy EnergyBalance::state_energy(const MotionState& state,
                                                       const LoadParameters& load_parameters) {
    if (end_.q.size() == state.q.size() && end_.q == state.q && end_.angle_branches == state.angle_branches &&
        end_.load_parameters == load_parameters)
        return end_;
    const double all = energy(state.q, state.angle_branches, load_parameters);
    return {state.q, state.angle_branches, load_parameters, all,
            model_.contacts().energy(state.q, load_parameters)};
}

double EnergyBalance::kinetic(const MotionState& state, const LoadParameters& load_parameters) {
    model_.parameters().set_time_varying(load_parameters);
    return 0.5 * state.v.dot(mass_.cwiseProduct(state.v)) + model_.fluid_energy(state.q, state.v);
}

bool EnergyBalance::has_contact(const StepAlgebra& step, const SubstepRecord& record,
                                std::span<const LoadParameters> load_parameters) const {
    const Contacts& contact = model_.contacts();
    for (std::size_t i = 0; i < record.stages.size(); ++i)
        if (contact.acts(record.stages[i].q, load_parameters[i + 1])) return true;
    return step.tableau().begins_explicitly && contact.acts(record.begin.q, load_parameters.front());
}

bool EnergyBalance::gains_energy(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
                                 std::span<const LoadParameters> load_parameters) {
    if (!has_contact(step, record, load_parameters)) return false;
    const MotionState& begin = record.begin;
    const LoadParameters &first = load_parameters.front(), &last = load_parameters.back();
    const StateEnergy at_first = state_energy(begin, first);
    end_ = state_energy(end, last);
    const double at_begin = at_first.energy, at_end = end_.energy;
    const double moving = kinetic(begin, first), kept = at_first.of_contact;
    const double tolerated = tolerated_gain * (moving + kept);
    const double gain = at_end + kinetic(end, last) - at_begin - moving - tolerated -
                        balance_round_off * (std::abs(at_begin) + std::abs(at_end));
    if (!(gain > 0.0)) return false;
    if (euler_ && !model_.capabilities().has_barrier && !(gain_by_contact(at_first, end, last) > tolerated))
        return false;
    double put_in = std::max(work(step, record, load_parameters), 0.0);
    if (first != last) {
        const double changed = 0.5 * (energy(begin.q, begin.angle_branches, last) - at_begin + at_end -
                                      energy(end.q, end.angle_branches, first));
        put_in += std::max(changed, 0.0);
    }
    return gain > (1.0 + work_error) * put_in;
}

double EnergyBalance::gain_by_contact(const StateEnergy& begin, const MotionState& end,
                                      const LoadParameters& load_parameters) const {
    // With the obstacles as they are at the end: what they do as they move is work put in.
    const double before = begin.load_parameters == load_parameters
                              ? begin.of_contact
                              : model_.contacts().energy(begin.q, load_parameters);
    return end_.of_contact - before + model_.contact_forces(end.q, load_parameters).dot(end.q - begin.q);
}

double EnergyBalance::work(const StepAlgebra& step, const SubstepRecord& record,
                           std::span<const LoadParameters> load_parameters) {
    const Tableau& tableau = step.tableau();
    const int first = tableau.begins_explicitly ? 1 : 0;
    const StepRates at(model_, step, free_bodies_, record, load_parameters);
    const ScopedContactFactor usual_contact_afterwards(model_);
    if (tableau.implicit_contact) model_.contacts().set_factor(0.0);
    double sum = 0.0;
    for (int j = 0; j < first + tableau.stages; ++j) {
        const bool begins = j < first;
        const VectorXd& q = begins ? record.begin.q : record.stages[j - first].q;
        model_.set_angle_branches(begins ? record.begin.angle_branches
                                         : record.stages[j - first].angle_branches);
        const LoadParameters& now = load_parameters[begins ? 0 : j - first + 1];
        model_.parameters().set_time_varying(now);
        model_.evaluate(q, now);
        const StageRates& rates = at.all[j];
        VectorXd forces = mass_.cwiseProduct(rates.acceleration) + model_.residual().gradient;
        if (rates.momentum_rate.size() > 0) {
            VectorXd of_water = VectorXd::Zero(q.size());
            model_.fluid_energy(q, rates.v, &of_water);
            forces += rates.momentum_rate - of_water;
        }
        sum += tableau.a[tableau.stages - 1][j] * rates.v.dot(forces);
    }
    if (tableau.implicit_contact) {
        const StageRates& last = at.all.back();
        VectorXd forces = mass_.cwiseProduct(last.c) - model_.residual().gradient;
        model_.contacts().set_factor(1.0);
        model_.evaluate(record.stages.back().q, load_parameters.back());
        forces += model_.residual().gradient;
        sum += 0.5 * (record.begin.v + last.v).dot(forces);
    }
    return step.dt() * sum;
}

}  // namespace magshell
