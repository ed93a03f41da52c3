#include "magshell/terms/solid/tetrahedra.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace magshell {
namespace {

// Returns the first t in (0, longest] at which the cubic c[0] + c[1] t + c[2] t^2 + c[3] t^3 vanishes; `longest` if it
// stays positive, 0 if c[0] is not positive.
double first_root(const double c[4], double longest) {
    const auto value = [&](double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); };
    if (!(c[0] > 0.0)) return 0.0;
    // Between the roots of its derivative the cubic is monotone, so bisection finds the root.
    double bounds[4] = {0.0, longest, longest, longest};
    const double p = c[2], discriminant = p * p - 3.0 * c[1] * c[3];
    if (discriminant > 0.0) {
        const double q = -(p + std::copysign(std::sqrt(discriminant), p));  // of 3 c3 t^2 + 2 c2 t + c1
        double first = c[3] != 0.0 ? q / (3.0 * c[3]) : longest, second = q != 0.0 ? c[1] / q : longest;
        if (first > second) std::swap(first, second);
        bounds[1] = std::clamp(first, 0.0, longest);
        bounds[2] = std::clamp(second, 0.0, longest);
    }
    for (int k = 0; k < 3; ++k) {
        double low = bounds[k], high = bounds[k + 1];
        if (!(value(high) <= 0.0)) continue;
        for (int round = 0; round < 60 && high - low > 1e-14 * high; ++round) {
            const double middle = 0.5 * (low + high);
            (value(middle) > 0.0 ? low : high) = middle;
        }
        return low;
    }
    return longest;
}

}  // namespace

template <class Element>
Tetrahedra<Element>::Tetrahedra(const SolidTermInput& input, const ElementNodes& element_nodes)
    : solid_(input.solid),
      body_(input.body),
      loop_(element_nodes, input.element_blocks, input.matrix),
      element_nodes_(element_nodes),
      rest_(loop_.groups()),
      has_mean_(input.response.mean_volume),
      height_(input.solid.smallest_height()) {
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            Vec3 x[N];
            for (int k = 0; k < N; ++k) x[k] = solid_.rest(loop_.element(group, lane), k);
            const RestElement<Element> at(x);
            for (int p = 0; p < points; ++p) {
                rest_[group].volume[p].set(lane, at.volume[p]);
                for (int k = 0; k < 3; ++k)
                    set_lane(rest_[group].gradients[p][k], lane, Vec3(at.gradients[p].row(k)));
            }
        }
}

template <class Element>
double Tetrahedra<Element>::energy(const double* q, const LoadParameters&) const {
    return loop_.sum([&](Index group) { return energy_of(group, q); });
}

template <class Element>
std::vector<double> Tetrahedra<Element>::element_energies(const double* q, const LoadParameters&) const {
    return of_elements(loop_, solid_.elements.user, [&](Index group) { return energy_of(group, q); });
}

template <class Element>
bool Tetrahedra<Element>::add_projective_stiffness(NodeMatrix& out) const {
    for (Index group = 0; group < loop_.groups(); ++group) {
        const SimdDouble weight = projective_weight(group);
        SimdDouble sum[N][N];
        for (int p = 0; p < points; ++p) {
            SimdVec3 g[N];
            Element::gradients(rest_[group].gradients[p], p, g);
            for (int k = 0; k < N; ++k)
                for (int l = 0; l <= k; ++l) {
                    const SimdDouble share = weight * rest_[group].volume[p] * dot(g[k], g[l]);
                    sum[k][l] = p == 0 ? share : sum[k][l] + share;
                }
        }
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const std::array<Index, N>& nodes = element_nodes_[loop_.element(group, lane)];
            for (int k = 0; k < N; ++k) {
                out.add_diagonal(nodes[k], sum[k][k][lane]);
                for (int l = 0; l < k; ++l) out.add_pair(nodes[k], nodes[l], sum[k][l][lane]);
            }
        }
    }
    return true;
}

