// Numbering that keeps neighbours together in memory, whatever order the caller's mesh came in.
#pragma once

#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// A renumbering: user[k] is the caller's index of our k, core[u] ours of the caller's u.
struct Renumbering {
    std::vector<Index> user, core;

    Index size() const { return static_cast<Index>(user.size()); }
    static Renumbering from_user_order(std::vector<Index> user);
};

/// Along a space-filling (Morton) curve through the points; equal keys keep their order.
Renumbering order_along_curve(const std::vector<Vec3>& points);

}  // namespace magshell
