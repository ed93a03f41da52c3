#include "magshell/solve/coulomb_contact.h"

#include <algorithm>

#include "magshell/core/errors.h"

namespace magshell {

CoulombContact::CoulombContact(const Model& model, const ConstantMatrix& matrix, const Controls& controls,
                               const VectorXd& begin, double time)
    : matrix_(matrix),
      begin_(begin),
      time_(time),
      negligible_(1e-14 * model.extent()),
      forces_(VectorXd::Zero(model.size())) {
    for (const ContactTerm::Keeping& keeping : model.contact()->keepings())
        if (matrix.solves(keeping.node))
            pairs_.push_back({keeping, model.contact()->standing(keeping.obstacle, controls)});
}

// The force on a node that would be at `without` if this pair had none.
Vec3 CoulombContact::answer(const Pair& pair, const Vec3& from, const Vec3& without, double inverse) const {
    const double gap = pair.gap + pair.normal.dot(without - from);
    if (!(gap < 0.0)) return Vec3::Zero();
    const double push = -gap / inverse;
    const Vec3 slip = without - begin_.segment<3>(3 * pair.keeping.node) - pair.obstacle_move;
    Vec3 rub = -(slip - pair.normal.dot(slip) * pair.normal) / inverse;
    const double limit = pair.keeping.friction * push, wanted = rub.norm();
    if (wanted > limit) rub *= limit / wanted;
    return push * pair.normal + rub;
}

double CoulombContact::look(const VectorXd& q) {
    double off = 0.0;
    for (Pair& pair : pairs_) {
        const Vec3 x = q.segment<3>(3 * pair.keeping.node);
        const Distance at = pair.obstacle.distance(x);
        pair.gap = at.value - pair.keeping.offset;
        pair.normal = at.normal;
        pair.obstacle_move = time_ * pair.obstacle.velocity(x);
        if (pair.force.isZero(0.0)) {
            off = std::max(off, -pair.gap);
            continue;
        }
        const double own = matrix_.inverse(pair.keeping.node, pair.keeping.node);
        off = std::max(off, own * (answer(pair, x, x - own * pair.force, own) - pair.force).norm());
    }
    return off;
}

void CoulombContact::settle(const VectorXd& q, VectorXd& move) {
    constexpr int most_sweeps = 50;
    const auto reach = [&](Index node) { return Vec3(q.segment<3>(3 * node) + move.segment<3>(3 * node)); };
    std::vector<Vec3> change(pairs_.size(), Vec3::Zero());
    for (int round = 0; round < most_sweeps; ++round) {
        // Those that push, and those that would go in.
        std::vector<std::size_t> active;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            const Pair& pair = pairs_[k];
            const Vec3 x = q.segment<3>(3 * pair.keeping.node);
            if (!pair.force.isZero(0.0) || pair.gap + pair.normal.dot(reach(pair.keeping.node) - x) < 0.0)
                active.push_back(k);
        }
        std::vector<Vec3> places;
        for (const std::size_t k : active) places.push_back(reach(pairs_[k].keeping.node));
        for (int sweep = 0; sweep < most_sweeps; ++sweep) {
            double moved = 0.0;
            for (std::size_t a = 0; a < active.size(); ++a) {
                Pair& pair = pairs_[active[a]];
                const Index node = pair.keeping.node;
                const double own = matrix_.inverse(node, node);
                const Vec3 now = answer(pair, q.segment<3>(3 * node), places[a] - own * pair.force, own);
                const Vec3 more = now - pair.force;
                if (more.isZero(0.0)) continue;
                for (std::size_t b = 0; b < active.size(); ++b)
                    places[b] += matrix_.inverse(pairs_[active[b]].keeping.node, node) * more;
                pair.force = now;
                change[active[a]] += more;
                moved = std::max(moved, own * more.norm());
            }
            if (moved <= negligible_) break;
        }
        for (const std::size_t k : active) {
            if (change[k].isZero(0.0)) continue;
            matrix_.add_inverse_column(pairs_[k].keeping.node, change[k], move);
            forces_.segment<3>(3 * pairs_[k].keeping.node) += change[k];
            change[k].setZero();
        }
        const bool all = std::none_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
            const Vec3 x = q.segment<3>(3 * pair.keeping.node);
            return pair.force.isZero(0.0) &&
                   pair.gap + pair.normal.dot(reach(pair.keeping.node) - x) < -negligible_;
        });
        if (all) return;
    }
}

}  // namespace magshell
