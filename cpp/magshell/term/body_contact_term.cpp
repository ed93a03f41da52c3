#include "magshell/term/body_contact_term.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <utility>

#include "magshell/contact/continuous.h"
#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"

namespace magshell {
namespace {

constexpr Index block_length = 256;  // pairs a task
constexpr double kept = 0.1;         // of a gap, at the end of the longest step

}  // namespace

BodyContactTerm::BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                                 const std::vector<BodyContactInput>& contacts, ContactLayer& layer,
                                 Registry& registry)
    : laws_(contacts.size()),
      friction_(contacts.size()),
      least_(contacts.size(), 0.0),
      candidates_(nodes, surfaces, contacts),
      layer_(layer) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const std::string owner = "body contact " + std::to_string(c);
        const auto number = [&](const char* name, const char* unit) {
            return registry.values.add(owner, name, unit, 1, 1);
        };
        slots_.push_back({number("contact_stiffness", "Pa"), number("reach", "m"),
                          number("minimal_distance", "m"), number("smoothing", "m"),
                          number("friction_coefficient", "1"), number("static_friction_coefficient", "1"),
                          number("sticking_speed", "m/s")});
        laws_[c].penalty = contacts[c].penalty;
    }
}

bool BodyContactTerm::set_values(const Values& values) {
    std::vector<double> distances;
    for (std::size_t c = 0; c < laws_.size(); ++c) {
        const Slots& slots = slots_[c];
        BarrierLaw& law = laws_[c];
        law.stiffness = values.number(slots.stiffness);
        law.reach = values.number(slots.reach);
        law.thickness = values.number(slots.distance);
        law.smoothing = values.number(slots.smoothing);
        friction_[c] = {values.number(slots.kinetic), values.number(slots.fixed),
                        values.number(slots.sticking_speed)};
        if (!law.penalty) least_[c] = law.thickness;  // a penalty lets more in
        distances.push_back(law.reach + law.thickness);
    }
    candidates_.set_distances(distances);
    found_.clear();
    return false;  // none of its forces cancel in add_cancelling_forces
}

BodyContactTerm::Touches BodyContactTerm::found(const double* q) const {
    constexpr std::size_t most_found = 4;  // a step's two ends, and trials between them
    VectorXd at = candidates_.places(q);
    for (const FoundAt& each : found_)
        if (each.at == at) return each.touches;
    const std::vector<NearPair>& near = candidates_.near(q);
    const Index count = static_cast<Index>(near.size());
    const int blocks = static_cast<int>((count + block_length - 1) / block_length);
    if (parts_.size() < static_cast<std::size_t>(blocks)) parts_.resize(blocks);
    parallel_for(blocks, [&](int block) {
        parts_[block].clear();
        const Index first = block * block_length, last = std::min(count, first + block_length);
        for (Index k = first; k < last; ++k) {
            if (!candidates_.may_touch(k)) continue;
            const PairPlaces x = places_of(near[k].pair, q);
            const PairEnergy pair(near[k].pair, x, laws_[near[k].contact]);
            if (!pair.acts()) continue;
            double far = 0.0;
            for (int i = 0; i < pair.count(); ++i) far = std::max(far, x[i].lpNorm<Eigen::Infinity>());
            parts_[block].push_back({near[k], pair, far});
        }
    });
    // Fresh memory costs page faults: that of what was found long ago will do.
    std::shared_ptr<std::vector<Touch>> all;
    if (found_.size() == most_found) {
        if (found_.back().touches.use_count() == 1) all = std::move(found_.back().touches);
        found_.pop_back();
    }
    if (!all) all = std::make_shared<std::vector<Touch>>();
    all->clear();
    for (int block = 0; block < blocks; ++block)
        all->insert(all->end(), parts_[block].begin(), parts_[block].end());
    found_.push_front({std::move(at), std::move(all)});
    return found_.front().touches;
}

double BodyContactTerm::slope(const std::vector<Touch>& touches, const double* p) {
    double sum = 0.0;
    for (const Touch& touch : touches) {
        const PairVectors gradient = touch.at.gradient();
        for (int k = 0; k < touch.at.count(); ++k)
            sum += gradient[k].dot(Eigen::Map<const Vec3>(p + 3 * touch.near.pair.nodes[k]));
    }
    return sum;
}

double BodyContactTerm::curvature(const double* p) const {
    double sum = 0.0;
    for (const Touch& touch : touching()) {
        const PairVectors gradient = touch.at.gradient(), stiffness = touch.at.normal_force_by_place();
        double slope = 0.0, pushed = 0.0;
        for (int k = 0; k < touch.at.count(); ++k) {
            const Eigen::Map<const Vec3> moved(p + 3 * touch.near.pair.nodes[k]);
            slope += gradient[k].dot(moved);
            pushed += stiffness[k].dot(moved);
        }
        const double force = touch.at.normal_force();
        if (force != 0.0) sum += pushed * slope / force;
    }
    return sum;
}

