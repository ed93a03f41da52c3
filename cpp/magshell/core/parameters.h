// The numbers of a scene that a solve may change and differentiate by. Each is registered once, by who reads
// it, and has a place in one flat vector of values and in one of their gradient. Names serve the way in and
// out only.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/renumbering.h"
#include "magshell/core/types.h"

namespace magshell {

/// Where a parameter stands in the flat vectors: `rows` rows of `width` numbers.
struct Slot {
    Index entry = -1, first = 0, rows = 0, width = 1;

    Index size() const { return rows * width; }
    Index at(Index row) const { return first + row * width; }
};

/// The list of what is registered.
class Parameters {
  public:
    struct Entry {
        std::string owner, name, unit;
        Slot slot;
        const Renumbering* order;  // of its rows; nullptr: the caller's own
    };

    /// A new place, or the one that this parameter of this owner already has: several may read it. The order
    /// of its rows has to outlive the list. Where several rows of the caller are one of ours, that one is their
    /// sum, and our last rows are empty. Throws std::logic_error where the shapes differ.
    Slot add(const std::string& owner, const std::string& name, const std::string& unit, Index rows,
             Index width, const Renumbering* order = nullptr);

    const std::vector<Entry>& entries() const { return entries_; }
    Index size() const { return size_; }

    /// The one door between the caller's order of rows and ours.
    VectorXd to_core(const VectorXd& in_user_order) const;
    VectorXd to_user(const VectorXd& in_core_order) const;

  private:
    template <class Move>
    void each_row(const Move& move) const;

    std::vector<Entry> entries_;
    Index size_ = 0;
};

/// All values, and which parameters differ from what they were before.
class Values {
  public:
    const double* operator[](const Slot& slot) const { return numbers_.data() + slot.first; }
    double number(const Slot& slot, Index row = 0) const { return numbers_[slot.at(row)]; }
    Vec3 vector(const Slot& slot, Index row = 0) const { return numbers_.segment<3>(slot.at(row)); }

    template <class... Slots>
    bool changed(const Slots&... slots) const {
        return (changed_[slots.entry] || ...);
    }
    const VectorXd& numbers() const { return numbers_; }

    /// All of them, in our order; at first everything has changed.
    void set(const Parameters& parameters, VectorXd numbers);

  private:
    VectorXd numbers_;
    std::vector<char> changed_;
};

/// What may change while a scene is solved, everything that a path parameter interpolates: one flat vector,
/// with a list of its own.
using Controls = VectorXd;

/// The controls at `parameter` on the straight line from `from` (0) to `to` (1).
inline Controls interpolate(const Controls& from, const Controls& to, double parameter) {
    return (1.0 - parameter) * from + parameter * to;
}

/// What a scene's terms read.
struct Registry {
    Parameters values, controls;
};

/// The gradient of a number by all values and all controls, in our order. Whoever has a share adds it.
struct Gradient {
    VectorXd values, controls;

    Gradient() = default;
    explicit Gradient(const Registry& registry)
        : values(VectorXd::Zero(registry.values.size())),
          controls(VectorXd::Zero(registry.controls.size())) {}
};

}  // namespace magshell
