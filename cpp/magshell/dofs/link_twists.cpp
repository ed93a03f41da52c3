#include "magshell/dofs/link_twists.h"

namespace magshell {

using Eigen::MatrixXd;

void LinkPaths::add_link(Index before, const std::vector<Index>& own_ones, Index nodes) {
    if (before >= 0)
        for (Index k = start[before]; k < start[before + 1]; ++k) {
            const Index each = coordinate[k];
            coordinate.push_back(each);
        }
    coordinate.insert(coordinate.end(), own_ones.begin(), own_ones.end());
    coordinates += static_cast<Index>(own_ones.size());
    link.insert(link.end(), nodes, n_links());
    node_start.push_back(node_start.back() + nodes);
    start.push_back(static_cast<Index>(coordinate.size()));
    parent.push_back(before);
    own.push_back(static_cast<Index>(own_ones.size()));
}

VectorXd LinkTwists::motion_from(Index first, const VectorXd& z) const {
    VectorXd rows(this->rows());
    for (Index link = 0; link < n_links(); ++link) {
        Vec6 twist = Vec6::Zero();
        for (Index k = paths_->start[link]; k < paths_->start[link + 1]; ++k) {
            const Index j = paths_->coordinate[k] - first;
            if (j >= 0 && j < z.size()) twist += z[j] * twists_.col(k);
        }
        const Vec3 v = twist.head<3>(), w = twist.tail<3>();
        for (Index node = paths_->node_start[link]; node < paths_->node_start[link + 1]; ++node)
            rows.segment<3>(3 * node) = v + w.cross(arms_[node]);
    }
    return rows;
}

VectorXd LinkTwists::motion(const VectorXd& z) const {
    return motion_from(0, z);
}

MatrixXd LinkTwists::up(Wrenches wrenches) const {
    const Index n = wrenches.columns;
    MatrixXd out(coordinates(), n);
    for (Index link = n_links() - 1; link >= 0; --link) {
        const Index parent = paths_->parent[link], end = paths_->start[link + 1];
        for (Index k = end - paths_->own[link]; k < end; ++k)
            out.row(paths_->coordinate[k]) =
                twists_.col(k).transpose() * wrenches.all.middleCols(link * n, n);
        if (parent < 0) continue;
        const Vec3 apart = points_[link] - points_[parent];
        for (Index j = 0; j < n; ++j) {
            const Vec6 own = wrenches.of(link, j);
            auto to = wrenches.of(parent, j);
            to += own;
            to.tail<3>() += apart.cross(own.head<3>());
        }
    }
    return out;
}

VectorXd LinkTwists::pull_back(const VectorXd& rows) const {
    Wrenches wrenches(n_links(), 1);
    for (Index node = 0; node < paths_->n_nodes(); ++node) {
        const Vec3 force = rows.segment<3>(3 * node);
        auto to = wrenches.of(paths_->link[node], 0);
        to.head<3>() += force;
        to.tail<3>() += arms_[node].cross(force);
    }
    return up(std::move(wrenches));
}

MatrixXd LinkTwists::product(const std::vector<Block>& blocks, const LinkTwists& of_rows) const {
    Wrenches wrenches(of_rows.n_links(), coordinates());
    for (const Block& block : blocks)
        for (Index k = paths_->start[block.column]; k < paths_->start[block.column + 1]; ++k)
            wrenches.of(block.row, paths_->coordinate[k]) += block.value * twists_.col(k);
    return of_rows.up(std::move(wrenches));
}

MatrixXd LinkTwists::product(const VectorXd& weights) const {
    std::vector<Block> blocks;
    for (Index link = 0; link < n_links(); ++link) {
        Mat6 sum = Mat6::Zero();
        for (Index row = 3 * paths_->node_start[link]; row < 3 * paths_->node_start[link + 1]; ++row) {
            const Vec6 each = wrench(row);
            sum += weights[row] * each * each.transpose();
        }
        blocks.push_back({link, link, sum});
    }
    return product(blocks, *this);
}

MatrixXd LinkTwists::matrix() const {
    MatrixXd b = MatrixXd::Zero(rows(), coordinates());
    for (Index link = 0; link < n_links(); ++link)
        for (Index k = paths_->start[link]; k < paths_->start[link + 1]; ++k) {
            const Vec3 v = twists_.col(k).head<3>(), w = twists_.col(k).tail<3>();
            for (Index node = paths_->node_start[link]; node < paths_->node_start[link + 1]; ++node)
                b.block<3, 1>(3 * node, paths_->coordinate[k]) = v + w.cross(arms_[node]);
        }
    return b;
}

}  // namespace magshell
