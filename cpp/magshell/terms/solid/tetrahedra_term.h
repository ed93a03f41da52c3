// TetrahedraTerm: forces and Hessian of a solid's tetrahedra.
//
// Mixed Newton stores the stresses of a material at every point (the part of P that is not linear in F), or the
// measures of which they are functions, and with a mean volume those of the element. They are unknowns of the
// linearization, condensed element by element.
//
// The viscous stress follows from Green's strain d at every point and the moduli in the reference configuration
// (ViscousStrain): C ((scale - 1) d - shift) is added to the elastic stress (terms/shell/strains.h). With a
// mean volume it resists shear only; otherwise it would lock as the volumetric part does.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "magshell/assembly/element_blocks.h"
#include "magshell/terms/solid/solid_moduli.h"
#include "magshell/terms/solid/tetrahedra.h"

namespace magshell {

/// Returns dP/dF : L of a material from its tangent, whose blocks are taken for unit vectors as gradients.
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

/// Returns vectors for which the blocks of a tangent of four nodes are the derivatives dP/dF.
inline std::array<SimdVec3, 4> unit_gradients() {
    const SimdDouble zero(0.0), one(1.0);
    const SimdVec3 x{one, zero, zero}, y{zero, one, zero}, z{zero, zero, one};
    return {-(x + y + z), x, y, z};
}

template <class Element, class Material>
class TetrahedraTerm final : public Tetrahedra<Element> {
    using Base = Tetrahedra<Element>;
    using Base::N, Base::points, Base::loop_, Base::rest_, Base::frozen_, Base::state_, Base::mean,
        Base::gradient_of, Base::add_pull;
    using typename Base::Rates;
    static constexpr int stresses_ = Material::stresses, n_constants = Material::constants;
    // Stored per point: its stresses, or its measures at the end of a linearized step.
    static constexpr bool measures_ = Material::stored_measures > 0;
    static constexpr int kept_ = measures_ ? Material::stored_measures : stresses_;
    // Whether there is a mean of several points, and a part of the energy that can act on it.
    static constexpr bool may_average =
        points > 1 && requires(const Material& at, const SimdVec3& g) { at.volume_gradient(g); };

  public:
    TetrahedraTerm(const SolidTermInput& input, const typename Base::ElementNodes& element_nodes,
                   std::unique_ptr<SolidModuli> moduli)
        : Base(input, element_nodes),
          n_nodes_(input.nodes.n_nodes()),
          moduli_(std::move(moduli)),
          constants_(loop_.groups()),
          stress_(measures_ ? 0 : input.solid.n_elements(), points * kept_),
          extrapolated_(input.solid.n_elements(), points * kept_) {}

    bool set_values(const Values& values) override {
        if (!moduli_->set_values(values)) return false;
        double c[n_constants];
        for (Index group = 0; group < loop_.groups(); ++group)
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                moduli_->constants(loop_.element(group, lane), c);
                for (int k = 0; k < n_constants; ++k) constants_[group].at[k].set(lane, c[k]);
            }
        return true;
    }

    Capabilities capabilities() const override {
        return {.has_infeasible_states = Material::refuses_inversion,
                .has_transient_instability = true,
                .has_transient_stresses = true};
    }

