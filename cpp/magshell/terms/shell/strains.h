// Strains of elastic terms, and the strain history that makes an elastic term viscous. With a history the
// stress is
//
//     sigma = C (scale d - shift)
//
// which covers every linear viscoelastic law that is integrated implicitly in time; solve/motion/viscosity.h has the
// laws that are implemented.
#pragma once

#include <vector>

#include "magshell/assembly/lanes.h"

namespace magshell {

/// Holds `width` numbers per element (three for a shell) in the layout of SIMD vectors: strain i of SIMD vector p is
/// stored at width p + i, with one element per lane.
struct Strains {
    LargeVector<SimdDouble> groups;
    Index elements = 0;
    int width = 3;

    explicit Strains(Index elements_ = 0, int width_ = 3)
        : groups(static_cast<std::size_t>(width_) * groups_for(elements_), SimdDouble(0.0)),
          elements(elements_),
          width(width_) {}
    SimdDouble* at(Index group) { return groups.data() + static_cast<std::size_t>(width) * group; }
    const SimdDouble* at(Index group) const {
        return groups.data() + static_cast<std::size_t>(width) * group;
    }
    double number(Index element, int i) const {
        return at(element / SimdDouble::width)[i][element % SimdDouble::width];
    }
    void set(Index element, int i, double value) {
        at(element / SimdDouble::width)[i].set(element % SimdDouble::width, value);
    }
};

/// The strains of all elastic terms of a scene, one after another, with the operations of a vector space.
struct StrainSet {
    std::vector<Strains> of_terms;

    bool empty() const { return of_terms.empty(); }
    void add(double factor, const StrainSet& other);
    StrainSet times(double factor) const;
    /// Returns the sum of products over all elements and strains.
    double dot(const StrainSet& other) const;
    std::size_t bytes() const;
};

struct StrainHistory {
    double scale = 1.0;
    const Strains* shift = nullptr;

    /// Replaces d by scale d - shift.
    template <int N = 3>
    void apply(Index group, SimdDouble strain[N]) const {
        if (!shift) return;
        for (int i = 0; i < N; ++i) strain[i] = SimdDouble(scale) * strain[i] - shift->at(group)[i];
    }

    /// Returns the derivative of the effective strain by the current strain.
    double factor() const { return shift ? scale : 1.0; }

    /// Returns scale C.
    template <int N>
    Symmetric<N> scaled(const Symmetric<N>& stiffness) const {
        Symmetric<N> result = stiffness;
        if (shift)
            for (SimdDouble& entry : result.at) entry *= SimdDouble(scale);
        return result;
    }
};

}  // namespace magshell
