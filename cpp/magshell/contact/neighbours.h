// Which parts of surfaces are neighbours: near each other along edges, not just in space.
#pragma once

#include <vector>

#include "magshell/contact/contact_surface.h"
#include "magshell/contact/pair_energy.h"

namespace magshell {

class Neighbours {
  public:
    /// rest: where nodes are at rest [m]. Both have to outlive it.
    Neighbours(const std::vector<ContactSurface>& surfaces, const std::vector<Vec3>& rest);

    /// Whether there is any way along edges between two surfaces.
    bool connected(Index a, Index b) const { return parts_[a] == parts_[b]; }
    /// Whether the way along edges between the parts of a pair is no longer than three times their distance [m], their
    /// own edges apart.
    bool are(const ContactPair& pair, double distance);

  private:
    void walk(Index from, double limit);

    const std::vector<Vec3>& rest_;
    std::vector<Index> starts_, next_;  // of the edges of each node
    std::vector<Index> parts_;          // of the surfaces: the first one that is connected
    // From the node that was asked for last.
    Index from_ = -1;
    double limit_ = 0.0;
    std::vector<double> lengths_;
    std::vector<Index> reached_;
};

}  // namespace magshell
