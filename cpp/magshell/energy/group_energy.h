// GroupEnergy: an energy of groups of nodes that the caller computes, with its derivatives.
//
//   E = sum over groups of W(x_1, ..., x_k; values)                        [J]
//
// All groups have the same number k of nodes. The core asks for all groups at once, because one call of the caller's function is slow.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// The energies of n groups of k nodes, and derivatives with respect to the positions of their nodes as far as they were asked for.
struct GroupSamples {
    VectorXd energies;   // (n) [J]
    VectorXd gradients;  // (n, 3k), one group after another [N]
    VectorXd hessians;   // (n, 3k, 3k) [N/m]
};

class GroupEnergy {
  public:
    virtual ~GroupEnergy() = default;

    /// Evaluates all groups. positions: (n, 3k) [m]. values: all of the caller's, in the order of registration. order: of the highest
    /// derivative, 0 to 2. Numbers that are not finite are passed on.
    virtual GroupSamples sample(const VectorXd& positions, const VectorXd& values, int order) const = 0;

    /// Returns d(rates . gradient)/d(value) of all values; rates: (n, 3k).
    virtual VectorXd rate_by_values(const VectorXd& positions, const VectorXd& values,
                                    const VectorXd& rates) const = 0;
};

}  // namespace magshell
