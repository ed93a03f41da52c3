// The gradient of the elastic and viscous forces of a solid by its rest positions.
//
// A deformation I + H of the rest shape at a point, H = sum_k dX_k (x) g_k, changes
//
//   dF = - F H,   dL = - L H,   dV = V tr H          L the rate of F along lambda
//
// so that the power V P : L of the stresses has the derivative with respect to H
//
//   B = V ((P : L) I - F^T (dP/dF : L) - L^T P)      dW/dX_k = sum over points  B g_k
//
// With a mean volume, P is that at a fixed pressure U', and the change of v^ = sum_p V_p v_p / V is added:
//
//   B_p += U'' R V_p / V ((v_p - v^) I - F^T dv/dF),  R = sum_p V_p dv/dF : L
#pragma once

#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

/// Returns V dP/dF : L of a material from its tangent, whose blocks are taken for unit vectors as gradients.
template <class Tangent>
SimdMat3 tangent_along(const Tangent& tangent, const SimdMat3& l) {
    const auto column = [](const SimdMat3& a, int k) { return SimdVec3{a.at[k], a.at[3 + k], a.at[6 + k]}; };
    SimdVec3 sum[3] = {broadcast(Vec3::Zero()), broadcast(Vec3::Zero()), broadcast(Vec3::Zero())};
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i <= k; ++i) {
            const SimdMat3 block = tangent.block(k + 1, i + 1);
            sum[k] += multiply(block, column(l, i));
            if (i < k) sum[i] += multiply(transpose(block), column(l, k));
        }
    return {{sum[0].x, sum[1].x, sum[2].x, sum[0].y, sum[1].y, sum[2].y, sum[0].z, sum[1].z, sum[2].z}};
}

template <class Element, class Material, class Moduli>
template <class OfPoints>
void TetrahedraTerm<Element, Material, Moduli>::add_rest(VectorXd& out, const OfPoints& of_points) const {
    std::vector<std::array<Vec3, N>> by_nodes(this->elements());
    loop_.each_group([&](Index group) {
        SimdMat3 by_deformation[points];
        of_points(group, by_deformation);
        SimdVec3 g[N], sum[N];
        std::fill_n(sum, N, broadcast(Vec3::Zero()));
        for (int p = 0; p < points; ++p) {
            Element::gradients(rest_[group].gradients[p], p, g);
            for (int k = 0; k < N; ++k) sum[k] += multiply(by_deformation[p], g[k]);
        }
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            for (int k = 0; k < N; ++k) by_nodes[loop_.element(group, lane)][k] = lane_of(sum[k], lane);
    });
    for (Index t = 0; t < this->elements(); ++t)
        for (int k = 0; k < N; ++k) out.segment<3>(3 * this->element_nodes_[t][k]) += by_nodes[t][k];
}

/// Returns vectors for which the blocks of a tangent of four nodes are the derivatives dP/dF.
inline std::array<SimdVec3, 4> unit_gradients() {
    const SimdDouble zero(0.0), one(1.0);
    const SimdVec3 x{one, zero, zero}, y{zero, one, zero}, z{zero, zero, one};
    return {-(x + y + z), x, y, z};
}

template <class Element, class Material, class Moduli>
template <class Rates>
void TetrahedraTerm<Element, Material, Moduli>::add_work_rest_vjp(const double* q, const Rates& rates,
                                                                  VectorXd& out) const {
    const std::array<SimdVec3, 4> axes = unit_gradients();
    add_rest(out, [&](Index group, SimdMat3 by_deformation[points]) {
        const State state(*this, group, q);
        const SimdDouble* c = constants_[group].at;
        SimdMat3 all_along[points];
        rates(group, state, all_along);
        SimdDouble volume_rate(0.0);
        for (int p = 0; p < points; ++p) {
            const SimdDouble volume = rest_[group].volume[p];
            const SimdMat3 &f = state.f[p], &along = all_along[p];
            SimdDouble s[stresses_];
            state.at[p].stress(c, state.volumetric[p].pressure, s);
            const SimdMat3 piola = state.at[p].piola(c, s);
            const SimdDouble bulk = mean() ? SimdDouble(0.0) : state.volumetric[p].bulk;
            const typename Material::template Tangent<4> tangent(state.at[p], c, s, bulk, volume,
                                                                 axes.data());
            SimdMat3& by = by_deformation[p];
            by =
                -transposed_times(f, tangent_along(tangent, along)) - volume * transposed_times(along, piola);
            add_to_diagonal(by, volume * double_dot(piola, along));
            if (this->history_.shift) by += viscous_by_rest(group, p, f, along);
            volume_rate += volume * state.at[p].volume_rate(along);
        }
        if constexpr (may_average) {
            if (!mean()) return;
            const SimdDouble more = state.volumetric[0].bulk * volume_rate / rest_[group].total();
            for (int p = 0; p < points; ++p) {
                const SimdDouble share = more * rest_[group].volume[p];
                by_deformation[p] -= share * transposed_times(state.f[p], state.at[p].volume_piola());
                add_to_diagonal(by_deformation[p],
                                share * (state.at[p].volume_measure() - state.mean_measure));
            }
        }
    });
}

