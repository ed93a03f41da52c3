// FrictionContacts: the contacts that have friction in a stage, the same for contact with obstacles and between bodies.
//
// Exact friction uses the normal force and the normal at the end of the stage. Lagged friction uses those at the beginning of
// the step; it then has a potential of the velocities and a symmetric matrix. [Geilinger et al. 2020; Li et al. 2020, IPC]
// Frozen normal forces and normals stay those of one evaluated state, which leaves the same symmetric matrix.
//
// A velocity is the difference of two positions over a stage, and in a sticking contact a small velocity causes a large force.
// The terms therefore bound the round-off of friction by its stiffness (add_cancelling_forces).
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

namespace magshell {

/// ActiveContact: that of a contact term, beside which a function index_of_contact(active) is declared.
template <class ActiveContact>
class FrictionContacts {
  public:
    /// Both lists have one flag per contact: whether it has friction, and whether its friction is lagged.
    FrictionContacts(std::vector<bool> has_friction, std::vector<bool> lagged)
        : has_friction_(std::move(has_friction)), lagged_(std::move(lagged)) {}

    /// Begins a step. active_at_begin: function that returns what is active there; it is not called if no friction is lagged.
    /// Returns true if friction of any contact is lagged.
    template <class ActiveAtBegin>
    bool begin_step(const ActiveAtBegin& active_at_begin) {
        at_begin_.clear();
        if (std::none_of(lagged_.begin(), lagged_.end(), [](bool lagged) { return lagged; })) return false;
        for (const ActiveContact& active : active_at_begin())
            if (lagged_[index_of_contact(active)]) at_begin_.push_back(active);
        return true;
    }

    /// Freezes the contacts at the last evaluated state, or releases them.
    void set_frozen(bool frozen, const std::vector<ActiveContact>& evaluated) {
        if (frozen) frozen_contacts_ = evaluated;
        frozen_ = frozen;
    }

    /// Calls add(active, lagged, factor) for each contact with friction, first exact then lagged ones; `active` stays valid until
    /// the next call. evaluated: at the last evaluated state. factor_now: the factor of the contact forces, which evaluated forces
    /// contain and those of the beginning of the step do not.
    template <class Add>
    void select(const std::vector<ActiveContact>& evaluated, double factor_now, const Add& add) {
        now_ = frozen_ ? frozen_contacts_ : evaluated;
        for (const ActiveContact& active : now_)
            if (has(active) && !lagged_[index_of_contact(active)]) add(active, false, 1.0);
        for (const ActiveContact& active : at_begin_)
            if (has(active)) add(active, true, factor_now);
    }

    bool frozen() const { return frozen_; }
    /// Returns the contacts of lagged friction at the beginning of the step; frozen_contacts() returns those frozen last.
    const std::vector<ActiveContact>& at_begin() const { return at_begin_; }
    const std::vector<ActiveContact>& frozen_contacts() const { return frozen_contacts_; }

  private:
    bool has(const ActiveContact& active) const { return has_friction_[index_of_contact(active)]; }

    std::vector<bool> has_friction_, lagged_;
    std::vector<ActiveContact> at_begin_, frozen_contacts_, now_;
    bool frozen_ = false;
};

}  // namespace magshell