void BodyContactTerm::add_stiffness(std::vector<PairStiffness>& out) const {
    for (const Touch& touch : touching()) {
        const double stiffness = touch.at.normal_stiffness();
        const Proximity& near = touch.at.near();
        if (stiffness > 0.0)
            out.push_back({touch.near.pair.nodes, touch.at.count(), near.weights,
                           stiffness * near.normal * near.normal.transpose()});
    }
}

// Where edges are nearly parallel their closest points are anywhere, and where one's is an end, that end and a face are near.
std::vector<BodyContactTerm::HardPair> BodyContactTerm::hard_pairs(const double* q) const {
    std::vector<HardPair> hard;
    for (const NearPair& near : candidates_.near(q)) {
        const bool edges = near.pair.kind == PairKind::edge_edge;
        if (!edges && near.pair.kind != PairKind::point_triangle) continue;
        const PairPlaces x = places_of(near.pair, q);
        if (edges && !((x[1] - x[0]).cross(x[3] - x[2]).squaredNorm() > near.pair.parallel)) continue;
        const Proximity at = proximity(near.pair.kind, x);
        if (edges && at.free < 2) continue;
        const BarrierLaw law = near.pair.scaled(laws_[near.contact]);
        hard.push_back({near, at, at.distance - law.reach - law.thickness, friction_[near.contact].kinetic});
    }
    return hard;
}

void BodyContactTerm::require_one_coefficient() const {
    for (const FrictionLaw& law : friction_)
        if (law.fixed != law.kinetic)
            throw InvalidInput(
                "Coulomb's law node by node has one coefficient of friction: take no "
                "static_friction_coefficient");
}

std::string BodyContactTerm::hardest() const {
    const Touch* most = nullptr;
    for (const Touch& touch : touching())
        if (!most || touch.at.normal_force() > most->at.normal_force()) most = &touch;
    return most ? candidates_.names(most->near) + " push each other hardest" : std::string();
}

std::pair<double, std::string> BodyContactTerm::nearest_neighbours(Index contact) const {
    const auto& nearest = candidates_.nearest_neighbours(contact);
    if (!nearest) return {std::numeric_limits<double>::infinity(), {}};
    return {nearest->distance, candidates_.names(nearest->near)};
}

double BodyContactTerm::energy(const double* q, const Controls&) const {
    if (aside_) return 0.0;
    double total = 0.0;
    for (const Touch& touch : *found(q)) total += touch.at.energy();
    return total;
}

