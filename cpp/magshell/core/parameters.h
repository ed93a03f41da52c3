// The registered parameters of a scene: the numbers that a solve may change and differentiate by. Each is registered once, by the object that
// reads it, and has a position in one flat vector of values and in the vector of gradients. Names are used only to translate from and to
// the caller.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/renumbering.h"
#include "magshell/core/types.h"

namespace magshell {

/// The position of a parameter in the flat vectors: `rows` rows of `width` numbers.
struct ParameterSlice {
    Index entry = -1, first = 0, rows = 0, width = 1;

    Index size() const { return rows * width; }
    Index at(Index row) const { return first + row * width; }
};

/// The list of registered parameters.
class Parameters {
  public:
    struct Entry {
        std::string owner, name, unit;
        ParameterSlice slice;
        const Renumbering* order;  // of its rows; nullptr: the order of the caller
    };

    /// Registers a parameter, or returns its slice if its owner has registered it already: several objects may read it. `order` must outlive the
    /// list. If several rows of the caller are one of ours, ours is their sum, and our last rows are empty. Throws std::logic_error
    /// if the shapes differ.
    ParameterSlice add(const std::string& owner, const std::string& name, const std::string& unit, Index rows,
                       Index width, const Renumbering* order = nullptr);

    const std::vector<Entry>& entries() const { return entries_; }
    Index size() const { return size_; }

    /// Convert all values between the row order of the caller and that of the core.
    VectorXd to_core(const VectorXd& in_user_order) const;
    VectorXd to_user(const VectorXd& in_core_order) const;

  private:
    template <class Move>
    void each_row(const Move& move) const;

    std::vector<Entry> entries_;
    Index size_ = 0;
};

/// The values of all parameters, with marks of those that the last change affected.
class Values {
  public:
    const double* operator[](const ParameterSlice& slice) const { return numbers_.data() + slice.first; }
    double number(const ParameterSlice& slice, Index row = 0) const { return numbers_[slice.at(row)]; }
    Vec3 vector(const ParameterSlice& slice, Index row = 0) const {
        return numbers_.segment<3>(slice.at(row));
    }

    template <class... ParameterSlices>
    bool changed(const ParameterSlices&... slices) const {
        return (changed_[slices.entry] || ...);
    }
    const VectorXd& numbers() const { return numbers_; }

    /// Sets all values, in the order of the core, and marks those that differ from before; the first time all are marked.
    void set(const Parameters& parameters, VectorXd numbers);

  private:
    VectorXd numbers_;
    std::vector<char> changed_;
};

/// The load parameters of a state: load factors, uniform field, amplitude of supports, and values that vary during the solve. A path or a
/// motion interpolates them. They form one flat vector with a list of their own.
using LoadParameters = VectorXd;

/// Returns the load parameters at `parameter` on the straight line from `from` (0) to `to` (1).
inline LoadParameters interpolate(const LoadParameters& from, const LoadParameters& to, double parameter) {
    return (1.0 - parameter) * from + parameter * to;
}

/// The name and unit of a parameter with one number per face of a surface.
struct FaceInput {
    const char *name, *unit;
};

/// The parameters and load parameters that the terms of a scene read.
struct Registry {
    Parameters values, load_parameters;
};

/// The gradient of a function by all values and all load parameters, in the order of the core. Each object adds its part.
struct Gradient {
    VectorXd values, load_parameters;

    Gradient() = default;
    explicit Gradient(const Registry& registry)
        : values(VectorXd::Zero(registry.values.size())),
          load_parameters(VectorXd::Zero(registry.load_parameters.size())) {}
};

}  // namespace magshell
