#include "magshell/solve/projective/coulomb_contact.h"

#include <algorithm>
#include <numeric>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// [-] Penetration that counts as none, over the extent; see test_block_slides_above_the_angle_with_full_friction.
constexpr double negligible_gap = 1e-14;

}  // namespace

ScopedContactOff::ScopedContactOff(const Model& model) : model_(model) {
    stand(true);
}

void ScopedContactOff::stand(bool aside) const {
    model_.contacts().set_switched_off(aside);
}

CoulombContact::CoulombContact(const Model& model, const ConstantMatrix& matrix,
                               const LoadParameters& load_parameters, const VectorXd& begin, double time)
    : model_(model),
      matrix_(matrix),
      begin_(begin),
      time_(time),
      negligible_(negligible_gap * model.extent()),
      forces_(VectorXd::Zero(model.size())) {
    matrix.require_isotropic();
    for (const ContactTerm::HardContact& keeping : model.contacts().hard_points()) {
        if (!matrix.solves(keeping.node)) continue;
        obstacles_.push_back({keeping, model.contacts().obstacle_state(keeping.obstacle, load_parameters)});
        pairs_.push_back({{keeping.node, -1, -1, -1}, 1, {1.0, 0.0, 0.0, 0.0}, keeping.friction});
    }
}

Vec3 CoulombContact::contact_force(const Pair& pair, const Vec3& ahead, const Vec3& without,
                                   double own) const {
    const double gap = pair.gap + pair.normal.dot(ahead);
    if (!(gap < 0.0)) return Vec3::Zero();
    const double push = -gap / own;
    const Vec3 slip = without - pair.of(begin_) - pair.prescribed;
    Vec3 rub = -(slip - pair.normal.dot(slip) * pair.normal) / own;
    const double limit = pair.friction * push, wanted = rub.norm();
    if (wanted > limit) rub *= limit / wanted;
    return push * pair.normal + rub;
}

void CoulombContact::update_obstacle_pairs(const VectorXd& q) {
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        Pair& pair = pairs_[k];
        const Vec3 x = q.segment<3>(3 * pair.nodes[0]);
        const Distance at = obstacles_[k].obstacle.distance(x);
        pair.gap = at.value - obstacles_[k].keeping.offset;
        pair.normal = at.normal;
        pair.prescribed = time_ * obstacles_[k].obstacle.velocity(x);
    }
}

// Finds the pairs that are near at q. Pairs that were near before keep their forces.
void CoulombContact::update_body_pairs(const VectorXd& q) {
    using Key = std::array<Index, 6>;
    const auto key = [](const NearPair& near) {
        const std::array<Index, 4>& n = near.pair.nodes;
        return Key{near.contact, static_cast<Index>(near.pair.kind), n[0], n[1], n[2], n[3]};
    };
    std::map<Key, Vec3> pushed;
    for (std::size_t k = 0; k < between_.size(); ++k)
        if (const Pair& pair = pairs_[obstacles_.size() + k]; !pair.force.isZero(0.0))
            pushed[key(between_[k].near)] = pair.force;
    between_ = model_.contacts().hard_pairs(q);
    std::erase_if(between_, [&](const BodyContactTerm::HardContactPair& each) {
        return std::none_of(each.near.pair.nodes.begin(), each.near.pair.nodes.end(),
                            [&](Index node) { return node >= 0 && matrix_.solves(node); });
    });
    pairs_.erase(pairs_.begin() + static_cast<std::ptrdiff_t>(obstacles_.size()), pairs_.end());
    for (const BodyContactTerm::HardContactPair& each : between_) {
        Pair& pair = pairs_.emplace_back(Pair{each.near.pair.nodes, nodes_of(each.near.pair.kind),
                                              each.at.weights, each.friction, each.gap, each.at.normal});
        if (const auto found = pushed.find(key(each.near)); found != pushed.end()) pair.force = found->second;
    }
}

