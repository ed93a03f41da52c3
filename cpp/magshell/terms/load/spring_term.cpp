#include "magshell/terms/load/spring_term.h"

#include <algorithm>
#include <cmath>

#include "magshell/assembly/lanes.h"
#include "magshell/assembly/node_matrix.h"

namespace magshell {
namespace {

// Length below which the length of a spring is smoothed, as a fraction of its distance at rest. [-] The direction of a spring of
// length zero would be undefined; see test_spring_of_no_rest_length_pulls_its_ends_together.
constexpr double softened_part = 1e-7;

}  // namespace

SpringTerm::SpringTerm(const std::vector<SpringsInput>& inputs, const Nodes& nodes,
                       const SystemMatrix& matrix, Registry& registry) {
    for (const SpringsInput& input : inputs) {
        const auto add = [&](const char* name, const std::string& unit, Index rows, Index width) {
            return rows > 0 ? registry.values.add(input.owner, name, unit, rows, width) : ParameterSlice{};
        };
        const ParameterSlice stiffness = add("stiffness", input.stiffness_unit, input.stiffness_rows, 1),
                             rest_length = add("rest_length", "m", input.rest_length_rows, 1),
                             damping = add("damping", input.damping_unit, input.damping_rows, 1),
                             ground = add("ground", "m", input.ground_rows, 3);
        const Index places = input.has_places ? static_cast<Index>(input.springs.size()) : 0;
        const ParameterSlice share_of_each = add("shares", "m2", places, 1),
                             direction_of_each = add("directions", "1", places, 3),
                             ground_of_each = add("grounds", "m", places, 3);
        Index place_of = 0;
        for (const SpringsInput::Spring& given : input.springs) {
            const auto row = [&](const ParameterSlice& slice) {
                return Parameter{slice, slice.rows > 1 ? given.number : slice.rows - 1};
            };
            Spring& spring = springs_.emplace_back();
            for (const Index vertex : given.vertices) spring.nodes.push_back(nodes.vertices.core[vertex]);
            std::sort(spring.nodes.begin(), spring.nodes.end());
            spring.nodes.erase(std::unique(spring.nodes.begin(), spring.nodes.end()), spring.nodes.end());
            spring.weights.assign(spring.nodes.size(), 0.0);
            for (std::size_t j = 0; j < given.vertices.size(); ++j) {
                const Index node = nodes.vertices.core[given.vertices[j]];
                const auto place = std::lower_bound(spring.nodes.begin(), spring.nodes.end(), node);
                spring.weights[place - spring.nodes.begin()] += given.weights[j];
            }
            for (std::size_t i = 1; i < spring.nodes.size(); ++i)
                for (std::size_t j = 0; j < i; ++j)
                    spring.pairs.push_back(matrix.node_slot(spring.nodes[i], spring.nodes[j]));
            spring.direction = given.direction;
            spring.has_direction = given.direction != Vec3::Zero();
            spring.share = given.share;
            spring.ground = given.ground;
            spring.stiffness_of = row(stiffness);
            spring.rest_length_of = row(rest_length);
            spring.damping_of = row(damping);
            spring.ground_of = row(ground);
            if (input.has_places) {
                spring.share_of = {share_of_each, place_of};
                spring.direction_of = {direction_of_each, place_of};
                spring.ground_of = {ground_of_each, place_of++};
            }
            Vec3 at_rest = -given.ground;
            spring.reach = given.ground.lpNorm<Eigen::Infinity>();
            for (std::size_t j = 0; j < spring.nodes.size(); ++j) {
                const Vec3& place = nodes.rest[spring.nodes[j]];
                at_rest += spring.weights[j] * place;
                spring.reach = std::max(spring.reach, place.lpNorm<Eigen::Infinity>());
            }
            spring.softening = softened_part * at_rest.norm();
            has_lengths_ |= !spring.has_direction;
            is_damped_ |= input.damping_rows > 0;
        }
    }
    now_.resize(springs_.size());
}

bool SpringTerm::set_values(const Values& values) {
    bool changed = false;
    for (Spring& spring : springs_) {
        const auto number = [&](const Parameter& of) {
            if (!of.exists()) return 0.0;
            changed |= values.changed(of.slice);
            return values.number(of.slice, of.row);
        };
        if (spring.share_of.exists()) {
            spring.share = number(spring.share_of);
            changed |= values.changed(spring.direction_of.slice);
            spring.direction = values.vector(spring.direction_of.slice, spring.direction_of.row);
        }
        spring.stiffness = spring.share * number(spring.stiffness_of);
        spring.damping = spring.share * number(spring.damping_of);
        spring.rest_length = number(spring.rest_length_of);
        if (!spring.ground_of.exists()) continue;
        changed |= values.changed(spring.ground_of.slice);
        spring.ground = values.vector(spring.ground_of.slice, spring.ground_of.row);
    }
    return changed;
}

Vec3 SpringTerm::Spring::weighted(const double* rows) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t j = 0; j < nodes.size(); ++j)
        sum += weights[j] * Eigen::Map<const Vec3>(rows + 3 * nodes[j]);
    return sum;
}

