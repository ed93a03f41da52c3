#include "magshell/terms/actuator/tendon_term.h"

#include <algorithm>
#include <cmath>

#include "magshell/assembly/lanes.h"
#include "magshell/energy/contact.h"

namespace magshell {
namespace {

// Length below which a segment's length is smoothed, as a fraction of its reference length. [-] The direction
// of a segment of length zero would be undefined.
constexpr double softened = 1e-7;

double softened_length(const Vec3& span, double softening) {
    return std::sqrt(span.squaredNorm() + softening * softening);
}

}  // namespace

TendonTerm::Pull::Pull(const std::array<double, n_numbers>& numbers, double share, double length) {
    const auto [pull, stiffness_of_all, rest, smoothing] = numbers;
    energy = pull * length;
    tension = pull;
    tension_by[0] = 1.0;
    const double beyond = length - share * rest;
    if (!(beyond > 0.0) || stiffness_of_all == 0.0) return;
    const Penalty penalty(beyond, share * smoothing);
    const double of_string = stiffness_of_all / share;
    energy += of_string * penalty.energy;
    tension += of_string * penalty.force;
    stiffness = of_string * penalty.stiffness;
    tension_by[1] = penalty.force / share;
    tension_by[2] = -of_string * penalty.stiffness * share;
    tension_by[3] = of_string * penalty.force_by_smoothing * share;
}

// The share enters as k/s, s r and s times the smoothing.
double TendonTerm::Pull::tension_by_fraction(const std::array<double, n_numbers>& numbers,
                                             double share) const {
    return (-numbers[1] * tension_by[1] + numbers[2] * tension_by[2] + numbers[3] * tension_by[3]) / share;
}

TendonTerm::TendonTerm(const std::vector<TendonInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
                       Registry& registry)
    : factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)) {
    for (const TendonInput& input : inputs) {
        const Index tendon = static_cast<Index>(tendons_.size());
        Tendon& added = tendons_.emplace_back();
        const std::array<std::array<const char*, 2>, n_numbers> names = {
            {{"tension", "N"}, {"stiffness", "N/m"}, {"rest_length", "m"}, {"smoothing", "m"}}};
        for (int k = 0; k < n_numbers; ++k)
            added.slots[k] = registry.values.add(input.owner, names[k][0], names[k][1], 1, 1);
        if (input.slides)
            add_string(tendon, 1.0, input.points.data(), input.points.size(), nodes, matrix);
        else
            for (std::size_t k = 0; k + 1 < input.points.size(); ++k)
                add_string(tendon, input.shares[k], &input.points[k], 2, nodes, matrix);
    }
}

void TendonTerm::add_string(Index tendon, double share, const EmbeddedPoint* first, std::size_t points,
                            const Nodes& nodes, const SystemMatrix& matrix) {
    String& added = strings_.emplace_back();
    added.tendon = tendon;
    added.share = share;
    for (std::size_t p = 0; p < points; ++p)
        for (const Index user : first[p].vertices) added.nodes.push_back(nodes.vertices.core[user]);
    std::sort(added.nodes.begin(), added.nodes.end());
    added.nodes.erase(std::unique(added.nodes.begin(), added.nodes.end()), added.nodes.end());
    for (std::size_t p = 0; p + 1 < points; ++p) {
        std::vector<double> of_nodes(added.nodes.size(), 0.0);
        std::vector<char> taken(added.nodes.size(), 0);
        for (std::size_t end = 0; end < 2; ++end)
            for (std::size_t k = 0; k < first[p + end].vertices.size(); ++k) {
                const std::size_t place = std::lower_bound(added.nodes.begin(), added.nodes.end(),
                                                           nodes.vertices.core[first[p + end].vertices[k]]) -
                                          added.nodes.begin();
                of_nodes[place] += (end == 0 ? -1.0 : 1.0) * first[p + end].weights[k];
                taken[place] = 1;
            }
        Segment& segment = added.segments.emplace_back();
        Vec3 span = Vec3::Zero();
        for (std::size_t place = 0; place < taken.size(); ++place) {
            if (!taken[place]) continue;
            segment.places.push_back(static_cast<Index>(place));
            segment.weights.push_back(of_nodes[place]);
            span += of_nodes[place] * nodes.rest[added.nodes[place]];
        }
        for (std::size_t i = 1; i < segment.places.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                segment.pairs.push_back(
                    matrix.node_slot(added.nodes[segment.places[i]], added.nodes[segment.places[j]]));
        segment.softening = softened * span.norm();
        segment.at_rest = span;
    }
}

Vec3 TendonTerm::String::span(const Segment& segment, const double* q) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < segment.places.size(); ++k)
        sum += segment.weights[k] * Eigen::Map<const Vec3>(q + 3 * nodes[segment.places[k]]);
    return sum;
}

double TendonTerm::String::length_at(const double* q) const {
    double sum = 0.0;
    for (const Segment& segment : segments) sum += softened_length(span(segment, q), segment.softening);
    return sum;
}

double TendonTerm::String::along(const double* p) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        sum += slopes[k].dot(Eigen::Map<const Vec3>(p + 3 * nodes[k]));
    return sum;
}

bool TendonTerm::set_values(const Values& values) {
    for (Tendon& each : tendons_)
        for (int k = 0; k < n_numbers; ++k) each.numbers[k] = values.number(each.slots[k]);
    return false;
}

double TendonTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    double sum = 0.0;
    for (const String& each : strings_)
        sum += Pull(tendons_[each.tendon].numbers, each.share, each.length_at(q)).energy;
    return load_parameters[factor_.first] * sum;
}

void TendonTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const double factor = factor_now_ = load_parameters[factor_.first];
    for (String& each : strings_) {
        each.length = 0.0;
        each.slopes.assign(each.nodes.size(), Vec3::Zero());
        for (const Segment& segment : each.segments) {
            const Vec3 span = each.span(segment, q);
            const double length = softened_length(span, segment.softening);
            each.length += length;
            for (std::size_t k = 0; k < segment.places.size(); ++k)
                each.slopes[segment.places[k]] += (segment.weights[k] / length) * span;
        }
        const Pull pull(tendons_[each.tendon].numbers, each.share, each.length);
        each.tension = each.extrapolated = pull.tension;
        each.stiffness = pull.stiffness;
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * each.nodes[k] + axis,
                        (factor * pull.tension + each.frozen_rate) * each.slopes[k][axis]);
    }
}

void TendonTerm::extrapolate(const double* p) {
    for (String& each : strings_)
        each.extrapolated = std::max(0.0, each.tension + each.stiffness * each.along(p));
}

void TendonTerm::freeze_stress_rates(const double* p) {
    for (String& each : strings_) each.frozen_rate = p ? factor_now_ * each.stiffness * each.along(p) : 0.0;
}

bool TendonTerm::has_stress_work_vjp() const {
    return std::all_of(tendons_.begin(), tendons_.end(),
                       [](const Tendon& each) { return each.numbers[1] == 0.0; });
}

void TendonTerm::finish_assembly(const double* q, const LoadParameters& load_parameters,
                                 SystemMatrix& out) const {
    const double factor = load_parameters[factor_.first];
    for (const String& each : strings_) {
        const double tension = factor * (extrapolated_ ? each.extrapolated : each.tension) + each.frozen_rate;
        if (tension == 0.0) continue;
        for (const Segment& segment : each.segments) {
            const Vec3 span = each.span(segment, q);
            const double length = softened_length(span, segment.softening);
            const Vec3 along = span / length;
            const Mat3 stiffness = (tension / length) * (Mat3::Identity() - along * along.transpose());
            for (std::size_t i = 0; i < segment.places.size(); ++i) {
                const Index row = each.nodes[segment.places[i]];
                out.add_diagonal_block(row, Mat3(segment.weights[i] * segment.weights[i] * stiffness));
                for (std::size_t j = 0; j < i; ++j) {
                    const SystemMatrix::Slot slot =
                        segment.pairs[lower_index(static_cast<int>(i) - 1, static_cast<int>(j))];
                    const Index column = each.nodes[segment.places[j]];
                    out.add_block(slot, out.column_length(slot & 1 ? row : column),
                                  Mat3(segment.weights[i] * segment.weights[j] * stiffness));
                }
            }
        }
    }
}

void TendonTerm::add_low_rank(const LoadParameters& load_parameters, LowRank& out) const {
    for (const String& each : strings_)
        out.add(each.nodes, each.slopes, load_parameters[factor_.first] * each.stiffness);
}

void TendonTerm::add_cancelling_here(VectorXd& out) const {
    for (const String& each : strings_)
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            out.segment<3>(3 * each.nodes[k]) +=
                std::abs(factor_now_) * each.stiffness * each.length * each.slopes[k].cwiseAbs();
}

void TendonTerm::vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                     Gradient& out) {
    const double factor = load_parameters[factor_.first];
    for (const String& each : strings_) {
        const double along = each.along(lambda);
        const Tendon& tendon = tendons_[each.tendon];
        const Pull pull(tendon.numbers, each.share, each.length);
        for (int k = 0; k < n_numbers; ++k)
            out.values[tendon.slots[k].at(0)] += factor * pull.tension_by[k] * along;
        out.load_parameters[factor_.first] += pull.tension * along;
    }
}

// The shares are l_i / sum l of the lengths l_i of the segments at rest. Points keep their places in the matter, so their weights stay; the
// caller adds what follows from the slack length and the smoothing.
void TendonTerm::add_rest_vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                              VectorXd& out) {
    const double factor = load_parameters[factor_.first];
    std::vector<double> lengths(tendons_.size(), 0.0), means(tendons_.size(), 0.0), by_shares;
    for (const String& each : strings_) {
        const Tendon& tendon = tendons_[each.tendon];
        const Pull pull(tendon.numbers, each.share, each.length);
        by_shares.push_back(factor * pull.tension_by_fraction(tendon.numbers, each.share) *
                            each.along(lambda));
        means[each.tendon] += each.share * by_shares.back();
        for (const Segment& segment : each.segments) lengths[each.tendon] += segment.at_rest.norm();
    }
    for (std::size_t s = 0; s < strings_.size(); ++s) {
        const String& each = strings_[s];
        const double by_length = (by_shares[s] - means[each.tendon]) / lengths[each.tendon];
        for (const Segment& segment : each.segments)
            for (std::size_t k = 0; k < segment.places.size(); ++k)
                out.segment<3>(3 * each.nodes[segment.places[k]]) +=
                    by_length * segment.weights[k] * segment.at_rest.normalized();
    }
}

std::size_t TendonTerm::bytes() const {
    std::size_t total = bytes_of(tendons_) + bytes_of(strings_);
    for (const String& each : strings_) {
        total += bytes_of(each.nodes) + bytes_of(each.slopes) + bytes_of(each.segments);
        for (const Segment& segment : each.segments)
            total += bytes_of(segment.places) + bytes_of(segment.weights) + bytes_of(segment.pairs);
    }
    return total;
}

}  // namespace magshell
