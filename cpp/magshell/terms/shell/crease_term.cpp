#include "magshell/terms/shell/crease_term.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "magshell/strain/dihedral_angle.h"

namespace magshell {
namespace {

// Returns the fold of an edge at q. All lanes of the SIMD vectors hold the same edge, and only lane 0 of results is read: there are
// too few creases to compute several at once.
DihedralAngle fold_at(const std::array<Index, 4>& nodes, const double* q) {
    SimdVec3 x[4];
    for (int k = 0; k < 4; ++k)
        for (int lane = 0; lane < SimdDouble::width; ++lane) set_lane(x[k], lane, q + 3 * nodes[k]);
    return DihedralAngle(x[0], x[1], x[2], x[3], SimdDouble(1.0));
}

VectorXd rest_state(const Nodes& nodes) {
    VectorXd rest(3 * nodes.n_nodes());
    for (Index node = 0; node < nodes.n_nodes(); ++node) rest.segment<3>(3 * node) = nodes.rest[node];
    return rest;
}

}  // namespace

CreaseTerm::CreaseTerm(const std::vector<CreaseInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
                       Registry& registry)
    : nodes_(nodes) {
    const VectorXd rest = rest_state(nodes);
    for (const CreaseInput& input : inputs) {
        const ParameterSlice stiffness =
            registry.values.add(input.owner, "stiffness", "N", input.stiffness_rows, 1);
        const ParameterSlice angle =
            input.angle_rows > 0 ? registry.values.add(input.owner, "angle", "rad", input.angle_rows, 1)
                                 : ParameterSlice{};
        Index row = 0;
        for (const std::array<Index, 4>& vertices : input.edges) {
            Edge& edge = edges_.emplace_back();
            for (int k = 0; k < 4; ++k) edge.nodes[k] = nodes.vertices.core[vertices[k]];
            edge.slots = pair_slots<4>(matrix, edge.nodes);
            const DihedralAngle fold = fold_at(edge.nodes, rest.data());
            edge.length = fold.left.edge_length[0];
            edge.height = std::min(fold.left.height[0], fold.right.height[0]);
            edge.reach = 0.0;
            for (const Index node : edge.nodes)
                edge.reach = std::max(edge.reach, nodes.rest[node].lpNorm<Eigen::Infinity>());
            edge.stiffness_of = stiffness;
            edge.angle_of = angle;
            edge.row = row++;
            edge.rest_angle = fold.angle()[0];
            unwrapped_angles_.push_back(edge.rest_angle);
        }
    }
}

bool CreaseTerm::set_values(const Values& values) {
    bool changed = false;
    for (Edge& edge : edges_) {
        changed |= values.changed(edge.stiffness_of);
        edge.stiffness = edge.length * values.number(edge.stiffness_of, edge.row_of(edge.stiffness_of));
        if (edge.angle_of.rows == 0) continue;
        changed |= values.changed(edge.angle_of);
        edge.rest_angle = values.number(edge.angle_of, edge.row_of(edge.angle_of));
    }
    return changed;
}

double CreaseTerm::unwrapped_angle(const double* q, std::size_t k) const {
    const double before = unwrapped_angles_[k];
    return before + std::remainder(fold_at(edges_[k].nodes, q).angle()[0] - before, 2.0 * std::numbers::pi);
}

std::vector<CreaseTerm::Moment> CreaseTerm::moments(const double* q) const {
    std::vector<Moment> found;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const Edge& edge = edges_[k];
        found.push_back(
            {edge.nodes[0], edge.nodes[1], edge.stiffness * (unwrapped_angle(q, k) - edge.rest_angle)});
    }
    return found;
}

double CreaseTerm::energy(const double* q, const LoadParameters&) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const double turned = unwrapped_angle(q, k) - edges_[k].rest_angle;
        sum += 0.5 * edges_[k].stiffness * turned * turned;
    }
    return sum;
}

void CreaseTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    state_.assign(q, q + 3 * nodes_.n_nodes());
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const Edge& edge = edges_[k];
        unwrapped_angles_[k] = unwrapped_angle(q, k);
        const SimdDouble moment(edge.stiffness * turned(k));
        SimdVec3 g[4];
        fold_at(edge.nodes, q).gradient(g);
        for (int node = 0; node < 4; ++node) scatter_node(out, edge.nodes[node], moment * g[node], 0);
    }
}

