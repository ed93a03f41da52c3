#include "magshell/solve/energy_balance.h"

#include <algorithm>
#include <cmath>

#include "magshell/term/body_contact_term.h"

namespace magshell {
namespace {

constexpr double tolerated = 1e-3;           // of the energy that an impact can turn over
constexpr double unseen = 0.1;               // of what is put in, between the stages at which it is looked at
constexpr double balance_round_off = 1e-11;  // of the energies of a state

}  // namespace

double EnergyBalance::energy(const VectorXd& q, const Model::Turns& turns, const Controls& controls) {
    model_.set_turns(turns);
    model_.take(controls);
    return model_.energy(q, controls);
}

EnergyBalance::Standing EnergyBalance::standing(const MotionState& state, const Controls& controls) {
    if (end_.q.size() == state.q.size() && end_.q == state.q && end_.turns == state.turns &&
        end_.controls == controls)
        return end_;
    const double all = energy(state.q, state.turns, controls);
    return {state.q, state.turns, controls, all, model_.body_contact()->energy(state.q.data(), controls)};
}

bool EnergyBalance::touches(const StepAlgebra& step, const SubstepRecord& record) const {
    const BodyContactTerm& contact = *model_.body_contact();
    for (const StageState& stage : record.stages)
        if (contact.acts(stage.q.data())) return true;
    return step.tableau().begins_explicitly && contact.acts(record.begin.q.data());
}

bool EnergyBalance::gains(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
                          std::span<const Controls> controls) {
    if (!touches(step, record)) return false;
    const MotionState& begin = record.begin;
    const Controls &first = controls.front(), &last = controls.back();
    const Standing at_first = standing(begin, first);
    end_ = standing(end, last);
    const double at_begin = at_first.energy, at_end = end_.energy;
    const double moving = kinetic(begin), kept = at_first.of_contact;
    const double gain = at_end + kinetic(end) - at_begin - moving - tolerated * (moving + kept) -
                        balance_round_off * (std::abs(at_begin) + std::abs(at_end));
    if (!(gain > 0.0)) return false;
    double put_in = std::max(work(step, record, controls), 0.0);
    if (first != last) {
        const double changed =
            0.5 * (energy(begin.q, begin.turns, last) - at_begin + at_end - energy(end.q, end.turns, first));
        put_in += std::max(changed, 0.0);
    }
    return gain > (1.0 + unseen) * put_in;
}

double EnergyBalance::work(const StepAlgebra& step, const SubstepRecord& record,
                           std::span<const Controls> controls) {
    const Tableau& tableau = step.tableau();
    const int first = tableau.begins_explicitly ? 1 : 0;
    const StepRates at(model_, step, record);
    double sum = 0.0;
    for (int j = 0; j < first + tableau.stages; ++j) {
        const bool begins = j < first;
        const VectorXd& q = begins ? record.begin.q : record.stages[j - first].q;
        model_.set_turns(begins ? record.begin.turns : record.stages[j - first].turns);
        const Controls& now = controls[begins ? 0 : j - first + 1];
        model_.take(now);
        model_.evaluate(q, now);
        const StageRates& rates = at.all[j];
        sum += tableau.a[tableau.stages - 1][j] *
               rates.v.dot(mass_.cwiseProduct(rates.w) + model_.residual().gradient);
    }
    return step.dt() * sum;
}

}  // namespace magshell
