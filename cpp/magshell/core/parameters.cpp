#include "magshell/core/parameters.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace magshell {

ParameterSlice Parameters::add(const std::string& owner, const std::string& name, const std::string& unit,
                               Index rows, Index width, const Renumbering* order) {
    for (const Entry& entry : entries_) {
        if (entry.owner != owner || entry.name != name) continue;
        if (entry.slice.rows != rows || entry.slice.width != width || entry.order != order)
            throw std::logic_error("the " + name + " of " + owner + " is registered with two shapes");
        return entry.slice;
    }
    const ParameterSlice slice{static_cast<Index>(entries_.size()), size_, rows, width};
    entries_.push_back({owner, name, unit, slice, order});
    size_ += slice.size();
    return slice;
}

// Calls move(position in the caller's order, position in ours, width, whether an earlier row has that position) for all rows.
template <class Move>
void Parameters::each_row(const Move& move) const {
    for (const Entry& entry : entries_) {
        if (!entry.order) {
            move(entry.slice.first, entry.slice.first, entry.slice.size(), false);
            continue;
        }
        const Renumbering& order = *entry.order;
        for (Index row = 0; row < order.size(); ++row)
            move(entry.slice.at(order.user[row]), entry.slice.at(row), entry.slice.width, false);
        if (order.size() == order.user_size()) continue;
        for (Index row = 0; row < order.user_size(); ++row)
            if (order.is_copy(row))
                move(entry.slice.at(row), entry.slice.at(order.core[row]), entry.slice.width, true);
    }
}

VectorXd Parameters::to_core(const VectorXd& in_user_order) const {
    VectorXd ours = VectorXd::Zero(size_);
    each_row([&](Index user, Index core, Index width, bool copy) {
        if (copy)
            ours.segment(core, width) += in_user_order.segment(user, width);
        else
            ours.segment(core, width) = in_user_order.segment(user, width);
    });
    return ours;
}

VectorXd Parameters::to_user(const VectorXd& in_core_order) const {
    VectorXd users(size_);
    each_row([&](Index user, Index core, Index width, bool) {
        users.segment(user, width) = in_core_order.segment(core, width);
    });
    return users;
}

void Values::set(const Parameters& parameters, VectorXd numbers) {
    changed_.assign(parameters.entries().size(), 1);
    if (numbers_.size() == numbers.size())
        for (const Parameters::Entry& entry : parameters.entries()) {
            const double* before = numbers_.data() + entry.slice.first;
            changed_[entry.slice.entry] =
                !std::equal(before, before + entry.slice.size(), numbers.data() + entry.slice.first);
        }
    numbers_ = std::move(numbers);
}

}  // namespace magshell
