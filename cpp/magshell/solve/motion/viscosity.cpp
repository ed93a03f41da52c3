#include "magshell/solve/motion/viscosity.h"

#include <utility>

namespace magshell {

ViscousStage::ViscousStage(const Viscosity& law, double stage_time, double dt, const double* a,
                           const std::vector<StageRates>& rates, Kind kind, const StrainSet& d_begin,
                           const StrainSet& e_begin)
    : d_hat(d_begin), e_hat(e_begin) {
    for (std::size_t j = 0; j < rates.size(); ++j) {
        d_hat.add(dt * a[j], (rates[j].*kind).d);
        if (law.maxwell()) e_hat.add(dt * a[j], (rates[j].*kind).e);
    }
    shift = d_hat.times(law.stiffness_damping / stage_time);
    if (law.maxwell()) shift.add(law.relaxed(stage_time), e_hat);
}

void ViscousStage::finish(const Viscosity& law, double stage_time, StrainSet strains, StrainRates& rates) {
    d = std::move(strains);
    rates.d = d.times(1.0 / stage_time);
    rates.d.add(-1.0 / stage_time, d_hat);
    if (!law.maxwell()) return;
    const double r = law.ratio(stage_time);
    e = e_hat.times(1.0 / (1.0 + r));
    e.add(r / (1.0 + r), d);
    rates.e = d.times(1.0 / law.maxwell_time);
    rates.e.add(-1.0 / law.maxwell_time, e);
}

}  // namespace magshell
