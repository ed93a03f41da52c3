// Tetrahedra: the elements of a solid, all of one kind and one material: their reference shapes, constants,
// energies and admissible steps.
//
//   E = sum over elements  sum_p V_p W(F_p)           W = w + U(v), v the material's measure of volume
//   mean:                  sum_p V_p w(F_p) + V U(v^), v^ = sum_p V_p v_p / V
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/st_venant_kirchhoff.h"
#include "magshell/strain/tetrahedron.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/solid/solid_moduli.h"
#include "magshell/terms/solid/solid_term.h"

namespace magshell {

/// Returns the first t in (0, longest] at which c[0] + c[1] t + c[2] t^2 + c[3] t^3 vanishes; `longest` if it
/// stays positive, 0 if c[0] is not positive.
inline double first_root(const double c[4], double longest) {
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

template <class Element, class Material, class Moduli>
class Tetrahedra : public SolidTerm, public ElementEnergies {
  public:
    Tetrahedra(const SolidTermInput& input,
               const std::vector<std::array<Index, Element::nodes>>& element_nodes)
        : solid_(input.solid),
          body_(input.body),
          loop_(element_nodes, input.element_blocks, input.matrix),
          element_nodes_(element_nodes),
          moduli_(input),
          rest_(loop_.groups()),
          constants_(loop_.groups()),
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

    Index body() const override { return body_; }
    Index elements() const override { return solid_.n_elements(); }
    /// Returns the smallest height of an element [m]: a displacement of that size changes strains by about one.
    double length_scale() const override { return height_; }

    bool set_values(const Values& values) override {
        if (!moduli_.set_values(values)) return false;
        double c[n_constants];
        for (Index group = 0; group < loop_.groups(); ++group)
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                moduli_.constants(loop_.element(group, lane), c);
                for (int k = 0; k < n_constants; ++k) constants_[group].at[k].set(lane, c[k]);
            }
        return true;
    }

    double energy(const double* q, const LoadParameters&) const override {
        return loop_.sum(energy_of_group(q));
    }
    std::vector<double> element_energies(const double* q, const LoadParameters&) const override {
        return of_elements(loop_, solid_.elements.user, energy_of_group(q));
    }

    /// Adds w sum_p V_p g_k . g_l. The weight w is the material's own, or the P-wave modulus of the reference
    /// configuration, 2 mu + lambda.
    bool add_projective_stiffness(NodeMatrix& out) const override {
        for (Index group = 0; group < loop_.groups(); ++group) {
            const RestModuli moduli = Material::rest_moduli(constants_[group].at);
            SimdDouble weight = SimdDouble(2.0) * moduli.mu + moduli.lambda;
            if constexpr (requires { Material::projective_weight(constants_[group].at); })
                weight = Material::projective_weight(constants_[group].at);
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

    Capabilities capabilities() const override {
        return {.has_infeasible_states = Material::refuses_inversion,
                .has_transient_instability = true,
                .has_transient_stresses = true};
    }

    double max_step_length(const double* q, const double* step) const override {
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

    std::string invalid_state_reason(const double* q) const override {
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
                    if (j[lane] > 0.0 || user >= first) continue;
                    first = user;
                    least = j[lane];
                }
            }
        }
        if (first == std::numeric_limits<Index>::max()) return {};
        return "element " + std::to_string(first) + " of " + solid_.owner +
               " is turned inside out (J = " + std::to_string(least) +
               "), for which its material has no energy";
    }

    void add_cancelling_forces(double beyond, VectorXd& out) const override {
        for (Index t = 0; t < solid_.n_elements(); ++t) {
            const Rest& rest = rest_[t / SimdDouble::width];
            const int lane = t % SimdDouble::width;
            const double stiffness = moduli_.size(t);
            double coordinate = beyond;
            for (int k = 0; k < N; ++k)
                coordinate =
                    std::max(coordinate, beyond + solid_.rest(t, k).template lpNorm<Eigen::Infinity>());
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

    PointStates point_states(const double* q) const override {
        const std::size_t count = static_cast<std::size_t>(elements()) * points;
        PointStates out{points, std::vector<Mat3>(count), std::vector<Mat3>(count),
                        std::vector<double>(count)};
        loop_.each_group([&](Index group) {
            const State state(*this, group, q);
            for (int p = 0; p < points; ++p) {
                SimdDouble s[Material::stresses];
                state.at[p].stress(constants_[group].at, state.volumetric[p].pressure, s);
                const SimdMat3& f = state.f[p];
                const SimdMat3 cauchy = SimdDouble(1.0) / determinant(f, cofactor(f)) *
                                        multiply(state.at[p].piola(constants_[group].at, s), transpose(f));
                for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                    const std::size_t at =
                        static_cast<std::size_t>(solid_.elements.user[loop_.element(group, lane)]) * points +
                        p;
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

  protected:
    static constexpr int N = Element::nodes, points = Element::points, n_constants = Material::constants;
    // Whether there is a mean of several points, and a part of the energy that can act on it.
    static constexpr bool may_average =
        points > 1 && requires(const Material& at, const SimdVec3& g) { at.volume_gradient(g); };

    /// Returns whether the volumetric energy is evaluated at the mean volume of an element. It is asked when the program runs, as an
    /// element with a mean and one without are nearly the same code, and each takes long to compile.
    bool mean() const { return may_average && has_mean_; }

    /// Returns a function of a SIMD vector that computes the energies [J] of its elements.
    auto energy_of_group(const double* q) const {
        return [this, q](Index group) {
            const State state(*this, group, q);
            SimdDouble total = mean() ? rest_[group].total() * state.volumetric[0].energy : SimdDouble(0.0);
            for (int p = 0; p < points; ++p) {
                SimdDouble density = state.at[p].energy(constants_[group].at);
                if (!mean()) density += state.volumetric[p].energy;
                total += rest_[group].volume[p] * density;
            }
            return total;
        };
    }

    struct Rest {
        SimdVec3 gradients[points][3];
        SimdDouble volume[points];

        SimdDouble total() const {
            SimdDouble sum = volume[0];
            for (int p = 1; p < points; ++p) sum += volume[p];
            return sum;
        }
    };
    struct Constants {
        SimdDouble at[n_constants];
    };
    // The kinematics and the volumetric response of a SIMD vector of elements at q.
    struct State {
        SimdMat3 f[points];
        Material at[points];
        Volumetric volumetric[points];  // with a mean volume all the same
        SimdDouble mean_measure;

        State(const Tetrahedra& term, Index group, const double* q)
            : State(term, group, Gradients(term, group, q), std::make_index_sequence<points>()) {}

        /// Evaluates the law at other measures, those of each point in a row.
        void take_measures(const Tetrahedra& term, Index group, const SimdDouble* measures) {
            const SimdDouble* c = term.constants_[group].at;
            SimdDouble before[points];
            for (int k = 0; k < points; ++k) before[k] = at[k].volume_measure();
            const SimdDouble mean_before = mean_measure;
            for (int p = 0; p < points; ++p) at[p].take_measures(measures + Material::stored_measures * p);
            respond(term, group);
            if (term.mean()) {
                volumetric[0].bulk = Material::bulk_between(c, mean_measure, mean_before);
                for (int k = 1; k < points; ++k) volumetric[k].bulk = volumetric[0].bulk;
            } else {
                for (int k = 0; k < points; ++k)
                    volumetric[k].bulk = Material::bulk_between(c, at[k].volume_measure(), before[k]);
            }
        }

      private:
        void respond(const Tetrahedra& term, Index group) {
            const SimdDouble* c = term.constants_[group].at;
            if (term.mean()) {
                SimdDouble sum(0.0);
                for (int k = 0; k < points; ++k) sum += term.rest_[group].volume[k] * at[k].volume_measure();
                mean_measure = sum / term.rest_[group].total();
                volumetric[0] = Material::volumetric(c, mean_measure);
                for (int k = 1; k < points; ++k) volumetric[k] = volumetric[0];
            } else {
                for (int k = 0; k < points; ++k)
                    volumetric[k] = Material::volumetric(c, at[k].volume_measure());
            }
        }

        struct Gradients {
            SimdMat3 f[points];
            Gradients(const Tetrahedra& term, Index group, const double* q) {
                SimdVec3 x[N];
                term.loop_.gather(group, q, x);
                for (int p = 0; p < points; ++p) f[p] = term.gradient_of(group, p, x);
            }
        };

        template <std::size_t... p>
        State(const Tetrahedra& term, Index group, const Gradients& given, std::index_sequence<p...>)
            : f{given.f[p]...}, at{Material(given.f[p])...} {
            respond(term, group);
        }
    };

    SimdMat3 gradient_of(Index group, int p, const SimdVec3 x[N]) const {
        SimdVec3 g[N];
        Element::gradients(rest_[group].gradients[p], p, g);
        return deformation_gradient<N>(x, g);
    }

    // Computes force_k += stress g_k.
    void add_pull(Index group, int p, const SimdMat3& stress, SimdVec3 g[N], SimdVec3 force[N]) const {
        Element::gradients(rest_[group].gradients[p], p, g);
        SimdVec3 sum{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
        for (int k = 1; k < N; ++k) {
            const SimdVec3 pull = multiply(stress, g[k]);
            force[k] = p == 0 ? pull : force[k] + pull;
            sum += pull;
        }
        force[0] = p == 0 ? -sum : force[0] - sum;
    }

    std::size_t bytes_of_elements() const { return loop_.bytes() + bytes_of(rest_) + bytes_of(constants_); }

    const Solid& solid_;
    const Index body_;
    const ElementLoop<N> loop_;
    const std::vector<std::array<Index, N>>& element_nodes_;
    Moduli moduli_;
    std::vector<Rest> rest_;
    std::vector<Constants> constants_;
    const bool has_mean_;
    const double height_;
};

}  // namespace magshell
