// Two numberings of the same objects, the caller's and ours. Several of the caller's may be one of ours.
#pragma once

#include <utility>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// user[k] is the caller's index of our k, core[u] is ours of the caller's u. If several u are one k, user[k] is the first of them, and the others are
/// its copies.
struct Renumbering {
    std::vector<Index> user, core;

    Index size() const { return static_cast<Index>(user.size()); }
    Index user_size() const { return static_cast<Index>(core.size()); }
    bool is_copy(Index u) const { return user[core[u]] != u; }

    static Renumbering from_user_order(std::vector<Index> user) {
        Renumbering numbering;
        numbering.core.resize(user.size());
        for (Index k = 0; k < static_cast<Index>(user.size()); ++k) numbering.core[user[k]] = k;
        numbering.user = std::move(user);
        return numbering;
    }
};

}  // namespace magshell
