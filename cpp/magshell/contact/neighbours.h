// Neighbours: finds the pairs of parts of surfaces that are near each other along the surface, not only in
// space.
#pragma once

#include <vector>

#include "magshell/contact/contact_surface.h"
#include "magshell/contact/pair_energy.h"

namespace magshell {

class Neighbours {
  public:
    /// Creates the search. rest: reference positions [m]. Both arguments must outlive the object.
    Neighbours(const std::vector<ContactSurface>& surfaces, const std::vector<Vec3>& rest);

    /// Returns true if a path along edges connects two surfaces.
    bool connected(Index a, Index b) const { return parts_[a] == parts_[b]; }
    /// Returns true if the path along edges between the parts of a pair is at most three times their distance
    /// [m], not counting their own edges.
    bool are(const ContactPair& pair, double distance);

  private:
    void walk(Index from, double limit);

    const std::vector<Vec3>& rest_;
    std::vector<Index> starts_, next_;  // adjacency lists of the edges of each node
    std::vector<Index> parts_;          // connected component of each surface
    // Shortest paths from the node of the last query.
    Index from_ = -1;
    double limit_ = 0.0;
    std::vector<double> lengths_;
    std::vector<Index> reached_;
};

}  // namespace magshell
