// The field sources of a scene, with values of their own: what all its magnetized bodies feel.
#pragma once

#include <memory>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/field/applied_field.h"

namespace magshell {

class FieldSources {
  public:
    /// Source k registers its parameters as those of "field k".
    FieldSources(const std::vector<std::shared_ptr<const AppliedField>>& sources, Registry& registry);

    void set_values(const Values& values);
    bool empty() const { return sources_.empty(); }

    /// The sum over the sources; arguments as in AppliedField.
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const;
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale, Gradient& out) const;

  private:
    struct Source {
        std::shared_ptr<const AppliedField> field;
        std::shared_ptr<AppliedField> own;  // the same one, where it has values
        std::vector<Slot> slots;            // one behind the other

        Index count() const { return slots.back().first + slots.back().size() - slots.front().first; }
    };
    std::vector<Source> sources_;
};

}  // namespace magshell
