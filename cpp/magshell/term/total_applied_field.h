// The applied field as one body feels it: the flux density that is the same everywhere, and what the sources add.
#pragma once

#include <vector>

#include "magshell/term/field_sources.h"

namespace magshell {

class TotalAppliedField {
  public:
    /// Registers the controls "applied_flux_density" and "field_factor". The sources have to outlive it.
    TotalAppliedField(const FieldSources& sources, Registry& registry);

    /// The part that is the same everywhere [T].
    Vec3 uniform(const Controls& controls) const { return controls.segment<3>(flux_density_.first); }
    double factor(const Controls& controls) const { return controls[factor_.first]; }
    /// Whether there is another part.
    bool varies(const Controls& controls) const { return !sources_.empty() && factor(controls) != 0.0; }

    /// The part of the sources, without the uniform one, and scaled by their factor. Order and moments as in
    /// AppliedField::add_samples.
    FieldSamples sample(const std::vector<Vec3>& places, const std::vector<Vec3>& moments, int order,
                        const Controls& controls) const;
    /// The same with the flux density and its gradient, for a factor of 1: what add_vjp takes.
    FieldSamples at_factor_one(const std::vector<Vec3>& places, const std::vector<Vec3>& moments) const;

    /// Adds the gradient of a probe of the whole field by the two controls and by the sources' own values.
    void add_vjp(const std::vector<Vec3>& places, const FieldProbe& probe, const FieldSamples& at_factor_one,
                 const Controls& controls, Gradient& out) const;

  private:
    const FieldSources& sources_;
    Slot flux_density_, factor_;
};

}  // namespace magshell
