#include "magshell/term/body_contact_term.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "magshell/core/parallel.h"

namespace magshell {
namespace {

constexpr Index block_length = 256;  // pairs a task

// How far a pair may go along p until its distance is `least`: steps of the distance's own length cannot miss.
double share_of(const ContactPair& pair, const PairPlaces& x, const PairPlaces& p, double least, double most) {
    constexpr double of_gap = 0.1;  // that is left at the end
    const int first = pair.kind == PairKind::edge_edge ? 2 : 1;
    Vec3 mean = Vec3::Zero();
    for (const Vec3& each : p) mean += 0.25 * each;
    double fastest[2] = {0.0, 0.0};
    for (int k = 0; k < 4; ++k) {
        double& of = fastest[k < first ? 0 : 1];
        of = std::max(of, (p[k] - mean).norm());
    }
    const double speed = fastest[0] + fastest[1];
    double gap = pair_distance(pair.kind, x) - least, share = 0.0;
    if (gap >= speed * most) return most;
    const double enough = of_gap * gap;
    if (!(gap > 0.0)) return 0.0;
    for (int k = 0; k < 10000; ++k) {
        const double ahead = (1.0 - of_gap) * gap / speed;
        PairPlaces there;
        for (int i = 0; i < 4; ++i) there[i] = x[i] + (share + ahead) * p[i];
        gap = pair_distance(pair.kind, there) - least;
        if (share > 0.0 && gap < enough) return share;
        share += ahead;
        if (share >= most) return most;
    }
    return share;
}

}  // namespace

BodyContactTerm::BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                                 const std::vector<BodyContactInput>& contacts, ContactLayer& layer,
                                 Registry& registry)
    : laws_(contacts.size()), rubbing_(contacts.size()), near_(nodes, surfaces, contacts), layer_(layer) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const std::string owner = "body contact " + std::to_string(c);
        const auto number = [&](const char* name, const char* unit) {
            return registry.values.add(owner, name, unit, 1, 1);
        };
        slots_.push_back({number("contact_stiffness", "Pa"),
                          number("reach", "m"),
                          number("minimal_distance", "m"),
                          number("smoothing", "m"),
                          {number("friction_coefficient", "1"), number("static_friction_coefficient", "1"),
                           number("sticking_speed", "m/s")}});
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
        rubbing_[c] = {values.number(slots.friction[0]), values.number(slots.friction[1]),
                       values.number(slots.friction[2])};
        distances.push_back(law.reach + law.thickness);
    }
    near_.set_distances(std::move(distances));
    return false;  // none of its forces cancel in add_cancelling_forces
}

std::vector<BodyContactTerm::Touch> BodyContactTerm::touches(const double* q) const {
    const std::vector<NearPair>& near = near_.at(q);
    const Index count = static_cast<Index>(near.size());
    std::vector<std::vector<Touch>> found((count + block_length - 1) / block_length);
    parallel_for(static_cast<int>(found.size()), [&](int block) {
        const Index first = block * block_length, last = std::min(count, first + block_length);
        for (Index k = first; k < last; ++k) {
            const PairPlaces x = places(near[k].pair, q);
            const PairEnergy at(near[k].pair, x, laws_[near[k].contact]);
            if (at.acts())
                found[block].push_back({near[k].contact, near[k].pair, at, x[0].lpNorm<Eigen::Infinity>()});
        }
    });
    std::vector<Touch> all;
    for (const std::vector<Touch>& part : found) all.insert(all.end(), part.begin(), part.end());
    return all;
}

double BodyContactTerm::energy(const double* q, const Controls&) const {
    double total = 0.0;
    for (const Touch& touch : touches(q)) total += touch.at.energy();
    return total;
}

void BodyContactTerm::evaluate(const double* q, const Controls&, Residual& out) {
    touching_ = touches(q);
    for (const Touch& touch : touching_) {
        const PairVectors gradient = touch.at.gradient();
        for (int k = 0; k < nodes_of(touch.pair.kind); ++k)
            for (int axis = 0; axis < 3; ++axis) out.add(3 * touch.pair.nodes[k] + axis, gradient[k][axis]);
    }
}

void BodyContactTerm::prepare_assembly(const double* q, const Controls&) {
    const bool grown = std::any_of(touching_.begin(), touching_.end(), [&](const Touch& touch) {
        return !layer_.couples(touch.pair.nodes);
    });
    if (grown) {
        std::vector<ContactLayer::Group> groups;
        for (const NearPair& each : near_.at(q)) groups.push_back(each.pair.nodes);
        layer_.couple(std::move(groups), false);
    }
    layer_.matrix().clear();
}

void BodyContactTerm::finish_assembly(const double*, const Controls&, SystemMatrix&) const {
    for (const Touch& touch : touching_) {
        PairBlocks blocks;
        touch.at.hessian(cautious_, blocks);
        layer_.add(touch.pair.nodes, [&](int i, int j) -> const Mat3& { return blocks[i * (i + 1) / 2 + j]; });
    }
}

void BodyContactTerm::vjp(const double*, const Controls&, const double* lambda, Gradient& out) {
    for (const Touch& touch : touching_)
        add_vjp(touch.contact, touch.at.vjp(places(touch.pair, lambda)), out.values);
}

void BodyContactTerm::add_vjp(Index contact, const PairEnergy::ByLaw& by, VectorXd& by_values) const {
    const Slots& slots = slots_[contact];
    by_values[slots.stiffness.first] += by.stiffness;
    by_values[slots.reach.first] += by.reach;
    by_values[slots.distance.first] += by.thickness;
    by_values[slots.smoothing.first] += by.smoothing;
}

void BodyContactTerm::add_cancelling_normal_forces(VectorXd& out) const {
    for (const Touch& touch : touching_) {
        const PairVectors stiffness = touch.at.normal_force_by_place();
        for (int k = 0; k < nodes_of(touch.pair.kind); ++k)
            out.segment<3>(3 * touch.pair.nodes[k]).array() += stiffness[k].norm() * touch.far;
    }
}

double BodyContactTerm::largest_share(const double* q, const double* p) const {
    double share = 1.0;
    for (const NearPair& each : near_.along(q, p))
        share = share_of(each.pair, places(each.pair, q), places(each.pair, p), least(each.contact), share);
    return share;
}

std::string BodyContactTerm::blocking(const double* q, const double* p) const {
    double share = 1.0;
    const NearPair* worst = nullptr;
    const std::vector<NearPair> all = near_.along(q, p);
    for (const NearPair& each : all) {
        const double own =
            share_of(each.pair, places(each.pair, q), places(each.pair, p), least(each.contact), share);
        if (own < share) worst = &each;
        share = own;
    }
    return worst ? near_.names(*worst) + " are in each other's way" : "";
}

std::string BodyContactTerm::refusal(const double* q) const {
    for (const NearPair& each : near_.at(q)) {
        const double distance = pair_distance(each.pair.kind, places(each.pair, q)),
                     least = this->least(each.contact);
        if (distance > least) continue;
        std::ostringstream text;
        text << near_.names(each) << " are " << distance << " m from each other, where " << least
             << " m is the least";
        return text.str();
    }
    return {};
}

std::size_t BodyContactTerm::bytes() const {
    return near_.bytes() + layer_.bytes() + touching_.capacity() * sizeof(Touch);
}

}  // namespace magshell
