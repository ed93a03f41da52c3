// FieldSources: all sources of the applied field of a scene, with their parameters.
#pragma once

#include <memory>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/field/applied_field.h"

namespace magshell {

class FieldSources {
  public:
    /// Registers the parameters of source k under the name "field k".
    FieldSources(const std::vector<std::shared_ptr<const AppliedField>>& sources, Registry& registry);

    void set_values(const Values& values);
    bool empty() const { return sources_.empty(); }

    /// Adds the sum over all sources; arguments as in AppliedField.
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const;
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale, Gradient& out) const;

  private:
    struct Source {
        std::shared_ptr<const AppliedField> field;
        std::shared_ptr<AppliedField> own;   // the same object if it has parameters, else nullptr
        std::vector<ParameterSlice> slices;  // consecutive

        Index count() const { return slices.back().first + slices.back().size() - slices.front().first; }
    };
    std::vector<Source> sources_;
};

}  // namespace magshell