template <class Element>
double Tetrahedra<Element>::max_step_length(const double* q, const double* step) const {
    std::vector<double> of_groups(loop_.groups(), 1.0);
    loop_.each_group([&](Index group) {
        SimdVec3 x[N], d[N];
        loop_.gather(group, q, x);
        loop_.gather(group, step, d);
        for (int p = 0; p < points; ++p) {
            SimdDouble c[4];
            determinant_along(gradient_of(group, p, x), gradient_of(group, p, d), c);
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const double cubic[4] = {c[0][lane], c[1][lane], c[2][lane], c[3][lane]};
                if (cubic[0] > std::abs(cubic[1]) + std::abs(cubic[2]) + std::abs(cubic[3])) continue;
                of_groups[group] = std::min(of_groups[group], first_root(cubic, 1.0));
            }
        }
    });
    return *std::min_element(of_groups.begin(), of_groups.end());
}

template <class Element>
std::string Tetrahedra<Element>::invalid_state_reason(const double* q) const {
    Index first = std::numeric_limits<Index>::max();
    double least = 0.0;
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[N];
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) {
            const SimdMat3 f = gradient_of(group, p, x);
            const SimdDouble j = determinant(f, cofactor(f));
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index user = solid_.elements.user[loop_.element(group, lane)];
                if (j[lane] > 0.0 || user > first) continue;
                least = user == first ? std::min(least, j[lane]) : j[lane];
                first = user;
            }
        }
    }
    if (first == std::numeric_limits<Index>::max()) return {};
    return "element " + std::to_string(first) + " of " + solid_.owner +
           " is turned inside out (J = " + std::to_string(least) + "), for which its material has no energy";
}

template <class Element>
void Tetrahedra<Element>::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index t = 0; t < solid_.n_elements(); ++t) {
        const Rest& rest = rest_[t / SimdDouble::width];
        const int lane = t % SimdDouble::width;
        const double stiffness = size_of_modulus(t);
        double coordinate = beyond;
        for (int k = 0; k < N; ++k)
            coordinate = std::max(coordinate, beyond + solid_.rest(t, k).template lpNorm<Eigen::Infinity>());
        for (int p = 0; p < points; ++p) {
            SimdVec3 g[N];
            Element::gradients(rest.gradients[p], p, g);
            double steepest = 0.0;
            for (int k = 0; k < N; ++k) steepest = std::max(steepest, lane_of(g[k], lane).norm());
            const double stress = stiffness * (1.0 + 0.25 * coordinate * steepest) * rest.volume[p][lane];
            for (int k = 0; k < N; ++k)
                out.segment<3>(3 * element_nodes_[t][k]).array() += stress * lane_of(g[k], lane).norm();
        }
    }
}

template <class Element>
PointStates Tetrahedra<Element>::point_states(const double* q) const {
    const std::size_t count = static_cast<std::size_t>(elements()) * points;
    PointStates out{points, std::vector<Mat3>(count), std::vector<Mat3>(count), std::vector<double>(count)};
    loop_.each_group([&](Index group) {
        SimdMat3 all[points];
        PointResponse response[points];
        gradients_of(group, q, all);
        respond(group, all, nullptr, response);
        for (int p = 0; p < points; ++p) {
            const SimdMat3& f = all[p];
            const SimdMat3 cauchy =
                SimdDouble(1.0) / determinant(f, cofactor(f)) * multiply(response[p].piola, transpose(f));
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const std::size_t at =
                    static_cast<std::size_t>(solid_.elements.user[loop_.element(group, lane)]) * points + p;
                for (int k = 0; k < 9; ++k) {
                    out.deformation_gradients[at](k / 3, k % 3) = f.at[k][lane];
                    out.cauchy_stresses[at](k / 3, k % 3) = cauchy.at[k][lane];
                }
                out.volumes[at] = rest_[group].volume[p][lane];
            }
        }
    });
    return out;
}

template <class Element>
auto Tetrahedra<Element>::along_motion(const double* motion) const -> Rates {
    return [this, motion](Index group, const SimdMat3*, SimdMat3 out[points]) {
        gradients_of(group, motion, out);
    };
}

template <class Element>
auto Tetrahedra<Element>::along_strains(const Strains& strains) -> Rates {
    return [&strains](Index group, const SimdMat3 f[points], SimdMat3 out[points]) {
        for (int p = 0; p < points; ++p) {
            SimdDouble of_point[6];
            for (int i = 0; i < 6; ++i)
                of_point[i] = SimdDouble(i < 3 ? 1.0 : 0.5) * strains.at(group)[6 * p + i];
            const SimdMat3 cofactors = cofactor(f[p]);
            out[p] =
                SimdDouble(1.0) / determinant(f[p], cofactors) * multiply(cofactors, Green::matrix(of_point));
        }
    };
}