SpringTerm::Local SpringTerm::local(const Spring& spring, const Vec3& along) {
    if (spring.has_direction) return {along, spring.direction.dot(along), spring.direction, Mat3::Zero()};
    const double length = std::sqrt(along.squaredNorm() + spring.softening * spring.softening);
    const Vec3 slope = along / length;
    return {along, length, slope, (Mat3::Identity() - slope * slope.transpose()) / length};
}

double SpringTerm::force(std::size_t k) const {
    const Spring& spring = springs_[k];
    return spring.stiffness * stretch(k) + spring.damping * viscous_strain(k);
}

// The part along the spring is never negative. The part across it is the force times the curvature of the length, which is positive
// semidefinite, so that it is projected by leaving out pushing forces.
Mat3 SpringTerm::hessian(std::size_t k, bool project_psd) const {
    const Local& now = now_[k];
    const double pull = project_psd ? std::max(force(k), 0.0) : force(k);
    return stiffness(k) * now.slope * now.slope.transpose() + pull * now.curvature;
}

void SpringTerm::scatter(const Spring& spring, const Vec3& force, Residual& out) {
    for (std::size_t j = 0; j < spring.nodes.size(); ++j)
        for (int c = 0; c < 3; ++c) out.add(3 * spring.nodes[j] + c, spring.weights[j] * force[c]);
}

void SpringTerm::add_to(const Spring& spring, const Vec3& vector, VectorXd& out) {
    for (std::size_t j = 0; j < spring.nodes.size(); ++j)
        out.segment<3>(3 * spring.nodes[j]) += spring.weights[j] * vector;
}

double SpringTerm::energy(const double* q, const LoadParameters&) const {
    double sum = 0.0;
    for (const Spring& spring : springs_) {
        const double stretch = local(spring, spring.along(q)).value - spring.rest_length;
        sum += 0.5 * spring.stiffness * stretch * stretch;
    }
    return sum;
}

void SpringTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    for (std::size_t k = 0; k < springs_.size(); ++k) {
        now_[k] = local(springs_[k], springs_[k].along(q));
        scatter(springs_[k], force(k) * now_[k].slope, out);
    }
}

void SpringTerm::finish_assembly(const double*, const LoadParameters&, SystemMatrix& out) const {
    for (std::size_t k = 0; k < springs_.size(); ++k) {
        const Spring& spring = springs_[k];
        const Mat3 block = hessian(k, psd_projection_);
        for (std::size_t i = 0; i < spring.nodes.size(); ++i) {
            const Index row = spring.nodes[i];
            out.add_diagonal_block(row, Mat3(spring.weights[i] * spring.weights[i] * block));
            for (std::size_t j = 0; j < i; ++j) {
                const Index column = spring.nodes[j];
                const SystemMatrix::Slot slot =
                    spring.pairs[lower_index(static_cast<int>(i) - 1, static_cast<int>(j))];
                out.add_block(slot, out.column_length(slot & 1 ? row : column),
                              Mat3(spring.weights[i] * spring.weights[j] * block));
            }
        }
    }
}

// A spring along a direction counts along all three axes, as the matrix is the same for each.
bool SpringTerm::add_projective_stiffness(NodeMatrix& out) const {
    for (const Spring& spring : springs_) {
        NodeRows row(1);
        for (std::size_t j = 0; j < spring.nodes.size(); ++j) row.add(0, spring.nodes[j], spring.weights[j]);
        row.add_to(out, [&](int, int) { return spring.stiffness; });
    }
    return true;
}

