#include "magshell/scene/time_varying.h"

#include "magshell/core/errors.h"

namespace magshell {

TimeVaryingParameters::TimeVaryingParameters(const Registry& registry, const std::vector<Index>& entries)
    : first_(registry.controls.size()) {
    for (const Index k : entries) {
        if (k < 0 || k >= static_cast<Index>(registry.values.entries().size()))
            throw InvalidInput("the scene has no value of number " + std::to_string(k));
        const Parameters::Entry& entry = registry.values.entries()[k];
        if (entry.order)
            throw InvalidInput(entry.name + " of " + entry.owner +
                               " cannot change during a solve, because it has one row per vertex or face");
        slots_.push_back(entry.slot);
        size_ += entry.slot.size();
    }
}

bool TimeVaryingParameters::update(const Controls& controls, VectorXd& values) const {
    bool changed = false;
    Index from = first_;
    for (const Slot& slot : slots_) {
        const auto now = controls.segment(from, slot.size());
        if (values.segment(slot.first, slot.size()) != now) {
            values.segment(slot.first, slot.size()) = now;
            changed = true;
        }
        from += slot.size();
    }
    return changed;
}

void TimeVaryingParameters::move_gradient(Gradient& gradient) const {
    Index to = first_;
    for (const Slot& slot : slots_) {
        gradient.controls.segment(to, slot.size()) += gradient.values.segment(slot.first, slot.size());
        gradient.values.segment(slot.first, slot.size()).setZero();
        to += slot.size();
    }
}

}  // namespace magshell
