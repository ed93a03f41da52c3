#include "magshell/solve/motion/viscosity.h"

#include <utility>

namespace magshell {

ViscousStage::ViscousStage(const Viscosity& law, double stage_time, double dt, const double* a,
                           const std::vector<StageRates>& rates, Kind kind, const StrainSet& d_begin,
                           const MaxwellStrains& e_begin)
    : d_hat(d_begin), e_hat(e_begin) {
    for (std::size_t j = 0; j < rates.size(); ++j) {
        d_hat.add(dt * a[j], (rates[j].*kind).d);
        for (std::size_t k = 0; k < law.branches.size(); ++k) e_hat[k].add(dt * a[j], (rates[j].*kind).e[k]);
    }
    shift = d_hat.times(law.stiffness_damping / stage_time);
    for (std::size_t k = 0; k < law.branches.size(); ++k)
        shift.add(law.branches[k].relaxed(stage_time), e_hat[k]);
}

void ViscousStage::finish(const Viscosity& law, double stage_time, StrainSet strains, StrainRates& rates) {
    d = std::move(strains);
    rates.d = d.times(1.0 / stage_time);
    rates.d.add(-1.0 / stage_time, d_hat);
    for (std::size_t k = 0; k < law.branches.size(); ++k) {
        const double r = law.branches[k].ratio(stage_time), tau = law.branches[k].time;
        StrainSet& now = e.emplace_back(e_hat[k].times(1.0 / (1.0 + r)));
        now.add(r / (1.0 + r), d);
        rates.e.push_back(d.times(1.0 / tau));
        rates.e.back().add(-1.0 / tau, now);
    }
}

}  // namespace magshell
