#include "magshell/terms/contact/body_contact_term.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <utility>

#include "magshell/contact/continuous.h"
#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"

namespace magshell {
namespace {

constexpr Index pairs_per_task = 256;  // [pairs] size of a parallel task
// [-] fraction of the gap that remains after the longest admissible step
constexpr double remaining_gap = 0.1;

}  // namespace

BodyContactTerm::BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                                 const std::vector<BodyContactInput>& contacts, ContactLayer& layer,
                                 Registry& registry)
    : nodes_(nodes),
      laws_(contacts.size()),
      stiffness_(contacts.size(), 0.0),
      friction_(contacts.size()),
      least_(contacts.size(), 0.0),
      candidates_(nodes, surfaces, contacts),
      layer_(layer) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const std::string owner = "body contact " + std::to_string(c);
        const auto number = [&](const char* name, const char* unit) {
            return registry.values.add(owner, name, unit, 1, 1);
        };
        slices_.push_back({number("contact_stiffness", "Pa"), number("activation_distance", "m"),
                           number("min_distance", "m"), number("smoothing", "m"),
                           number("friction_coefficient", "1"), number("static_friction_coefficient", "1"),
                           number("sticking_speed", "m/s")});
        laws_[c].penalty = contacts[c].penalty;
        has_friction_.push_back(contacts[c].has_friction);
    }
}

bool BodyContactTerm::set_values(const Values& values) {
    std::vector<double> distances;
    for (std::size_t c = 0; c < laws_.size(); ++c) {
        const ParameterSlices& slices = slices_[c];
        BarrierLaw& law = laws_[c];
        stiffness_[c] = values.number(slices.stiffness);
        law.stiffness = factor_ * stiffness_[c];
        law.activation_distance = values.number(slices.activation_distance);
        law.min_distance = values.number(slices.min_distance);
        law.smoothing = values.number(slices.smoothing);
        friction_[c] = {values.number(slices.kinetic), values.number(slices.fixed),
                        values.number(slices.sticking_speed)};
        if (!law.penalty) least_[c] = law.min_distance;  // a penalty allows smaller distances
        distances.push_back(law.activation_distance + law.min_distance);
    }
    candidates_.set_distances(distances);
    found_.clear();
    return false;  // none of its forces cancel in add_cancelling_forces
}

void BodyContactTerm::set_factor(double factor) {
    if (factor == factor_) return;
    factor_ = factor;
    for (std::size_t c = 0; c < laws_.size(); ++c) laws_[c].stiffness = factor * stiffness_[c];
    found_.clear();
}

BodyContactTerm::ActiveContacts BodyContactTerm::found(const double* q) const {
    constexpr std::size_t most_found = 4;  // both ends of a step, and trial states between them
    VectorXd at = candidates_.contact_positions(q);
    for (const FoundAt& each : found_)
        if (each.at == at) return each.active_contacts;
    const std::vector<NearPair>& near = candidates_.near(q);
    const Index count = static_cast<Index>(near.size());
    const int blocks = static_cast<int>((count + pairs_per_task - 1) / pairs_per_task);
    if (parts_.size() < static_cast<std::size_t>(blocks)) parts_.resize(blocks);
    parallel_for(blocks, [&](int block) {
        parts_[block].clear();
        const Index first = block * pairs_per_task, last = std::min(count, first + pairs_per_task);
        for (Index k = first; k < last; ++k) {
            if (!candidates_.may_be_active(k)) continue;
            const PairPositions x = positions_of(near[k].pair, q);
            const PairEnergy pair(near[k].pair, x, laws_[near[k].contact]);
            if (!pair.acts()) continue;
            double far = 0.0;
            for (int i = 0; i < pair.count(); ++i) far = std::max(far, x[i].lpNorm<Eigen::Infinity>());
            parts_[block].push_back(
                {near[k], pair, far,
                 has_friction_[near[k].contact] ? slip_stencil(near[k], q) : SlipStencil()});
        }
    });
    // Reuses the memory of the oldest result: fresh memory costs page faults.
    std::shared_ptr<std::vector<ActiveContact>> all;
    if (found_.size() == most_found) {
        if (found_.back().active_contacts.use_count() == 1) all = std::move(found_.back().active_contacts);
        found_.pop_back();
    }
    if (!all) all = std::make_shared<std::vector<ActiveContact>>();
    all->clear();
    for (int block = 0; block < blocks; ++block)
        all->insert(all->end(), parts_[block].begin(), parts_[block].end());
    found_.push_front({std::move(at), std::move(all)});
    return found_.front().active_contacts;
}

