#include "magshell/contact/pair_energy.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

/// A part of the Hessian,  u_u u u^T + u_v (u v^T + v u^T) + v_v v v^T  for orthogonal u and v.
struct RankTwo {
    double u_u = 0.0, u_v = 0.0, v_v = 0.0;
};

/// Returns the bracket of the Hessian (pair_energy.h) for one free direction, p (d u u^T + u v^T + v u^T) with p = push and the distance d, or
/// its positive semidefinite projection. The lengths of u and v follow from `slide`, w', and `weights`, w, as n and f are unit vectors.
RankTwo of_free(double push, double distance, const PairWeights& slide, const PairWeights& weights,
                bool project_psd) {
    if (!project_psd) return {push * distance, push, 0.0};
    double squared_u = 0.0, squared_v = 0.0;
    for (int i = 0; i < 4; ++i) {
        squared_u += slide[i] * slide[i];
        squared_v += weights[i] * weights[i];
    }
    // For unit u and v the matrix is (2 m, k; k, 0), whose nonnegative eigenvalue is m + sqrt(m^2 + k^2).
    const double m = 0.5 * push * distance * squared_u, squared_k = push * push * squared_u * squared_v;
    if (!(squared_k > 0.0)) return {};
    const double far = std::sqrt(m * m + squared_k), root = m > 0.0 ? m + far : squared_k / (far - m);
    const double scale = root / (root * root + squared_k);
    return {scale * root * root / squared_u, scale * root * push, scale * push * push * squared_u};
}

void add_outer(const PairVectors& one, const PairVectors& other, double scale, PairBlocks& blocks) {
    for (int i = 0, at = 0; i < 4; ++i)
        for (int j = 0; j <= i; ++j, ++at) blocks[at] += scale * one[i] * other[j].transpose();
}

}  // namespace

PairEnergy::PairEnergy(const ContactPair& pair, const PairPositions& x, const BarrierLaw& law)
    : pair_(pair),
      distance_scale_(pair.distance_scale(law)),
      law_(pair.scaled(law)),
      acts_(proximity_within(pair.kind, x, law_.activation_distance + law_.min_distance, near_)),
      edges_(x, acts_ && pair.kind == PairKind::edge_edge ? pair.parallel : 0.0),
      barrier_(acts_ ? near_.distance - law_.min_distance : law_.activation_distance, law_) {
    const double scale = pair.area * law.stiffness;
    energy_ = scale * barrier_.energy;
    slope_ = scale * barrier_.slope;
    curvature_ = scale * barrier_.curvature;
}

PairVectors PairEnergy::gradient() const {
    PairVectors by;
    for (int i = 0; i < 4; ++i) by[i] = edges_.factor * slope_ * near_.weights[i] * near_.normal;
    if (edges_.acts) {
        const Vec3 one = energy_ * edges_.slope * edges_.by_one, two = energy_ * edges_.slope * edges_.by_two;
        by[0] -= one;
        by[1] += one;
        by[2] -= two;
        by[3] += two;
    }
    return by;
}

PairVectors PairEnergy::normal_force_by_position() const {
    PairVectors by;
    for (int i = 0; i < 4; ++i) by[i] = -edges_.factor * curvature_ * near_.weights[i] * near_.normal;
    if (edges_.acts) {
        const Vec3 one = slope_ * edges_.slope * edges_.by_one, two = slope_ * edges_.slope * edges_.by_two;
        by[0] += one;
        by[1] -= one;
        by[2] += two;
        by[3] -= two;
    }
    return by;
}

void PairEnergy::hessian(bool project_psd, PairBlocks& blocks) const {
    const Vec3& n = near_.normal;
    const PairWeights& w = near_.weights;
    const double push = -edges_.factor * slope_, d = near_.distance;
    const double curvature = edges_.factor * (project_psd ? std::max(curvature_, 0.0) : curvature_);
    const int count = nodes_of(pair_.kind);
    RankTwo part[2];  // per tangential direction f_a, free or fixed
    Mat3 across = Mat3::Zero();
    for (int a = 0; a < 2; ++a) {
        if (a < near_.free)
            part[a] = of_free(push, d, near_.slide[a], w, project_psd);
        else if (d > 0.0)
            part[a].v_v = project_psd ? std::max(-push / d, 0.0) : -push / d;
        if (part[a].v_v != 0.0) across += part[a].v_v * near_.along[a] * near_.along[a].transpose();
    }
    Vec3 turning[4];  // sum_a u_v w_ai' f_a: block (i, j) of sum_a u_v u_a v_a^T is w_j n turning_i^T
    for (int i = 0; i < count; ++i)
        turning[i] = part[0].u_v * near_.slide[0][i] * near_.along[0] +
                     part[1].u_v * near_.slide[1][i] * near_.along[1];
    for (int i = 0, at = 0; i < count; ++i)
        for (int j = 0; j <= i; ++j, ++at) {
            const double along = curvature * w[i] * w[j] +
                                 part[0].u_u * near_.slide[0][i] * near_.slide[0][j] +
                                 part[1].u_u * near_.slide[1][i] * near_.slide[1][j];
            const Vec3 row = along * n + w[j] * turning[i], column = w[i] * turning[j];
            blocks[at].noalias() = n * row.transpose() + column * n.transpose() + w[i] * w[j] * across;
        }
    if (edges_.acts) add_parallel(project_psd, blocks);
}