template <class Element, class Material, class Moduli>
template <class Rates>
Strains TetrahedraTerm<Element, Material, Moduli>::stress_rates(const double* q, const Rates& rates) const {
    const std::array<SimdVec3, 4> axes = unit_gradients();
    Strains out(this->elements(), 6 * points);
    loop_.each_group([&](Index group) {
        const State state(*this, group, q);
        const SimdDouble* c = constants_[group].at;
        SimdMat3 along[points], by[points], piola[points];
        rates(group, state, along);
        SimdDouble volume_rate(0.0);
        for (int p = 0; p < points; ++p) {
            const SimdDouble volume = rest_[group].volume[p];
            SimdDouble s[stresses_];
            state.at[p].stress(c, state.volumetric[p].pressure, s);
            piola[p] = volume * state.at[p].piola(c, s);
            const SimdDouble bulk = mean() ? SimdDouble(0.0) : state.volumetric[p].bulk;
            by[p] = tangent_along(
                typename Material::template Tangent<4>(state.at[p], c, s, bulk, volume, axes.data()),
                along[p]);
            volume_rate += volume * state.at[p].volume_rate(along[p]);
        }
        for (int p = 0; p < points; ++p) {
            if constexpr (may_average)
                if (mean())
                    by[p] += state.volumetric[0].bulk * volume_rate / rest_[group].total() *
                             rest_[group].volume[p] * state.at[p].volume_piola();
            const SimdMat3 cofactors = cofactor(state.f[p]);
            const SimdDouble inverse = SimdDouble(1.0) / determinant(state.f[p], cofactors);
            const SimdMat3 second = inverse * transposed_times(cofactors, piola[p]);
            const SimdMat3 rate = inverse * transposed_times(cofactors, by[p] - multiply(along[p], second));
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j <= i; ++j)
                    out.at(group)[6 * p + Green::at[i][j]] =
                        SimdDouble(0.5) * (rate.at[3 * i + j] + rate.at[3 * j + i]);
        }
    });
    return out;
}

template <class Element, class Material, class Moduli>
void TetrahedraTerm<Element, Material, Moduli>::freeze_stress_rates(const double* p) {
    frozen_ = p ? stress_rates(state_.data(), along_motion(p)) : Strains(this->elements(), 6 * points);
}

template <class Element, class Material, class Moduli>
void TetrahedraTerm<Element, Material, Moduli>::add_stress_work_vjp(const double* q,
                                                                    const Strains& curvatures, Residual& by_q,
                                                                    Gradient& out, VectorXd* by_rest) {
    const auto rates = along_strains(curvatures);
    add_forces(stress_rates(q, rates), by_q);
    add_work_vjp(q, rates, out);
    if (by_rest) add_work_rest_vjp(q, rates, *by_rest);
}

// The viscous power is V S : sym(F^T L) with the stresses S of d = (scale - 1) E - shift. The shift is that of earlier states
// (strains_vjp).
template <class Element, class Material, class Moduli>
SimdMat3 TetrahedraTerm<Element, Material, Moduli>::viscous_by_rest(Index group, int p, const SimdMat3& f,
                                                                    const SimdMat3& along) const {
    SimdDouble d[6], rate[6], of_d[6], of_rate[6], power(0.0);
    beyond_elastic(group, p, f, d);
    ViscousStrain::rate(f, along, rate);
    ViscousStrain::stress(viscous_moduli(group), d, of_d);
    ViscousStrain::stress(viscous_moduli(group), rate, of_rate);
    for (int i = 0; i < 6; ++i) power += of_d[i] * rate[i];
    const SimdMat3 turn = transposed_times(f, along);
    SimdMat3 by =
        multiply(turn + transpose(turn), Green::matrix(of_d)) +
        SimdDouble(this->history_.scale - 1.0) * multiply(transposed_times(f, f), Green::matrix(of_rate));
    by = -rest_[group].volume[p] * by;
    add_to_diagonal(by, rest_[group].volume[p] * power);
    return by;
}

}  // namespace magshell