void BodyContactTerm::evaluate(const double* q, const Controls&, Residual& out) {
    touching_ = aside_ ? std::make_shared<const std::vector<Touch>>() : found(q);
    for (const Touch& touch : *touching_) {
        const PairVectors gradient = touch.at.gradient();
        for (int k = 0; k < touch.at.count(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * touch.near.pair.nodes[k] + axis, gradient[k][axis]);
    }
}

void BodyContactTerm::keep_coupled(const std::vector<Touch>& touches) {
    kept_.clear();
    for (const Touch& touch : touches) kept_.push_back(touch.near.pair.nodes);
}

void BodyContactTerm::prepare_assembly(const double* q, const Controls&) {
    // Without it, as long as nothing touches: it more than doubles the work of a factorization.
    constexpr int soon = 4;  // assemblies, after which it may touch again
    untouched_ = touching().empty() && kept_.empty() ? untouched_ + 1 : 0;
    layer_.matrix().clear();
    layer_.use(untouched_ == 0 || (layer_.used() && untouched_ <= soon));
    if (untouched_ > 0) return;
    ++assembled_;
    const std::vector<NearPair>& near = candidates_.near(q);
    const bool coupled =
        (candidates_.only_those_before(soon_) ||
         std::all_of(touching().begin(), touching().end(),
                     [&](const Touch& touch) { return layer_.couples(touch.near.pair.nodes); })) &&
        std::all_of(kept_.begin(), kept_.end(),
                    [&](const ContactLayer::Group& group) { return layer_.couples(group); });
    if (!coupled) {
        if (assembled_ <= often) ahead_ = std::min(2.0 * ahead_, 1.0);
        assembled_ = 0;
        std::vector<ContactLayer::Group> groups = kept_;
        soon_ = candidates_.soon(ahead_);
        for (std::size_t k = 0; k < near.size(); ++k)
            if (candidates_.may_touch(k, soon_)) groups.push_back(near[k].pair.nodes);
        layer_.add_couplings(std::move(groups));
    }
}

void BodyContactTerm::finish_assembly(const double*, const Controls&, SystemMatrix&) const {
    for (const Touch& touch : touching()) {
        PairBlocks blocks;
        touch.at.hessian(cautious_, blocks);
        layer_.add(touch.near.pair.nodes,
                   [&](int i, int j) -> const Mat3& { return blocks[i * (i + 1) / 2 + j]; });
    }
}

void BodyContactTerm::vjp(const double*, const Controls&, const double* lambda, Gradient& out) {
    for (const Touch& touch : touching())
        add_vjp(touch, touch.at.vjp(places_of(touch.near.pair, lambda)), {}, out.values);
}

void BodyContactTerm::add_vjp(const Touch& touch, const PairEnergy::ByLaw& by, const FrictionLaw& by_friction,
                              VectorXd& by_values) const {
    const Slots& slots = slots_[touch.near.contact];
    by_values[slots.stiffness.first] += by.stiffness;
    by_values[slots.reach.first] += by.reach;
    by_values[slots.distance.first] += by.thickness;
    by_values[slots.smoothing.first] += by.smoothing;
    by_values[slots.kinetic.first] += by_friction.kinetic;
    by_values[slots.fixed.first] += by_friction.fixed;
    by_values[slots.sticking_speed.first] += by_friction.sticking_speed;
}

void BodyContactTerm::add_cancelling_normal_forces(VectorXd& out) const {
    for (const Touch& touch : touching()) {
        const PairVectors stiffness = touch.at.normal_force_by_place();
        for (int k = 0; k < touch.at.count(); ++k)
            out.segment<3>(3 * touch.near.pair.nodes[k]).array() += stiffness[k].norm() * touch.far;
    }
}

template <class Found>
void BodyContactTerm::each_limit(const double* q, const double* p, const Found& found) const {
    double share = std::min(1.0, candidates_.longest_way() / candidates_.longest_move(p));
    if (!(share > 0.0)) return found(nullptr, 0.0);
    if (share < 1.0) found(nullptr, share);
    for (const NearPair& each : candidates_.on_the_way(q, p, share, least_)) {
        const PairPlaces from = places_of(each.pair, q);
        PairPlaces to = places_of(each.pair, p);
        for (int k = 0; k < nodes_of(each.pair.kind); ++k) to[k] = from[k] + share * to[k];
        const double least = each.pair.share(laws_[each.contact]) * least_[each.contact];
        const double own = free_share(each.pair.kind, from, to, least, kept);
        if (own >= 1.0) continue;
        share *= own;
        found(&each, share);
    }
}

double BodyContactTerm::max_step_length(const double* q, const double* p) const {
    double share = 1.0;
    each_limit(q, p, [&](const NearPair*, double limit) { share = limit; });
    return share;
}

std::string BodyContactTerm::blocking(const double* q, const double* p) const {
    std::string names = "a step is not finite";
    each_limit(q, p, [&](const NearPair* pair, double) {
        if (pair) names = candidates_.names(*pair) + " are in each other's way";
    });
    return names;
}

std::string BodyContactTerm::invalid_state_reason(const double* q) const {
    const std::vector<NearPair> crossing = candidates_.crossings(q);
    if (!crossing.empty()) {
        const std::string more =
            crossing.size() > 1 ? ", the first of " + std::to_string(crossing.size()) + " such pairs" : "";
        return candidates_.names(crossing.front()) + " pass through each other" + more;
    }
    const NearPair* worst = nullptr;
    double gap = 0.0, distance = 0.0, least = 0.0;
    const Touches touches = found(q);  // pairs that are too near touch
    for (const Touch& touch : *touches) {
        const NearPair& each = touch.near;
        const double at = touch.at.near().distance,
                     may_be = each.pair.share(laws_[each.contact]) * least_[each.contact];
        if (at - may_be > gap || (worst && at - may_be == gap)) continue;
        worst = &each;
        gap = at - may_be;
        distance = at;
        least = may_be;
    }
    if (!worst) return {};
    std::ostringstream text;
    text << candidates_.names(*worst) << " are " << distance << " m apart, but must be farther than " << least
         << " m from each other";
    return text.str();
}

std::size_t BodyContactTerm::bytes() const {
    std::size_t touches = 0;
    for (const FoundAt& each : found_) touches += each.touches->capacity();
    for (const std::vector<Touch>& part : parts_) touches += part.capacity();
    return candidates_.bytes() + layer_.bytes() + touches * sizeof(Touch);
}

}  // namespace magshell