SlipStencil BodyContactTerm::slip_stencil(const NearPair& near, const double* q) const {
    const SurfacePair& surfaces = candidates_.phase().contacts()[near.contact];
    const ContactSurface& second = candidates_.phase().surfaces()[near.swapped ? surfaces.a : surfaces.b];
    return {near.pair, second.faces[near.second_face], q};
}

double BodyContactTerm::slope(const std::vector<ActiveContact>& active_contacts, const double* p) {
    double sum = 0.0;
    for (const ActiveContact& active : active_contacts) {
        const PairVectors gradient = active.at.gradient();
        for (int k = 0; k < active.at.count(); ++k)
            sum += gradient[k].dot(Eigen::Map<const Vec3>(p + 3 * active.near.pair.nodes[k]));
    }
    return sum;
}

double BodyContactTerm::curvature(const double* p) const {
    double sum = 0.0;
    for (const ActiveContact& active : evaluated_contacts()) {
        const PairVectors gradient = active.at.gradient(), stiffness = active.at.normal_force_by_position();
        double slope = 0.0, pushed = 0.0;
        for (int k = 0; k < active.at.count(); ++k) {
            const Eigen::Map<const Vec3> moved(p + 3 * active.near.pair.nodes[k]);
            slope += gradient[k].dot(moved);
            pushed += stiffness[k].dot(moved);
        }
        const double force = active.at.normal_force();
        if (force != 0.0) sum += pushed * slope / force;
    }
    return sum;
}

void BodyContactTerm::add_stiffness(std::vector<PairStiffness>& out) const {
    for (const ActiveContact& active : evaluated_contacts()) {
        const double stiffness = active.at.normal_stiffness();
        const Proximity& near = active.at.near();
        if (stiffness > 0.0)
            out.push_back({active.near.pair.nodes, active.at.count(), near.weights,
                           stiffness * near.normal * near.normal.transpose()});
    }
}

