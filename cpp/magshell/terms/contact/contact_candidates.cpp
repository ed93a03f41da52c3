#include "magshell/terms/contact/contact_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace magshell {
namespace {

// [-] both in mean reference edge lengths
constexpr double margin_of_edges = 0.3, displacement_of_edges = 20.0;

std::vector<ContactSurface> surfaces_of(const Nodes& nodes, const std::vector<ContactSurfaceInput>& given) {
    std::vector<ContactSurface> surfaces;
    for (const ContactSurfaceInput& each : given) {
        std::vector<ContactSurface::Face> faces = each.faces;
        for (ContactSurface::Face& face : faces)
            for (Index& node : face) node = nodes.vertices.core[node];
        surfaces.emplace_back(std::move(faces), nodes.rest);
    }
    return surfaces;
}

std::vector<SurfacePair> pairs_of(const std::vector<BodyContactInput>& contacts) {
    std::vector<SurfacePair> pairs;
    for (const BodyContactInput& each : contacts) pairs.push_back({each.a, each.b});
    return pairs;
}

}  // namespace

ContactCandidates::ContactCandidates(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                                     const std::vector<BodyContactInput>& contacts)
    : nodes_(nodes), contacts_(contacts), phase_(surfaces_of(nodes, surfaces), pairs_of(contacts)) {
    for (const ContactSurfaceInput& each : surfaces) names_.push_back({each.name, each.numbers});
    double sum = 0.0;
    std::size_t count = 0;
    for (const ContactSurface& surface : phase_.surfaces()) {
        for (const double length : surface.edge_lengths) sum += length;
        count += surface.edge_lengths.size();
        contact_nodes_.insert(contact_nodes_.end(), surface.vertices.begin(), surface.vertices.end());
    }
    margin_ = margin_of_edges * sum / static_cast<double>(count);
    max_displacement_ = displacement_of_edges * sum / static_cast<double>(count);
    std::sort(contact_nodes_.begin(), contact_nodes_.end());
    contact_nodes_.erase(std::unique(contact_nodes_.begin(), contact_nodes_.end()), contact_nodes_.end());
}

void ContactCandidates::set_distances(const std::vector<double>& distances) {
    std::vector<double> at_rest = distances, with_margin = distances;
    for (double& each : at_rest) each *= 2.0;
    for (double& each : with_margin) each += margin_;
    if (with_margin == distances_) return;
    phase_.make_room(nodes_.rest, at_rest);
    distances_ = std::move(with_margin);
    searched_at_.resize(0);
}

const std::vector<NearPair>& ContactCandidates::near(const double* q) {
    constexpr double with_round_off = 2.0 * (1.0 + 1e-9);
    const Index count = static_cast<Index>(contact_nodes_.size());
    if (searched_at_.size() > 0) {
        double moved = 0.0;
        for (Index k = 0; k < count; ++k)
            moved = std::max(
                moved, (Eigen::Map<const Vec3>(q + 3 * contact_nodes_[k]) - searched_at_.segment<3>(3 * k))
                           .squaredNorm());
        if (4.0 * moved <= margin_ * margin_) {
            possible_approach_ = with_round_off * std::sqrt(moved) + round_off_;
            return near_;
        }
    }
    searched_at_ = contact_positions(q);
    ++searches_;
    near_ = phase_.near(q, distances_);
    slack_.resize(near_.size());
    for (std::size_t k = 0; k < near_.size(); ++k)
        slack_[k] = pair_distance(near_[k].pair.kind, positions_of(near_[k].pair, q)) -
                    (distances_[near_[k].contact] - margin_);
    const double far = searched_at_.size() > 0 ? searched_at_.lpNorm<Eigen::Infinity>() : 0.0;
    possible_approach_ = round_off_ = 1e-12 * (far + margin_);
    return near_;
}

VectorXd ContactCandidates::contact_positions(const double* q) const {
    VectorXd all(3 * contact_nodes_.size());
    for (std::size_t k = 0; k < contact_nodes_.size(); ++k)
        all.segment<3>(3 * k) = Eigen::Map<const Vec3>(q + 3 * contact_nodes_[k]);
    return all;
}

double ContactCandidates::largest_displacement(const double* p) const {
    double longest = 0.0;
    for (const Index node : contact_nodes_) {
        const double squared = Eigen::Map<const Vec3>(p + 3 * node).squaredNorm();
        if (!std::isfinite(squared)) return std::numeric_limits<double>::infinity();
        longest = std::max(longest, squared);
    }
    return std::sqrt(longest);
}

std::vector<NearPair> ContactCandidates::near_along_path(const double* q, const double* p, double share,
                                                         const std::vector<double>& distances) {
    VectorXd end(3 * nodes_.n_nodes());
    for (Index k = 0; k < end.size(); ++k) end[k] = q[k] + share * p[k];
    return phase_.near_along_path(q, end.data(), distances);
}

std::string ContactCandidates::describe(const NearPair& pair) const {
    const BodyContactInput& of = contacts_[pair.contact];
    const Name &one = names_[pair.swapped ? of.b : of.a], &other = names_[pair.swapped ? of.a : of.b];
    return "face " + std::to_string(one.faces[pair.first_face]) + " of " + one.body + " and face " +
           std::to_string(other.faces[pair.second_face]) + " of " + other.body;
}

std::size_t ContactCandidates::bytes() const {
    return phase_.bytes() + near_.capacity() * (sizeof(NearPair) + sizeof(double)) +
           searched_at_.size() * sizeof(double);
}

}  // namespace magshell