// Adds, with g = dc/dx,  E_b' m' (v_n g^T + g v_n^T) + E_b (m'' g g^T + m' d2c/dx2).
void PairEnergy::add_parallel(bool project_psd, PairBlocks& blocks) const {
    const Vec3 zero = Vec3::Zero();
    PairVectors moved{zero, zero, zero, zero},
        turned{-edges_.by_one, edges_.by_one, -edges_.by_two, edges_.by_two};
    double squared_moved = 0.0, squared_turned = 0.0;
    for (int i = 0; i < 4; ++i) {
        moved[i] = near_.weights[i] * near_.normal;
        squared_moved += moved[i].squaredNorm();
        squared_turned += turned[i].squaredNorm();
    }
    const double mixed = slope_ * edges_.slope;
    if (!project_psd) {
        add_outer(moved, turned, mixed, blocks);
        add_outer(turned, moved, mixed, blocks);
        add_outer(turned, turned, energy_ * edges_.bend, blocks);
    } else if (squared_turned > 0.0 && squared_moved > 0.0) {
        // v g^T + g v^T equals |v| |g|/2 times the square of v/|v| + g/|g| minus that of v/|v| - g/|g|; the
        // latter is dropped.
        const double scale_moved = 1.0 / std::sqrt(squared_moved),
                     scale_turned = 1.0 / std::sqrt(squared_turned);
        for (int i = 0; i < 4; ++i)
            moved[i] = scale_moved * moved[i] + std::copysign(scale_turned, mixed) * turned[i];
        add_outer(moved, moved, 0.5 * std::abs(mixed) / (scale_moved * scale_turned), blocks);
        const double bend = std::max(energy_ * edges_.bend, 0.0);
        if (bend > 0.0) add_outer(turned, turned, bend, blocks);
    }
    const double scale = energy_ * edges_.slope;
    const ParallelEdges::Second second = edges_.second(project_psd);
    const Mat3 below = second.mixed.transpose();  // block (two, one)
    for (int i = 0, at = 0; i < 4; ++i)
        for (int j = 0; j <= i; ++j, ++at) {
            const double sign = (i - j) % 2 == 0 ? scale : -scale;
            blocks[at] += sign * (i < 2 ? second.one : j < 2 ? below : second.two);
        }
}

PairEnergy::Rates PairEnergy::rates(const PairVectors& lambda, double by_normal_force) const {
    Rates rates;
    for (int i = 0; i < nodes_of(pair_.kind); ++i)
        rates.distance += near_.weights[i] * near_.normal.dot(lambda[i]);
    rates.distance -= by_normal_force;  // N = - A k m b'
    if (edges_.acts)
        rates.parallel = edges_.by_one.dot(lambda[1] - lambda[0]) + edges_.by_two.dot(lambda[3] - lambda[2]);
    return rates;
}

PairEnergy::ByLaw PairEnergy::vjp_of_own_law(const Rates& rates) const {
    const double along = edges_.factor * rates.distance,
                 turning = edges_.acts ? edges_.slope * rates.parallel : 0.0;
    const double area = pair_.area, scale = area * law_.stiffness;
    return {area * (along * barrier_.slope + turning * barrier_.energy),
            scale * (along * barrier_.slope_by_activation_distance +
                     turning * barrier_.energy_by_activation_distance),
            -scale * (along * barrier_.curvature + turning * barrier_.slope),
            scale * (along * barrier_.slope_by_smoothing + turning * barrier_.energy_by_smoothing)};
}

PairEnergy::ByLaw PairEnergy::vjp(const PairVectors& lambda, double by_normal_force) const {
    ByLaw by = vjp_of_own_law(rates(lambda, by_normal_force));
    if (distance_scale_ < 1.0) {
        // The pair's own distances are those of the law times room / (activation distance + minimum
        // separation).
        const double both = law_.activation_distance + law_.min_distance;
        const double by_share = by.activation_distance * law_.activation_distance +
                                by.min_distance * law_.min_distance + by.smoothing * law_.smoothing;
        by.activation_distance = distance_scale_ * (by.activation_distance - by_share / both);
        by.min_distance = distance_scale_ * (by.min_distance - by_share / both);
        by.smoothing *= distance_scale_;
    }
    return by;
}

// The energy is proportional to the area. With y = c/e, m = (2 - y) y has dm/de = - 2 (1 - y) y/e, and m' = 2 (1 - y)/e has
// dm'/de = (4 y - 2)/e^2.
PairEnergy::ByPair PairEnergy::pair_vjp(const PairVectors& lambda, double by_normal_force) const {
    const Rates along = rates(lambda, by_normal_force);
    const ByLaw by = vjp_of_own_law(along);
    ByPair of;
    of.area = by.stiffness * law_.stiffness / pair_.area;
    if (edges_.acts) {
        const double e = pair_.parallel, y = edges_.area * edges_.area / e;
        of.parallel = slope_ * along.distance * (-2.0 * (1.0 - y) * y / e) +
                      energy_ * along.parallel * (4.0 * y - 2.0) / (e * e);
    }
    if (distance_scale_ < 1.0)
        of.room = (by.activation_distance * law_.activation_distance + by.min_distance * law_.min_distance +
                   by.smoothing * law_.smoothing) /
                  pair_.room;
    return of;
}

}  // namespace magshell