Eigen::MatrixXd CoulombContact::compliance(const std::vector<std::size_t>& of) const {
    std::vector<ConstantMatrix::Forces> columns;
    for (const std::size_t k : of) {
        ConstantMatrix::Forces& column = columns.emplace_back();
        column.nodes = pairs_[k].nodes;
        column.count = pairs_[k].count;
        for (int i = 0; i < column.count; ++i) column.forces[i] = pairs_[k].weights[i] * Vec3::UnitX();
    }
    return matrix_.compliance(columns);
}

double CoulombContact::assess(const VectorXd& q) {
    update_obstacle_pairs(q);
    update_body_pairs(q);
    double off = 0.0;
    std::vector<std::size_t> pushing;
    for (std::size_t k = 0; k < pairs_.size(); ++k)
        if (pairs_[k].force.isZero(0.0))
            off = std::max(off, -pairs_[k].gap);
        else
            pushing.push_back(k);
    const VectorXd own = compliance(pushing).diagonal();
    for (std::size_t a = 0; a < pushing.size(); ++a) {
        const Pair& pair = pairs_[pushing[a]];
        const Vec3 back = -own[a] * pair.force;
        off = std::max(off,
                       own[a] * (contact_force(pair, back, pair.of(q) + back, own[a]) - pair.force).norm());
    }
    return off;
}

void CoulombContact::apply_forces(VectorXd& move) {
    VectorXd now = VectorXd::Zero(forces_.size());
    for (const Pair& pair : pairs_)
        for (int i = 0; i < pair.count; ++i)
            now.segment<3>(3 * pair.nodes[i]) += pair.weights[i] * pair.force;
    VectorXd change = model_.dof_map().vector(now - forces_);
    forces_ = std::move(now);
    if (change.isZero(0.0)) return;
    matrix_.solve(change);
    move += model_.dof_map().expand(change);
}

void CoulombContact::solve_forces(const VectorXd& q, VectorXd& move) {
    // Limits of the active-set loop and of the Gauss-Seidel sweeps; see test_a_block_sticks_or_slides_on_another.
    constexpr int max_rounds = 50, max_sweeps = 200;
    // [-] Reduction of the largest displacement, relative to the first sweep, that ends the sweeps: the next iteration moves the
    // nodes anyway. See test_block_sticks_below_the_angle_of_friction.
    constexpr double sweep_tolerance = 1e-4;
    apply_forces(move);  // the closest points have moved
    for (int round = 0; round < max_rounds; ++round) {
        // Collects the pairs that carry a force or would interpenetrate.
        std::vector<std::size_t> active;
        bool more_go_in = false;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            const Pair& pair = pairs_[k];
            const bool pushes = !pair.force.isZero(0.0);
            const double gap = pair.gap + pair.normal.dot(pair.of(move));
            if (pushes || gap < 0.0) active.push_back(k);
            more_go_in |= !pushes && gap < -negligible_;
        }
        if (round > 0 && !more_go_in) return;
        const Eigen::MatrixXd between = compliance(active);
        std::vector<Vec3> ahead;  // displacement of the active pairs since q
        for (const std::size_t k : active) ahead.push_back(pairs_[k].of(move));
        double enough = negligible_;
        for (int sweep = 0; sweep < max_sweeps; ++sweep) {
            double moved = 0.0;
            for (std::size_t a = 0; a < active.size(); ++a) {
                Pair& pair = pairs_[active[a]];
                const double own = between(a, a);
                const Vec3 without = ahead[a] - own * pair.force;
                const Vec3 more = contact_force(pair, without, pair.of(q) + without, own) - pair.force;
                if (more.isZero(0.0)) continue;
                for (std::size_t b = 0; b < active.size(); ++b) ahead[b] += between(b, a) * more;
                pair.force += more;
                moved = std::max(moved, own * more.norm());
            }
            if (sweep == 0) enough = std::max(enough, sweep_tolerance * moved);
            if (moved <= enough) break;
        }
        apply_forces(move);
    }
}

}  // namespace magshell