template <class Element>
void Tetrahedra<Element>::respond_to(const Rates& rates, Index group, const double* q, SimdMat3 f[points],
                                     SimdMat3 along[points], PointResponse out[points]) const {
    gradients_of(group, q, f);
    rates(group, f, along);
    respond(group, f, along, out);
}

template <class Element>
void Tetrahedra<Element>::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    if (!frozen_) add_work_vjp(q, along_motion(lambda), out);
}

template <class Element>
void Tetrahedra<Element>::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                       VectorXd& out) {
    if (!frozen_) add_work_rest_vjp(q, along_motion(lambda), out);
}

template <class Element>
void Tetrahedra<Element>::add_rest(VectorXd& out,
                                   const std::function<void(Index, SimdMat3[points])>& of_points) const {
    std::vector<std::array<Vec3, N>> by_nodes(elements());
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
    for (Index t = 0; t < elements(); ++t)
        for (int k = 0; k < N; ++k) out.segment<3>(3 * element_nodes_[t][k]) += by_nodes[t][k];
}

template <class Element>
void Tetrahedra<Element>::add_work_rest_vjp(const double* q, const Rates& rates, VectorXd& out) const {
    add_rest(out, [&](Index group, SimdMat3 by_deformation[points]) {
        SimdMat3 f[points], along[points];
        PointResponse response[points];
        respond_to(rates, group, q, f, along, response);
        for (int p = 0; p < points; ++p) {
            const auto& [piola, rate, volume_excess] = response[p];
            SimdMat3& by = by_deformation[p];
            by = -(transposed_times(f[p], rate) + transposed_times(along[p], piola));
            add_to_diagonal(by, double_dot(piola, along[p]) + volume_excess);
            by = rest_[group].volume[p] * by;
            if (this->history_.shift) by += viscous_by_rest(group, p, f[p], along[p]);
        }
    });
}

template <class Element>
void Tetrahedra<Element>::add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const {
    add_rest(out, [&](Index group, SimdMat3 by_deformation[points]) {
        SimdMat3 f[points];
        gradients_of(group, state_.data(), f);
        for (int p = 0; p < points; ++p)
            by_deformation[p] =
                -multiply(transposed_times(f[p], f[p]), Green::matrix(stresses.at(group) + 6 * p));
    });
}

template <class Element>
Strains Tetrahedra<Element>::stress_rates(const double* q, const Rates& rates) const {
    Strains out(elements(), 6 * points);
    loop_.each_group([&](Index group) {
        SimdMat3 f[points], along[points];
        PointResponse response[points];
        respond_to(rates, group, q, f, along, response);
        for (int p = 0; p < points; ++p) {
            const SimdMat3 cofactors = cofactor(f[p]);
            const SimdDouble inverse = SimdDouble(1.0) / determinant(f[p], cofactors);
            const SimdMat3 second = inverse * transposed_times(cofactors, response[p].piola);
            const SimdMat3 rate = (rest_[group].volume[p] * inverse) *
                                  transposed_times(cofactors, response[p].rate - multiply(along[p], second));
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j <= i; ++j)
                    out.at(group)[6 * p + Green::at[i][j]] =
                        SimdDouble(0.5) * (rate.at[3 * i + j] + rate.at[3 * j + i]);
        }
    });
    return out;
}

template <class Element>
void Tetrahedra<Element>::freeze_stress_rates(const double* p) {
    frozen_ = p ? stress_rates(state_.data(), along_motion(p)) : Strains(elements(), 6 * points);
}

template <class Element>
void Tetrahedra<Element>::add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q,
                                              Gradient& out, VectorXd* by_rest) {
    const Rates rates = along_strains(curvatures);
    add_forces(stress_rates(q, rates), by_q);
    add_work_vjp(q, rates, out);
    if (by_rest) add_work_rest_vjp(q, rates, *by_rest);
}