// Hard contact leaves out nearly parallel edges, whose closest points are undetermined, and edges whose closest
// point is an end: a pair of a vertex and a face covers the latter.
std::vector<BodyContactTerm::HardContactPair> BodyContactTerm::hard_contact_pairs(const double* q) const {
    std::vector<HardContactPair> hard;
    for (const NearPair& near : candidates_.near(q)) {
        const bool edges = near.pair.kind == PairKind::edge_edge;
        if (!edges && near.pair.kind != PairKind::point_triangle) continue;
        const PairPositions x = positions_of(near.pair, q);
        if (edges && !((x[1] - x[0]).cross(x[3] - x[2]).squaredNorm() > near.pair.parallel)) continue;
        const Proximity at = proximity(near.pair.kind, x);
        if (edges && at.free < 2) continue;
        const BarrierLaw law = near.pair.scaled(laws_[near.contact]);
        hard.push_back({near, at, at.distance - law.activation_distance - law.min_distance,
                        friction_[near.contact].kinetic});
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
    const ActiveContact* most = nullptr;
    for (const ActiveContact& active : evaluated_contacts())
        if (!most || active.at.normal_force() > most->at.normal_force()) most = &active;
    return most ? candidates_.describe(most->near) + " push each other hardest" : std::string();
}

std::pair<double, std::string> BodyContactTerm::nearest_neighbours(Index contact) const {
    const auto& nearest = candidates_.nearest_neighbours(contact);
    if (!nearest) return {std::numeric_limits<double>::infinity(), {}};
    return {nearest->distance, candidates_.describe(nearest->near)};
}

double BodyContactTerm::energy(const double* q, const LoadParameters&) const {
    if (switched_off_) return 0.0;
    double total = 0.0;
    for (const ActiveContact& active : *found(q)) total += active.at.energy();
    return total;
}

void BodyContactTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    evaluated_contacts_ = switched_off_ ? std::make_shared<const std::vector<ActiveContact>>() : found(q);
    for (const ActiveContact& active : *evaluated_contacts_) {
        const PairVectors gradient = active.at.gradient();
        for (int k = 0; k < active.at.count(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * active.near.pair.nodes[k] + axis, gradient[k][axis]);
    }
}

void BodyContactTerm::set_extra_couplings(const std::vector<ActiveContact>& active_contacts) {
    extra_couplings_.clear();
    for (const ActiveContact& active : active_contacts) {
        extra_couplings_.push_back(active.near.pair.nodes);
        if (const ContactLayer::Group further = active.slip.further_couplings(); further[0] >= 0)
            extra_couplings_.push_back(further);
    }
}

void BodyContactTerm::prepare_assembly(const double* q, const LoadParameters&) {
    // The layer is not used as long as there is no contact, because it more than doubles the work of a
    // factorization.
    constexpr int patience = 4;  // [-] assemblies without contact after which the layer is dropped
    assemblies_without_contact_ =
        evaluated_contacts().empty() && extra_couplings_.empty() ? assemblies_without_contact_ + 1 : 0;
    layer_.matrix().clear();
    layer_.use(assemblies_without_contact_ == 0 ||
               (layer_.used() && assemblies_without_contact_ <= patience));
    if (assemblies_without_contact_ > 0) return;
    ++assemblies_since_coupling_;
    const std::vector<NearPair>& near = candidates_.near(q);
    const bool coupled =
        (candidates_.covers_all_candidates(coupled_margin_) ||
         std::all_of(evaluated_contacts().begin(), evaluated_contacts().end(),
                     [&](const ActiveContact& active) { return layer_.couples(active.near.pair.nodes); })) &&
        std::all_of(
            evaluated_contacts().begin(), evaluated_contacts().end(),
            [&](const ActiveContact& active) { return layer_.couples(active.slip.further_couplings()); }) &&
        std::all_of(extra_couplings_.begin(), extra_couplings_.end(),
                    [&](const ContactLayer::Group& group) { return layer_.couples(group); });
    if (!coupled) {
        if (assemblies_since_coupling_ <= often) ahead_ = std::min(2.0 * ahead_, 1.0);
        assemblies_since_coupling_ = 0;
        std::vector<ContactLayer::Group> groups = extra_couplings_;
        coupled_margin_ = candidates_.margin_ahead(ahead_);
        for (std::size_t k = 0; k < near.size(); ++k)
            if (candidates_.may_be_active(k, coupled_margin_)) {
                groups.push_back(near[k].pair.nodes);
                if (!has_friction_[near[k].contact] || near[k].pair.kind != PairKind::edge_edge) continue;
                if (const ContactLayer::Group further = slip_stencil(near[k], q).further_couplings();
                    further[0] >= 0)
                    groups.push_back(further);
            }
        layer_.add_couplings(std::move(groups));
    }
}

void BodyContactTerm::finish_assembly(const double*, const LoadParameters&, SystemMatrix&) const {
    for (const ActiveContact& active : evaluated_contacts()) {
        PairBlocks blocks;
        active.at.hessian(psd_projection_, blocks);
        layer_.add(active.near.pair.nodes,
                   [&](int i, int j) -> const Mat3& { return blocks[i * (i + 1) / 2 + j]; });
    }
}

void BodyContactTerm::vjp(const double*, const LoadParameters&, const double* lambda, Gradient& out) {
    for (const ActiveContact& active : evaluated_contacts())
        add_vjp(active, active.at.vjp(positions_of(active.near.pair, lambda)), {}, factor_, out.values);
}

void BodyContactTerm::add_rest_vjp(const double*, const LoadParameters&, const double* lambda,
                                   VectorXd& out) {
    ContactRest by_rest = rest_gradient();
    for (const ActiveContact& active : evaluated_contacts())
        by_rest.add(active.near, active.at.pair_vjp(positions_of(active.near.pair, lambda)));
    by_rest.add_to(out);
}

void BodyContactTerm::add_vjp(const ActiveContact& active, const PairEnergy::ByLaw& by,
                              const FrictionLaw& by_friction, double factor, VectorXd& by_values) const {
    const ParameterSlices& slices = slices_[active.near.contact];
    by_values[slices.stiffness.first] += factor * by.stiffness;
    by_values[slices.activation_distance.first] += by.activation_distance;
    by_values[slices.min_distance.first] += by.min_distance;
    by_values[slices.smoothing.first] += by.smoothing;
    by_values[slices.kinetic.first] += by_friction.kinetic;
    by_values[slices.fixed.first] += by_friction.fixed;
    by_values[slices.sticking_speed.first] += by_friction.sticking_speed;
}

void BodyContactTerm::add_cancelling_normal_forces(VectorXd& out) const {
    for (const ActiveContact& active : evaluated_contacts()) {
        const PairVectors stiffness = active.at.normal_force_by_position();
        for (int k = 0; k < active.at.count(); ++k)
            out.segment<3>(3 * active.near.pair.nodes[k]).array() += stiffness[k].norm() * active.far;
    }
}

template <class Found>
void BodyContactTerm::each_limit(const double* q, const double* p, const Found& found) const {
    // A long path is searched in pieces, as the boxes of one that is swept at once would meet nearly all others.
    constexpr int most_pieces = 64;  // see test_a_body_in_free_fall_takes_few_factorizations
    const double piece = candidates_.max_displacement() / candidates_.largest_displacement(p);
    if (!(piece > 0.0)) return found(nullptr, 0.0);
    if (most_pieces * piece < 1.0) found(nullptr, most_pieces * piece);
    VectorXd at = Eigen::Map<const VectorXd>(q, 3 * nodes_.n_nodes());
    for (int k = 0; k < most_pieces && k * piece < 1.0; ++k) {
        const double begin = k * piece, whole = std::min(1.0, begin + piece) - begin;
        double share = whole;
        for (const NearPair& each : candidates_.near_along_path(at.data(), p, whole, least_)) {
            const PairPositions from = positions_of(each.pair, at.data());
            PairPositions to = positions_of(each.pair, p);
            for (int i = 0; i < nodes_of(each.pair.kind); ++i) to[i] = from[i] + share * to[i];
            const double least = each.pair.distance_scale(laws_[each.contact]) * least_[each.contact];
            const double own = collision_free_step(each.pair.kind, from, to, least, remaining_gap);
            if (own >= 1.0) continue;
            share *= own;
            found(&each, begin + share);
        }
        if (share < whole) return;
        at += whole * Eigen::Map<const VectorXd>(p, at.size());
    }
}

double BodyContactTerm::max_step_length(const double* q, const double* p) const {
    double share = 1.0;
    each_limit(q, p, [&](const NearPair*, double limit) { share = limit; });
    return share;
}

std::string BodyContactTerm::blocking(const double* q, const double* p) const {
    std::string text = "a step is not finite";
    each_limit(q, p, [&](const NearPair* pair, double) {
        if (pair) text = candidates_.describe(*pair) + " are in each other's way";
    });
    return text;
}

std::string BodyContactTerm::invalid_state_reason(const double* q) const {
    const std::vector<NearPair> crossing = candidates_.crossings(q);
    if (!crossing.empty()) {
        const std::string more =
            crossing.size() > 1 ? ", the first of " + std::to_string(crossing.size()) + " such pairs" : "";
        return candidates_.describe(crossing.front()) + " pass through each other" + more;
    }
    const NearPair* worst = nullptr;
    double gap = 0.0, distance = 0.0, least = 0.0;
    const ActiveContacts active_contacts = found(q);  // pairs that are too close are active
    for (const ActiveContact& active : *active_contacts) {
        const NearPair& each = active.near;
        const double at = active.at.near().distance,
                     may_be = each.pair.distance_scale(laws_[each.contact]) * least_[each.contact];
        if (at - may_be > gap || (worst && at - may_be == gap)) continue;
        worst = &each;
        gap = at - may_be;
        distance = at;
        least = may_be;
    }
    if (!worst) return {};
    std::ostringstream text;
    text << candidates_.describe(*worst) << " are " << distance << " m apart, but must be farther than "
         << least << " m from each other";
    return text.str();
}

std::size_t BodyContactTerm::bytes() const {
    std::size_t active_contacts = 0;
    for (const FoundAt& each : found_) active_contacts += each.active_contacts->capacity();
    for (const std::vector<ActiveContact>& part : parts_) active_contacts += part.capacity();
    return candidates_.bytes() + layer_.bytes() + active_contacts * sizeof(ActiveContact);
}

}  // namespace magshell
