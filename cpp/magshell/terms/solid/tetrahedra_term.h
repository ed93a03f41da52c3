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
#include <cmath>
#include <optional>

#include "magshell/assembly/element_blocks.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/solid/tetrahedra.h"

namespace magshell {

// ViscousStrain: strains and stresses of a solid's linear viscosity at a point, with the moduli of the
// reference configuration.
//
//   d = (E_00 E_11 E_22 2 E_12 2 E_02 2 E_01),   s_ii = 2 mu d_i + lam tr E,   s_ij = mu d_k
//
// so that s . d = S : E.
struct ViscousStrain {
    static constexpr int size = 6;

    static void at(const SimdMat3& f, SimdDouble d[size]) {
        Green::strain(f, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void rate(const SimdMat3& f, const SimdMat3& along, SimdDouble d[size]) {
        Green::rate(f, along, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void stress(const RestModuli& moduli, const SimdDouble d[size], SimdDouble s[size]) {
        const SimdDouble pressure = moduli.lambda * (d[0] + d[1] + d[2]);
        for (int i = 0; i < 3; ++i) s[i] = SimdDouble(2.0) * moduli.mu * d[i] + pressure;
        for (int i = 3; i < size; ++i) s[i] = moduli.mu * d[i];
    }
    /// Returns the derivatives of stress(d) . rate by the moduli.
    static RestModuli work_by_moduli(const SimdDouble d[size], const SimdDouble rate[size]) {
        RestModuli by{(d[0] + d[1] + d[2]) * (rate[0] + rate[1] + rate[2]), SimdDouble(0.0)};
        for (int i = 0; i < 3; ++i) by.mu += SimdDouble(2.0) * d[i] * rate[i];
        for (int i = 3; i < size; ++i) by.mu += d[i] * rate[i];
        return by;
    }
};

template <class Element, class Material, class Moduli>
class TetrahedraTerm final : public Tetrahedra<Element, Material, Moduli>, public RestShapeTerm {
    using Base = Tetrahedra<Element, Material, Moduli>;
    using Base::N, Base::points, Base::n_constants, Base::may_average, Base::loop_, Base::rest_,
        Base::constants_, Base::mean, Base::gradient_of, Base::add_pull;
    using typename Base::State;
    static constexpr int stresses_ = Material::stresses;
    // Stored per point: its stresses, or its measures at the end of a linearized step.
    static constexpr bool measures_ = Material::stored_measures > 0;
    static constexpr int kept_ = measures_ ? Material::stored_measures : stresses_;

  public:
    TetrahedraTerm(const SolidTermInput& input,
                   const std::vector<std::array<Index, Element::nodes>>& element_nodes)
        : Base(input, element_nodes),
          n_nodes_(input.nodes.n_nodes()),
          stress_(measures_ ? 0 : input.solid.n_elements(), points * kept_),
          extrapolated_(input.solid.n_elements(), points * kept_) {}

    int strains_per_element() const override { return ViscousStrain::size * points; }

    void evaluate(const double* q, const LoadParameters&, Residual& out) override {
        state_.assign(q, q + 3 * n_nodes_);
        if (frozen_) return add_forces(*frozen_, out);
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
        if (frozen_) return assemble_frozen(element_block, out);
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

    void vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) override {
        if (!frozen_) add_work_vjp(q, along_motion(lambda), out);
    }

    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override {
        if (!frozen_) add_work_rest_vjp(q, along_motion(lambda), out);
    }

    // With Green's strain E, d2E is the same at all states. So the Hessian of held stresses V S' has no derivative, and that of
    // W = sum_p V S : c is one of the power P : L for the rates L = F^-T c, whose strain rate is c.
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { frozen_.reset(); }
    bool has_stress_work_vjp() const override { return true; }
    void add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q, Gradient& out,
                             VectorXd* by_rest) override;

    void add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const override {
        add_rest(out, [&](Index group, SimdMat3 by_deformation[points]) {
            SimdVec3 x[N];
            loop_.gather(group, state_.data(), x);
            for (int p = 0; p < points; ++p) {
                const SimdMat3 f = gradient_of(group, p, x);
                by_deformation[p] =
                    -multiply(transposed_times(f, f), Green::matrix(stresses.at(group) + 6 * p));
            }
        });
    }

    Strains strains(const double* q) override {
        Strains out(this->elements(), 6 * points);
        loop_.each_group([&](Index group) {
            SimdVec3 x[N];
            loop_.gather(group, q, x);
            for (int p = 0; p < points; ++p)
                ViscousStrain::at(gradient_of(group, p, x), out.at(group) + 6 * p);
        });
        return out;
    }

    Strains strain_rates(const double* step) override {
        Strains out(this->elements(), 6 * points);
        loop_.each_group([&](Index group) {
            SimdVec3 x[N], d[N];
            loop_.gather(group, state_.data(), x);
            loop_.gather(group, step, d);
            for (int p = 0; p < points; ++p)
                ViscousStrain::rate(gradient_of(group, p, x), gradient_of(group, p, d),
                                    out.at(group) + 6 * p);
        });
        return out;
    }

    Strains stresses(const Strains& strains) const override {
        Strains out(this->elements(), 6 * points);
        loop_.each_group([&](Index group) {
            for (int p = 0; p < points; ++p) {
                SimdDouble* s = out.at(group) + 6 * p;
                ViscousStrain::stress(viscous_moduli(group), strains.at(group) + 6 * p, s);
                for (int i = 0; i < 6; ++i) s[i] *= rest_[group].volume[p];
            }
        });
        return out;
    }

    void add_forces(const Strains& stresses, Residual& out) override {
        loop_.scatter_groups([&](Index group) {
            SimdVec3 x[N], g[N], force[N];
            loop_.gather(group, state_.data(), x);
            for (int p = 0; p < points; ++p)
                add_pull(group, p,
                         multiply(gradient_of(group, p, x), Green::matrix(stresses.at(group) + 6 * p)), g,
                         force);
            loop_.scatter(group, force, out);
        });
    }

    std::size_t bytes() const override {
        return this->bytes_of_elements() + bytes_of(stress_.groups) + bytes_of(extrapolated_.groups) +
               bytes_of(state_) + (frozen_ ? bytes_of(frozen_->groups) : 0) + bytes_of(viscous_.own.groups) +
               bytes_of(viscous_.extrapolated.groups);
    }

  private:
    struct ViscousStresses {
        Strains own, extrapolated;

        void resize(Index elements, int points_of_each) {
            if (own.elements == elements) return;
            own = Strains(elements, 6 * points_of_each);
            extrapolated = own;
        }
    };

    // Adds the derivatives by parameters of the power sum_p V_p P_p : L_p. rates(group, state, L) computes the L of a SIMD vector of elements.
    template <class Rates>
    void add_work_vjp(const double* q, const Rates& rates, Gradient& out) const {
        struct Constants {
            double by[n_constants];
        };
        std::vector<Constants> of_elements(this->elements());
        loop_.each_group([&](Index group) {
            const State state(*this, group, q);
            const SimdDouble* c = constants_[group].at;
            SimdMat3 all_along[points];
            rates(group, state, all_along);
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
                if (this->history_.shift) add_viscous_vjp(group, p, state.f[p], along, by);
            }
            if (mean()) {
                Material::pressure_by_constants(c, state.mean_measure, share);
                add(rate);
            }
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
                for (int k = 0; k < n_constants; ++k)
                    of_elements[loop_.element(group, lane)].by[k] = by[k][lane];
        });
        for (Index t = 0; t < this->elements(); ++t) this->moduli_.add_vjp(t, of_elements[t].by, out);
    }

    // Adds the derivatives of the same power by rest positions.
    template <class Rates>
    void add_work_rest_vjp(const double* q, const Rates& rates, VectorXd& out) const;
    // Returns the function for rates along a motion of the nodes.
    auto along_motion(const double* motion) const {
        return [this, motion](Index group, const State&, SimdMat3 out[points]) {
            SimdVec3 of_nodes[N];
            loop_.gather(group, motion, of_nodes);
            for (int p = 0; p < points; ++p) out[p] = gradient_of(group, p, of_nodes);
        };
    }
    // Returns the function for rates L = F^-T c of strains c.
    auto along_strains(const Strains& strains) const {
        return [&strains](Index group, const State& state, SimdMat3 out[points]) {
            for (int p = 0; p < points; ++p) {
                SimdDouble of_point[6];
                for (int i = 0; i < 6; ++i)
                    of_point[i] = SimdDouble(i < 3 ? 1.0 : 0.5) * strains.at(group)[6 * p + i];
                const SimdMat3 cofactors = cofactor(state.f[p]);
                out[p] = SimdDouble(1.0) / determinant(state.f[p], cofactors) *
                         multiply(cofactors, Green::matrix(of_point));
            }
        };
    }
    // Returns the rates V S' of the second Piola-Kirchhoff stresses times volumes, S = F^-1 P.
    template <class Rates>
    Strains stress_rates(const double* q, const Rates& rates) const;
    void assemble_frozen(const ElementBlock& element_block, SystemMatrix& out) const {
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

    // Returns B of the viscous part of lambda . g at a point (tetrahedra_rest.h).
    SimdMat3 viscous_by_rest(Index group, int p, const SimdMat3& f, const SimdMat3& along) const;
    // Adds the gradient with respect to rest positions of a function with the derivative B = of_points(group, B) by a deformation I + H of
    // the rest shape at each point.
    template <class OfPoints>
    void add_rest(VectorXd& out, const OfPoints& of_points) const;

    RestModuli viscous_moduli(Index group) const {
        RestModuli moduli = Material::rest_moduli(constants_[group].at);
        if (mean()) moduli.lambda = SimdDouble(-2.0 / 3.0) * moduli.mu;
        return moduli;
    }

    // Computes (scale - 1) d - shift at a point.
    void beyond_elastic(Index group, int p, const SimdMat3& f, SimdDouble d[6]) const {
        ViscousStrain::at(f, d);
        const SimdDouble* shift = this->history_.shift->at(group) + 6 * p;
        for (int i = 0; i < 6; ++i) d[i] = SimdDouble(this->history_.scale - 1.0) * d[i] - shift[i];
    }

    void viscous_stress(Index group, int p, const SimdMat3& f, SimdDouble s[6]) const {
        SimdDouble d[6];
        beyond_elastic(group, p, f, d);
        ViscousStrain::stress(viscous_moduli(group), d, s);
    }

    void add_viscous_vjp(Index group, int p, const SimdMat3& f, const SimdMat3& along,
                         SimdDouble by[n_constants]) const {
        SimdDouble d[6], rate[6];
        beyond_elastic(group, p, f, d);
        ViscousStrain::rate(f, along, rate);
        RestModuli moduli = ViscousStrain::work_by_moduli(d, rate);
        moduli.lambda *= rest_[group].volume[p];
        moduli.mu *= rest_[group].volume[p];
        if (mean()) {
            moduli.mu += SimdDouble(-2.0 / 3.0) * moduli.lambda;
            moduli.lambda = SimdDouble(0.0);
        }
        Material::rest_moduli_vjp(constants_[group].at, moduli, by);
    }

    const Index n_nodes_;
    Strains stress_, extrapolated_;
    ViscousStresses viscous_;
    std::optional<Strains> frozen_;  // V S' while stresses are held at their rates
    std::vector<double> state_;      // positions of the last evaluated state
};

}  // namespace magshell

#include "magshell/energy/st_venant_kirchhoff.h"
#include "magshell/terms/solid/tetrahedra_rest.h"

namespace magshell {

/// Creates the term of a solid with linear or quadratic elements of a material.
template <class Material, class Moduli>
std::unique_ptr<SolidTerm> make_tetrahedra_term(const SolidTermInput& input) {
    const Solid& solid = input.solid;
    if (solid.quadratic())
        return std::make_unique<TetrahedraTerm<QuadraticTetrahedron, Material, Moduli>>(
            input, solid.quadratic_nodes);
    return std::make_unique<TetrahedraTerm<LinearTetrahedron, Material, Moduli>>(input, solid.linear_nodes);
}

/// Lists an isochoric law under its name, and under "<name> poisson_ratio" for Poisson's ratio in place of the bulk
/// modulus (IsochoricModuli).
template <class Law>
SolidMaterials isochoric_entries(const std::string& name) {
    const MakeSolidTerm make = &make_tetrahedra_term<InvariantSolid<Law>, IsochoricModuli<Law>>;
    return {{name, make}, {name + " poisson_ratio", make}};
}

}  // namespace magshell