    void evaluate(const double* q, const LoadParameters&, Residual& out) override {
        state_.assign(q, q + 3 * n_nodes_);
        if (frozen_) return this->add_forces(*frozen_, out);
        if (this->history_.shift) viscous_.resize(this->elements(), points);
        // All calls are inlined: passing SIMD vectors between functions through memory takes a third of the time.
        loop_.scatter_groups([&](Index group) __attribute__((flatten)) {
            const State state(*this, group, q);
            SimdVec3 g[N], force[N];
            for (int p = 0; p < points; ++p) {
                SimdDouble s[stresses_];
                state.at[p].stress(constants_[group].at, state.volumetric[p].pressure, s);
                if constexpr (!measures_) std::copy_n(s, kept_, stress_.at(group) + p * kept_);
                SimdMat3 piola = state.at[p].piola(constants_[group].at, s);
                if (this->history_.shift) {
                    SimdDouble* viscous = viscous_.own.at(group) + 6 * p;
                    viscous_stress(group, p, state.f[p], viscous);
                    piola += multiply(state.f[p], Green::matrix(viscous));
                }
                add_pull(group, p, rest_[group].volume[p] * piola, g, force);
            }
            loop_.scatter(group, force, out);
        });
    }

    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                  bool extrapolated_stress, SystemMatrix& out) const override {
        if (frozen_) return this->assemble_frozen(element_block, out);
        const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
        const Strains& viscous = extrapolated_stress ? viscous_.extrapolated : viscous_.own;
        ElementLoop<N>::over_groups(element_block, [&](Index group) __attribute__((flatten)) {
            State state(*this, group, q);
            if constexpr (measures_)
                if (extrapolated_stress) state.take_measures(*this, group, extrapolated_.at(group));
            const SimdDouble* c = constants_[group].at;
            SimdVec3 g[N], volume_gradient[N];
            SimdMat3 h[N * (N + 1) / 2];
            for (int p = 0; p < points; ++p) {
                Element::gradients(rest_[group].gradients[p], p, g);
                const SimdDouble volume = rest_[group].volume[p];
                const SimdDouble bulk = mean() ? SimdDouble(0.0) : state.volumetric[p].bulk;
                SimdDouble s[stresses_];
                if constexpr (measures_)
                    state.at[p].stress(c, state.volumetric[p].pressure, s);
                else
                    std::copy_n(stress.at(group) + p * kept_, kept_, s);
                const typename Material::template Tangent<N> tangent(state.at[p], c, s, bulk, volume, g);
                add_blocks<N>(tangent, p == 0, h);
                if constexpr (may_average)
                    for (int k = 1; mean() && k < N; ++k) {
                        const SimdVec3 share = volume * state.at[p].volume_gradient(g[k]);
                        volume_gradient[k] = p == 0 ? share : volume_gradient[k] + share;
                    }
                if (this->history_.shift) {
                    const RestModuli moduli = viscous_moduli(group);
                    const SimdDouble more(this->history_.scale - 1.0);
                    add_blocks<N>(QuadraticTangent<N>(state.f[p], viscous.at(group) + 6 * p,
                                                      more * moduli.lambda, more * moduli.mu, volume, g),
                                  false, h);
                }
            }
            if (mean()) {
                const SimdDouble bulk = state.volumetric[0].bulk / rest_[group].total();
                for (int k = 1; k < N; ++k)
                    for (int l = 1; l <= k; ++l)
                        h[lower_index(k, l)] += outer(bulk * volume_gradient[k], volume_gradient[l]);
            }
            complete_blocks<N>(h);
            loop_.scatter(group, h, out);
        });
    }

    void extrapolate(const double* step) override {
        loop_.each_group([&](Index group) {
            const State state(*this, group, state_.data());
            SimdVec3 p_nodes[N];
            loop_.gather(group, step, p_nodes);
            SimdMat3 along[points];
            SimdDouble mean_rate(0.0);
            for (int p = 0; p < points; ++p) {
                along[p] = gradient_of(group, p, p_nodes);
                if (mean()) mean_rate += rest_[group].volume[p] * state.at[p].volume_rate(along[p]);
            }
            if (mean()) mean_rate = mean_rate / rest_[group].total();
            for (int p = 0; p < points; ++p) {
                SimdDouble* kept = extrapolated_.at(group) + p * kept_;
                if constexpr (measures_) {
                    state.at[p].measures_after(along[p], kept);
                } else {
                    const SimdDouble rate = mean() ? mean_rate : state.at[p].volume_rate(along[p]);
                    state.at[p].stress_rate(constants_[group].at, along[p], state.volumetric[p].bulk * rate,
                                            kept);
                    for (int i = 0; i < kept_; ++i) kept[i] += stress_.at(group)[p * kept_ + i];
                }
                if (!this->history_.shift) continue;
                SimdDouble strain[6], more[6];
                ViscousStrain::rate(state.f[p], along[p], strain);
                for (SimdDouble& entry : strain) entry *= SimdDouble(this->history_.scale - 1.0);
                ViscousStrain::stress(viscous_moduli(group), strain, more);
                for (int i = 0; i < 6; ++i)
                    viscous_.extrapolated.at(group)[6 * p + i] = viscous_.own.at(group)[6 * p + i] + more[i];
            }
        });
    }

    std::size_t bytes() const override {
        return this->bytes_of_elements() + bytes_of(constants_) + bytes_of(stress_.groups) +
               bytes_of(extrapolated_.groups) + bytes_of(viscous_.own.groups) +
               bytes_of(viscous_.extrapolated.groups);
    }

  private:
    struct Constants {
        SimdDouble at[n_constants];
    };
    // The kinematics and the volumetric response of a SIMD vector of elements.
    struct Gradients {
        SimdMat3 f[points];

        explicit Gradients(const SimdMat3* given) { std::copy_n(given, points, f); }
        Gradients(const TetrahedraTerm& term, Index group, const double* q) {
            term.gradients_of(group, q, f);
        }
    };
    struct State {
        SimdMat3 f[points];
        Material at[points];
        Volumetric volumetric[points];  // with a mean volume all the same
        SimdDouble mean_measure;

        State(const TetrahedraTerm& term, Index group, const double* q)
            : State(term, group, Gradients(term, group, q)) {}
        State(const TetrahedraTerm& term, Index group, const Gradients& given)
            : State(term, group, given, std::make_index_sequence<points>()) {}

        /// Evaluates the law at other measures, those of each point in a row.
        void take_measures(const TetrahedraTerm& term, Index group, const SimdDouble* measures) {
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
        void respond(const TetrahedraTerm& term, Index group) {
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

        template <std::size_t... p>
        State(const TetrahedraTerm& term, Index group, const Gradients& given, std::index_sequence<p...>)
            : f{given.f[p]...}, at{Material(given.f[p])...} {
            respond(term, group);
        }
    };

    struct ViscousStresses {
        Strains own, extrapolated;

        void resize(Index elements, int points_of_each) {
            if (own.elements == elements) return;
            own = Strains(elements, 6 * points_of_each);
            extrapolated = own;
        }
    };

    SimdDouble energy_of(Index group, const double* q) const override {
        const State state(*this, group, q);
        SimdDouble total = mean() ? rest_[group].total() * state.volumetric[0].energy : SimdDouble(0.0);
        for (int p = 0; p < points; ++p) {
            SimdDouble density = state.at[p].energy(constants_[group].at);
            if (!mean()) density += state.volumetric[p].energy;
            total += rest_[group].volume[p] * density;
        }
        return total;
    }

    void respond(Index group, const SimdMat3 f[points], const SimdMat3* rates,
                 PointResponse out[points]) const override {
        const std::array<SimdVec3, 4> axes = unit_gradients();
        const State state(*this, group, Gradients(f));
        const SimdDouble* c = constants_[group].at;
        SimdDouble volume_rate(0.0);
        for (int p = 0; p < points; ++p) {
            SimdDouble s[stresses_];
            state.at[p].stress(c, state.volumetric[p].pressure, s);
            out[p].piola = state.at[p].piola(c, s);
            if (!rates) continue;
            const SimdDouble bulk = mean() ? SimdDouble(0.0) : state.volumetric[p].bulk;
            const typename Material::template Tangent<4> tangent(state.at[p], c, s, bulk, SimdDouble(1.0),
                                                                 axes.data());
            out[p].rate = tangent_along(tangent, rates[p]);
            out[p].volume_excess = SimdDouble(0.0);
            volume_rate += rest_[group].volume[p] * state.at[p].volume_rate(rates[p]);
        }
        if constexpr (may_average) {
            if (!mean() || !rates) return;
            const SimdDouble pressure_rate = state.volumetric[0].bulk * volume_rate / rest_[group].total();
            for (int p = 0; p < points; ++p) {
                out[p].rate += pressure_rate * state.at[p].volume_piola();
                out[p].volume_excess = pressure_rate * (state.at[p].volume_measure() - state.mean_measure);
            }
        }
    }

    void add_work_vjp(const double* q, const Rates& rates, Gradient& out) const override {
        struct ByConstants {
            double by[n_constants];
        };
        std::vector<ByConstants> of_elements(this->elements());
        loop_.each_group([&](Index group) {
            const State state(*this, group, q);
            const SimdDouble* c = constants_[group].at;
            SimdMat3 all_along[points];
            rates(group, state.f, all_along);
            SimdDouble by[n_constants], share[n_constants], rate(0.0);
            for (SimdDouble& entry : by) entry = SimdDouble(0.0);
            const auto add = [&](const SimdDouble& factor) {
                for (int k = 0; k < n_constants; ++k) by[k] += factor * share[k];
            };
            for (int p = 0; p < points; ++p) {
                const SimdDouble volume = rest_[group].volume[p];
                const SimdMat3& along = all_along[p];
                state.at[p].work_by_constants(c, along, share);
                add(volume);
                rate += volume * state.at[p].volume_rate(along);
                if (!mean()) {
                    Material::pressure_by_constants(c, state.at[p].volume_measure(), share);
                    add(rate);
                    rate = SimdDouble(0.0);
                }
                if (this->history_.shift)
                    Material::rest_moduli_vjp(c, this->viscous_work_by_moduli(group, p, state.f[p], along),
                                              by);
            }
            if (mean()) {
                Material::pressure_by_constants(c, state.mean_measure, share);
                add(rate);
            }
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
                for (int k = 0; k < n_constants; ++k)
                    of_elements[loop_.element(group, lane)].by[k] = by[k][lane];
        });
        for (Index t = 0; t < this->elements(); ++t) moduli_->add_vjp(t, of_elements[t].by, out);
    }

    RestModuli rest_moduli(Index group) const override { return Material::rest_moduli(constants_[group].at); }
    // The weight is the material's own, or the P-wave modulus of the reference configuration, 2 mu + lambda.
    SimdDouble projective_weight(Index group) const override {
        if constexpr (requires { Material::projective_weight(constants_[group].at); })
            return Material::projective_weight(constants_[group].at);
        const RestModuli moduli = rest_moduli(group);
        return SimdDouble(2.0) * moduli.mu + moduli.lambda;
    }
    double size_of_modulus(Index element) const override { return moduli_->size(element); }
    RestModuli viscous_moduli(Index group) const { return this->viscous(rest_moduli(group)); }

    void viscous_stress(Index group, int p, const SimdMat3& f, SimdDouble s[6]) const {
        SimdDouble d[6];
        this->beyond_elastic(group, p, f, d);
        ViscousStrain::stress(viscous_moduli(group), d, s);
    }

    const Index n_nodes_;
    const std::unique_ptr<SolidModuli> moduli_;
    std::vector<Constants> constants_;
    Strains stress_, extrapolated_;
    ViscousStresses viscous_;
};

/// Creates the term of a solid with linear or quadratic elements of a material.
template <class Material, class Moduli>
std::unique_ptr<SolidTerm> make_tetrahedra_term(const SolidTermInput& input) {
    const Solid& solid = input.solid;
    auto moduli = std::make_unique<Moduli>(input);
    if (solid.quadratic())
        return std::make_unique<TetrahedraTerm<QuadraticTetrahedron, Material>>(input, solid.quadratic_nodes,
                                                                                std::move(moduli));
    return std::make_unique<TetrahedraTerm<LinearTetrahedron, Material>>(input, solid.linear_nodes,
                                                                         std::move(moduli));
}

/// Lists an isochoric law under its name, and under "<name> poisson_ratio" for Poisson's ratio in place of the bulk
/// modulus (IsochoricModuli).
template <class Law>
SolidMaterials isochoric_entries(const std::string& name) {
    const MakeSolidTerm make = &make_tetrahedra_term<InvariantSolid<Law>, IsochoricModuli<Law>>;
    return {{name, make}, {name + " poisson_ratio", make}};
}

}  // namespace magshell
