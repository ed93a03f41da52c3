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

/// Holds `width` numbers per element (three for a shell) in the layout of SIMD packs: strain i of pack p is
/// stored at width p + i, with one element per lane.
struct Strains {
    LargeVector<Pack> packs;
    Index elements = 0;
    int width = 3;

    explicit Strains(Index elements_ = 0, int width_ = 3)
        : packs(static_cast<std::size_t>(width_) * packs_for(elements_), Pack(0.0)),
          elements(elements_),
          width(width_) {}
    Pack* at(Index pack) { return packs.data() + static_cast<std::size_t>(width) * pack; }
    const Pack* at(Index pack) const { return packs.data() + static_cast<std::size_t>(width) * pack; }
    double number(Index element, int i) const { return at(element / Pack::width)[i][element % Pack::width]; }
    void set(Index element, int i, double value) {
        at(element / Pack::width)[i].set(element % Pack::width, value);
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
    void apply(Index pack, Pack strain[N]) const {
        if (!shift) return;
        for (int i = 0; i < N; ++i) strain[i] = Pack(scale) * strain[i] - shift->at(pack)[i];
    }

    /// Returns the derivative of the effective strain by the current strain.
    double factor() const { return shift ? scale : 1.0; }

    /// Returns scale C.
    template <int N>
    Symmetric<N> scaled(const Symmetric<N>& stiffness) const {
        Symmetric<N> result = stiffness;
        if (shift)
            for (Pack& entry : result.at) entry *= Pack(scale);
        return result;
    }
};

}  // namespace magshell
