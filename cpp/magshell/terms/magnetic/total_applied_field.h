// TotalAppliedField: the applied magnetic flux density at the points of one body, the sum of the uniform field
// and of all field sources.
#pragma once

#include <vector>

#include "magshell/terms/magnetic/field_sources.h"

namespace magshell {

class TotalAppliedField {
  public:
    /// Registers the load parameters "applied_flux_density" and "field_factor". The sources must outlive the
    /// object.
    TotalAppliedField(const FieldSources& sources, Registry& registry);

    /// Returns the uniform part [T].
    Vec3 uniform(const LoadParameters& load_parameters) const {
        return load_parameters.segment<3>(flux_density_.first);
    }
    double factor(const LoadParameters& load_parameters) const { return load_parameters[factor_.first]; }
    /// Returns true if sources add a nonuniform part.
    bool varies(const LoadParameters& load_parameters) const {
        return !sources_.empty() && factor(load_parameters) != 0.0;
    }

    /// Returns the part of the sources, scaled by the field factor, without the uniform part. Order and moments
    /// as in AppliedField::add_samples.
    FieldSamples sample(const std::vector<Vec3>& places, const std::vector<Vec3>& moments, int order,
                        const LoadParameters& load_parameters) const;
    /// Returns flux density and gradient of the sources for a field factor of 1, as add_vjp() requires them, and with order 2 the
    /// curvature.
    FieldSamples at_factor_one(const std::vector<Vec3>& places, const std::vector<Vec3>& moments,
                               int order = 1) const;

    /// Adds the gradient of a probe of the total field by both load parameters and by the parameters of the
    /// sources.
    void add_vjp(const std::vector<Vec3>& places, const FieldProbe& probe, const FieldSamples& at_factor_one,
                 const LoadParameters& load_parameters, Gradient& out) const;

  private:
    const FieldSources& sources_;
    ParameterSlice flux_density_, factor_;
};

}  // namespace magshell
