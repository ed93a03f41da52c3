#include "magshell/terms/magnetic/total_applied_field.h"

namespace magshell {

TotalAppliedField::TotalAppliedField(const FieldSources& sources, Registry& registry)
    : sources_(sources),
      flux_density_(registry.load_parameters.add("scene", "applied_flux_density", "T", 1, 3)),
      factor_(registry.load_parameters.add("scene", "field_factor", "1", 1, 1)) {}

FieldSamples TotalAppliedField::sample(const std::vector<Vec3>& places, const std::vector<Vec3>& moments,
                                       int order, const LoadParameters& load_parameters) const {
    FieldSamples samples;
    samples.reset(places.size(), order);
    if (varies(load_parameters))
        sources_.add_samples(places, moments, order, factor(load_parameters), samples);
    return samples;
}

FieldSamples TotalAppliedField::at_factor_one(const std::vector<Vec3>& places,
                                              const std::vector<Vec3>& moments, int order) const {
    FieldSamples samples;
    samples.reset(places.size(), order);
    sources_.add_samples(places, moments, order, 1.0, samples);
    return samples;
}

void TotalAppliedField::add_vjp(const std::vector<Vec3>& places, const FieldProbe& probe,
                                const FieldSamples& at_factor_one, const LoadParameters& load_parameters,
                                Gradient& out) const {
    for (std::size_t n = 0; n < places.size(); ++n) {
        out.load_parameters.segment<3>(flux_density_.first) += probe.flux[n];
        out.load_parameters[factor_.first] +=
            probe.flux[n].dot(at_factor_one.flux[n]) +
            probe.moment[n].dot(at_factor_one.gradient[n] * probe.direction[n]);
    }
    sources_.add_vjp(places, probe, factor(load_parameters), out);
}

}  // namespace magshell
