#include "magshell/scene/time_varying.h"

#include "magshell/core/errors.h"

namespace magshell {

TimeVaryingParameters::TimeVaryingParameters(const Registry& registry, const std::vector<Index>& entries)
    : first_(registry.load_parameters.size()) {
    for (const Index k : entries) {
        if (k < 0 || k >= static_cast<Index>(registry.values.entries().size()))
            throw InvalidInput("the scene has no value of number " + std::to_string(k));
        const Parameters::Entry& entry = registry.values.entries()[k];
        if (entry.order)
            throw InvalidInput(entry.name + " of " + entry.owner +
                               " cannot change during a solve, because it has one row per vertex or face");
        slices_.push_back(entry.slice);
        size_ += entry.slice.size();
    }
}

bool TimeVaryingParameters::update(const LoadParameters& load_parameters, VectorXd& values) const {
    bool changed = false;
    Index from = first_;
    for (const ParameterSlice& slice : slices_) {
        const auto now = load_parameters.segment(from, slice.size());
        if (values.segment(slice.first, slice.size()) != now) {
            values.segment(slice.first, slice.size()) = now;
            changed = true;
        }
        from += slice.size();
    }
    return changed;
}

void TimeVaryingParameters::move_gradient(Gradient& gradient) const {
    Index to = first_;
    for (const ParameterSlice& slice : slices_) {
        gradient.load_parameters.segment(to, slice.size()) +=
            gradient.values.segment(slice.first, slice.size());
        gradient.values.segment(slice.first, slice.size()).setZero();
        to += slice.size();
    }
}

}  // namespace magshell