template <class Element>
void Tetrahedra<Element>::assemble_frozen(const ElementBlock& element_block, SystemMatrix& out) const {
    ElementLoop<N>::over_groups(element_block, [&](Index group) {
        const SimdDouble zero(0.0);
        SimdVec3 x[N], g[N];
        SimdMat3 h[N * (N + 1) / 2];
        loop_.gather(group, state_.data(), x);
        for (int p = 0; p < points; ++p) {
            Element::gradients(rest_[group].gradients[p], p, g);
            add_blocks<N>(QuadraticTangent<N>(gradient_of(group, p, x), frozen_->at(group) + 6 * p, zero,
                                              zero, SimdDouble(1.0), g),
                          p == 0, h);
        }
        complete_blocks<N>(h);
        loop_.scatter(group, h, out);
    });
}

template <class Element>
Strains Tetrahedra<Element>::strains(const double* q) {
    Strains out(elements(), 6 * points);
    loop_.each_group([&](Index group) {
        SimdMat3 f[points];
        gradients_of(group, q, f);
        for (int p = 0; p < points; ++p) ViscousStrain::at(f[p], out.at(group) + 6 * p);
    });
    return out;
}

template <class Element>
Strains Tetrahedra<Element>::strain_rates(const double* step) {
    Strains out(elements(), 6 * points);
    loop_.each_group([&](Index group) {
        SimdMat3 f[points], along[points];
        gradients_of(group, state_.data(), f);
        gradients_of(group, step, along);
        for (int p = 0; p < points; ++p) ViscousStrain::rate(f[p], along[p], out.at(group) + 6 * p);
    });
    return out;
}

template <class Element>
Strains Tetrahedra<Element>::stresses(const Strains& strains) const {
    Strains out(elements(), 6 * points);
    loop_.each_group([&](Index group) {
        const RestModuli moduli = viscous(rest_moduli(group));
        for (int p = 0; p < points; ++p) {
            SimdDouble* s = out.at(group) + 6 * p;
            ViscousStrain::stress(moduli, strains.at(group) + 6 * p, s);
            for (int i = 0; i < 6; ++i) s[i] *= rest_[group].volume[p];
        }
    });
    return out;
}

template <class Element>
void Tetrahedra<Element>::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdMat3 f[points];
        SimdVec3 g[N], force[N];
        gradients_of(group, state_.data(), f);
        for (int p = 0; p < points; ++p)
            add_pull(group, p, multiply(f[p], Green::matrix(stresses.at(group) + 6 * p)), g, force);
        loop_.scatter(group, force, out);
    });
}

template <class Element>
RestModuli Tetrahedra<Element>::viscous_work_by_moduli(Index group, int p, const SimdMat3& f,
                                                       const SimdMat3& along) const {
    SimdDouble d[6], rate[6];
    beyond_elastic(group, p, f, d);
    ViscousStrain::rate(f, along, rate);
    RestModuli by = ViscousStrain::work_by_moduli(d, rate);
    by.lambda *= rest_[group].volume[p];
    by.mu *= rest_[group].volume[p];
    if (mean()) {
        by.mu += SimdDouble(-2.0 / 3.0) * by.lambda;
        by.lambda = SimdDouble(0.0);
    }
    return by;
}

// The viscous power is V S : sym(F^T L) with the stresses S of d = (scale - 1) E - shift. The shift comes from earlier states;
// strains_vjp differentiates it.
template <class Element>
SimdMat3 Tetrahedra<Element>::viscous_by_rest(Index group, int p, const SimdMat3& f,
                                              const SimdMat3& along) const {
    SimdDouble d[6], rate[6], of_d[6], of_rate[6], power(0.0);
    const RestModuli moduli = viscous(rest_moduli(group));
    beyond_elastic(group, p, f, d);
    ViscousStrain::rate(f, along, rate);
    ViscousStrain::stress(moduli, d, of_d);
    ViscousStrain::stress(moduli, rate, of_rate);
    for (int i = 0; i < 6; ++i) power += of_d[i] * rate[i];
    const SimdMat3 turn = transposed_times(f, along);
    SimdMat3 by =
        multiply(turn + transpose(turn), Green::matrix(of_d)) +
        SimdDouble(this->history_.scale - 1.0) * multiply(transposed_times(f, f), Green::matrix(of_rate));
    by = -rest_[group].volume[p] * by;
    add_to_diagonal(by, rest_[group].volume[p] * power);
    return by;
}

template class Tetrahedra<LinearTetrahedron>;
template class Tetrahedra<QuadraticTetrahedron>;

}  // namespace magshell