void SpringTerm::add_cancelling(const Spring& spring, double stiffness, double beyond, VectorXd& out) {
    for (std::size_t j = 0; j < spring.nodes.size(); ++j)
        out.segment<3>(3 * spring.nodes[j]).array() +=
            stiffness * std::abs(spring.weights[j]) * (spring.reach + beyond);
}

void SpringTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (const Spring& spring : springs_) add_cancelling(spring, spring.stiffness, beyond, out);
}

void SpringTerm::add_cancelling_stage_forces(double beyond, VectorXd& out) const {
    for (const Spring& spring : springs_)
        add_cancelling(spring, viscous_scale() * spring.damping, beyond, out);
}

void SpringTerm::vjp(const double*, const LoadParameters&, const double* lambda, Gradient& out) {
    for (std::size_t k = 0; k < springs_.size(); ++k) {
        const Spring& spring = springs_[k];
        const Vec3 moved = spring.weighted(lambda);
        const double rate = now_[k].slope.dot(moved);
        out.values[spring.stiffness_of.at()] += spring.share * stretch(k) * rate;
        if (spring.rest_length_of.exists() && !frozen_)
            out.values[spring.rest_length_of.at()] -= spring.stiffness * rate;
        if (spring.damping_of.exists())
            out.values[spring.damping_of.at()] += spring.share * viscous_strain(k) * rate;
        if (spring.ground_of.exists())
            out.values.segment<3>(spring.ground_of.at()) -= hessian(k, false) * moved;
        if (!spring.share_of.exists()) continue;
        out.values[spring.share_of.at()] += force(k) * rate / spring.share;
        out.values.segment<3>(spring.direction_of.at()) +=
            stiffness(k) * rate * now_[k].along + force(k) * moved;
    }
}

// A rest length that changes is not part of s.
void SpringTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    for (Index k = 0; k < elements(); ++k) {
        const Spring& spring = springs_[k];
        const double stress = stresses.number(k, 0);
        if (spring.ground_of.exists()) out.values.segment<3>(spring.ground_of.at()) -= stress * now_[k].slope;
        if (spring.direction_of.exists())
            out.values.segment<3>(spring.direction_of.at()) += stress * now_[k].along;
    }
}

Strains SpringTerm::strains(const double* q) {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k) out.set(k, 0, local(springs_[k], springs_[k].along(q)).value);
    return out;
}

Strains SpringTerm::strain_rates(const double* p) {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k) out.set(k, 0, now_[k].slope.dot(springs_[k].weighted(p)));
    return out;
}

Strains SpringTerm::stresses(const Strains& strains) const {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k) out.set(k, 0, springs_[k].damping * strains.number(k, 0));
    return out;
}

void SpringTerm::add_forces(const Strains& stresses, Residual& out) {
    for (Index k = 0; k < elements(); ++k) scatter(springs_[k], stresses.number(k, 0) * now_[k].slope, out);
}

// W = k (s - r) c; the stiffness, and the share of a place in it, are counted at fixed strain rates.
void SpringTerm::add_stress_work_vjp(const double*, const Strains& curvatures, Residual& by_q, Gradient& out,
                                     VectorXd*) {
    Strains weights(elements(), 1);
    for (Index k = 0; k < elements(); ++k) weights.set(k, 0, springs_[k].stiffness * curvatures.number(k, 0));
    add_forces(weights, by_q);
    strains_vjp(weights, out);
}

Strains SpringTerm::rates(const double* q, const double* v) const {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k) {
        const Spring& spring = springs_[k];
        out.set(k, 0, local(spring, spring.along(q)).slope.dot(spring.weighted(v)));
    }
    return out;
}

void SpringTerm::rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q,
                           VectorXd& by_v, Gradient& out) const {
    for (Index k = 0; k < elements(); ++k) {
        const Spring& spring = springs_[k];
        const Local at = local(spring, spring.along(q));
        const double by = by_rates.number(k, 0);
        add_to(spring, by * at.slope, by_v);
        add_to(spring, by * at.curvature * spring.weighted(v), by_q);
        if (spring.direction_of.exists())
            out.values.segment<3>(spring.direction_of.at()) += by * spring.weighted(v);
    }
}

std::size_t SpringTerm::bytes() const {
    std::size_t total = bytes_of(springs_) + bytes_of(now_);
    for (const Spring& spring : springs_)
        total += bytes_of(spring.nodes) + bytes_of(spring.weights) + bytes_of(spring.pairs);
    return total;
}

}  // namespace magshell