// The positive semidefinite part leaves out the curvature of the angle (Gauss-Newton).
void CreaseTerm::finish_assembly(const double* q, const LoadParameters&, SystemMatrix& out) const {
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const Edge& edge = edges_[k];
        const DihedralAngle fold = fold_at(edge.nodes, q);
        const double moment = edge.stiffness * turned(k);
        const DihedralHessian curvature(fold, SimdDouble(psd_projection_ ? 0.0 : moment));
        SimdVec3 g[4];
        fold.gradient(g);
        SimdMat3 h[DihedralHessian::count];
        const SimdDouble stiffness(frozen_ ? 0.0 : edge.stiffness);
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column <= row; ++column) {
                SimdMat3& block = h[lower_index(row, column)];
                const SimdMat3 product = outer(g[row], g[column]);
                for (int entry = 0; entry < 9; ++entry)
                    block.at[entry] =
                        curvature.block[lower_index(row, column)].at[entry] + stiffness * product.at[entry];
            }
        scatter_blocks<4>(out, edge.nodes, edge.slots, h, 0);
    }
}

// Rounding of the positions changes the angle by their round-off over the height, and the moment acts over the height.
void CreaseTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (const Edge& edge : edges_)
        for (const Index node : edge.nodes)
            out.segment<3>(3 * node).array() +=
                edge.stiffness * (edge.reach + beyond) / (edge.height * edge.height);
}

double CreaseTerm::rate(const Edge& edge, const double* q, const double* lambda) {
    SimdVec3 g[4];
    fold_at(edge.nodes, q).gradient(g);
    double rate = 0.0;
    for (int node = 0; node < 4; ++node)
        rate += lane_of(g[node], 0).dot(Eigen::Map<const Vec3>(lambda + 3 * edge.nodes[node]));
    return rate;
}

void CreaseTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const Edge& edge = edges_[k];
        const double rate = this->rate(edge, q, lambda);
        out.values[edge.stiffness_of.at(edge.row_of(edge.stiffness_of))] += edge.length * turned(k) * rate;
        if (edge.angle_of.rows > 0 && !frozen_)
            out.values[edge.angle_of.at(edge.row_of(edge.angle_of))] -= edge.stiffness * rate;
    }
}

void CreaseTerm::freeze_stress_rates(const double* p) {
    frozen_ = p ? strain_rates(p) : Strains(static_cast<Index>(edges_.size()), 1);
}

Strains CreaseTerm::strain_rates(const double* p) {
    Strains rates(static_cast<Index>(edges_.size()), 1);
    for (std::size_t k = 0; k < edges_.size(); ++k)
        rates.set(static_cast<Index>(k), 0, rate(edges_[k], state_.data(), p));
    return rates;
}

// W = k L (theta - theta_r) c. Its rate along a motion of q depends on the stiffness, which is counted at fixed strain rates.
void CreaseTerm::add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q, Gradient&,
                                     VectorXd*) {
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const SimdDouble moment(edges_[k].stiffness * curvatures.number(static_cast<Index>(k), 0));
        SimdVec3 g[4];
        fold_at(edges_[k].nodes, q).gradient(g);
        for (int node = 0; node < 4; ++node) scatter_node(by_q, edges_[k].nodes[node], moment * g[node], 0);
    }
}

// The power k L (theta - theta_r) theta' follows the rest shape through L, and through theta_r if that is the angle at rest.
void CreaseTerm::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) {
    const VectorXd rest = rest_state(nodes_);
    for (std::size_t k = 0; k < edges_.size(); ++k) {
        const Edge& edge = edges_[k];
        const double rate = this->rate(edge, q, lambda);
        const Vec3 along = (nodes_.rest[edge.nodes[1]] - nodes_.rest[edge.nodes[0]]) / edge.length;
        const double by_length = edge.stiffness / edge.length * turned(k) * rate;
        out.segment<3>(3 * edge.nodes[1]) += by_length * along;
        out.segment<3>(3 * edge.nodes[0]) -= by_length * along;
        if (edge.angle_of.rows > 0 || frozen_) continue;
        SimdVec3 g[4];
        fold_at(edge.nodes, rest.data()).gradient(g);
        for (int node = 0; node < 4; ++node)
            out.segment<3>(3 * edge.nodes[node]) -= edge.stiffness * rate * lane_of(g[node], 0);
    }
}

}  // namespace magshell
