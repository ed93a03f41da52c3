#include "magshell/body/nodes.h"

#include <utility>

namespace magshell {

Index NodeNumbering::number(Index user, const Vec3& rest_position) {
    if (core_[user] < 0) {
        core_[user] = static_cast<Index>(user_.size());
        user_.push_back(user);
        rest_.push_back(rest_position);
    }
    return core_[user];
}

Nodes NodeNumbering::finish(const Rows3& directions, const std::vector<Index>& original) {
    Nodes nodes;
    for (std::size_t user = 0; user < original.size(); ++user)
        if (core_[user] < 0) core_[user] = core_[original[user]];
    nodes.vertices = {std::move(user_), std::move(core_)};
    nodes.rest = std::move(rest_);
    for (Index d = 0; d < directions.rows(); ++d) nodes.rest.push_back(directions.row(d).transpose());
    return nodes;
}

}  // namespace magshell
