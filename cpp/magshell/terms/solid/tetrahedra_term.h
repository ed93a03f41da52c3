// TetrahedraTerm: forces and Hessian of a solid's tetrahedra.
//
// Mixed Newton stores the stresses of a material at every point (the part of P that is not linear in F), or the
// measures of which they are functions, and with a mean volume those of the element. They are unknowns of the
// linearization, condensed element by element.
//
// The viscous stress follows from Green's strain d at every point and the moduli in the reference configuration
// (energy/viscous_strain.h): C ((scale - 1) d - shift) is added to the elastic stress (terms/shell/strains.h). With a
// mean volume it resists shear only; otherwise it would lock as the volumetric part does.
#pragma once

#include <algorithm>
#include <cmath>

#include "magshell/assembly/element_blocks.h"
#include "magshell/energy/viscous_strain.h"
#include "magshell/terms/solid/tetrahedra.h"

namespace magshell {

template <class Element, class Material, class Moduli, bool mean>
class TetrahedraTerm final : public Tetrahedra<Element, Material, Moduli, mean> {
    using Base = Tetrahedra<Element, Material, Moduli, mean>;
    using Base::N, Base::points, Base::n_constants, Base::loop_, Base::rest_, Base::constants_,
        Base::gradient_of, Base::add_pull;
    using typename Base::State;
    static constexpr int stresses_ = Material::stresses;
    // Stored per point: its stresses, or its measures at the end of a linearized step.
    static constexpr bool measures_ = Material::keeps_measures;
    static constexpr int kept_ = measures_ ? 2 : stresses_;

  public:
    TetrahedraTerm(const Solid& solid, const std::vector<std::array<Index, Element::nodes>>& element_nodes,
                   Index body, const ChunkLoop& chunks, const SystemMatrix& matrix, const Nodes& nodes,
                   Registry& registry)
        : Base(solid, element_nodes, body, chunks, matrix, registry),
          n_nodes_(nodes.n_nodes()),
          stress_(measures_ ? 0 : solid.n_elements(), points * kept_),
          extrapolated_(solid.n_elements(), points * kept_) {}

    int strains_per_element() const override { return ViscousStrain::size * points; }

    void evaluate(const double* q, const Controls&, Residual& out) override {
        state_.assign(q, q + 3 * n_nodes_);
        if (this->history_.shift) viscous_.resize(this->elements(), points);
        // All calls are inlined: passing packs between functions through memory takes a third of the time.
        loop_.scatter_packs([&](Index pack) __attribute__((flatten)) {
            const State state(*this, pack, q);
            Pack3 g[N], force[N];
            for (int p = 0; p < points; ++p) {
                Pack s[stresses_];
                state.at[p].stress(constants_[pack].at, state.of(p).pressure, s);
                if constexpr (!measures_) std::copy_n(s, kept_, stress_.at(pack) + p * kept_);
                Pack33 piola = state.at[p].piola(constants_[pack].at, s);
                if (this->history_.shift) {
                    Pack* viscous = viscous_.own.at(pack) + 6 * p;
                    viscous_stress(pack, p, state.f[p], viscous);
                    piola += multiply(state.f[p], Green::matrix(viscous));
                }
                add_pull(pack, p, rest_[pack].volume[p] * piola, g, force);
            }
            loop_.scatter(pack, force, out);
        });
    }

    void assemble(const Chunk& chunk, const double* q, const Controls&, bool extrapolated_stress,
                  SystemMatrix& out) const override {
        const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
        const Strains& viscous = extrapolated_stress ? viscous_.extrapolated : viscous_.own;
        ElementLoop<N>::over_packs(chunk, [&](Index pack) __attribute__((flatten)) {
            State state(*this, pack, q);
            if constexpr (measures_)
                if (extrapolated_stress) state.take_measures(*this, pack, extrapolated_.at(pack));
            const Pack* c = constants_[pack].at;
            Pack3 g[N], volume_gradient[N];
            Pack33 h[N * (N + 1) / 2];
            for (int p = 0; p < points; ++p) {
                Element::gradients(rest_[pack].gradients[p], p, g);
                const Pack volume = rest_[pack].volume[p];
                const Pack bulk = mean ? Pack(0.0) : state.of(p).bulk;
                Pack s[stresses_];
                if constexpr (measures_)
                    state.at[p].stress(c, state.of(p).pressure, s);
                else
                    std::copy_n(stress.at(pack) + p * kept_, kept_, s);
                const typename Material::template Tangent<N> tangent(state.at[p], c, s, bulk, volume, g);
                add_blocks<N>(tangent, p == 0, h);
                if constexpr (mean)
                    for (int k = 1; k < N; ++k) {
                        const Pack3 share = volume * state.at[p].volume_gradient(g[k]);
                        volume_gradient[k] = p == 0 ? share : volume_gradient[k] + share;
                    }
                if (this->history_.shift) {
                    const RestModuli moduli = viscous_moduli(pack);
                    const Pack more(this->history_.scale - 1.0);
                    add_blocks<N>(QuadraticTangent<N>(state.f[p], viscous.at(pack) + 6 * p,
                                                      more * moduli.lambda, more * moduli.mu, volume, g),
                                  false, h);
                }
            }
            if constexpr (mean) {
                const Pack bulk = state.volumetric[0].bulk / rest_[pack].total();
                for (int k = 1; k < N; ++k)
                    for (int l = 1; l <= k; ++l)
                        h[lower_index(k, l)] += outer(bulk * volume_gradient[k], volume_gradient[l]);
            }
            complete_blocks<N>(h);
            loop_.scatter(pack, h, out);
        });
    }

    void extrapolate(const double* step) override {
        loop_.each_pack([&](Index pack) {
            const State state(*this, pack, state_.data());
            Pack3 p_nodes[N];
            loop_.gather(pack, step, p_nodes);
            Pack33 along[points];
            Pack mean_rate(0.0);
            for (int p = 0; p < points; ++p) {
                along[p] = gradient_of(pack, p, p_nodes);
                if constexpr (mean) mean_rate += rest_[pack].volume[p] * state.at[p].volume_rate(along[p]);
            }
            if constexpr (mean) mean_rate = mean_rate / rest_[pack].total();
            for (int p = 0; p < points; ++p) {
                Pack* kept = extrapolated_.at(pack) + p * kept_;
                if constexpr (measures_) {
                    state.at[p].measures_after(along[p], kept);
                } else {
                    const Pack rate = mean ? mean_rate : state.at[p].volume_rate(along[p]);
                    state.at[p].stress_rate(constants_[pack].at, along[p], state.of(p).bulk * rate, kept);
                    for (int i = 0; i < kept_; ++i) kept[i] += stress_.at(pack)[p * kept_ + i];
                }
                if (!this->history_.shift) continue;
                Pack strain[6], more[6];
                ViscousStrain::rate(state.f[p], along[p], strain);
                for (Pack& entry : strain) entry *= Pack(this->history_.scale - 1.0);
                ViscousStrain::stress(viscous_moduli(pack), strain, more);
                for (int i = 0; i < 6; ++i)
                    viscous_.extrapolated.at(pack)[6 * p + i] = viscous_.own.at(pack)[6 * p + i] + more[i];
            }
        });
    }

    void vjp(const double* q, const Controls&, const double* lambda, Gradient& out) override {
        struct Constants {
            double by[n_constants];
        };
        std::vector<Constants> of_elements(this->elements());
        loop_.each_pack([&](Index pack) {
            const State state(*this, pack, q);
            const Pack* c = constants_[pack].at;
            Pack3 adjoint[N];
            loop_.gather(pack, lambda, adjoint);
            Pack by[n_constants], share[n_constants], rate(0.0);
            for (Pack& entry : by) entry = Pack(0.0);
            const auto add = [&](const Pack& factor) {
                for (int k = 0; k < n_constants; ++k) by[k] += factor * share[k];
            };
            for (int p = 0; p < points; ++p) {
                const Pack volume = rest_[pack].volume[p];
                const Pack33 along = gradient_of(pack, p, adjoint);
                state.at[p].work_by_constants(c, along, share);
                add(volume);
                rate += volume * state.at[p].volume_rate(along);
                if constexpr (!mean) {
                    Material::pressure_by_constants(c, state.at[p].volume_measure(), share);
                    add(rate);
                    rate = Pack(0.0);
                }
                if (this->history_.shift) add_viscous_vjp(pack, p, state.f[p], along, by);
            }
            if constexpr (mean) {
                Material::pressure_by_constants(c, state.mean_measure, share);
                add(rate);
            }
            for (int lane = 0; lane < loop_.lanes_in(pack); ++lane)
                for (int k = 0; k < n_constants; ++k)
                    of_elements[loop_.element(pack, lane)].by[k] = by[k][lane];
        });
        for (Index t = 0; t < this->elements(); ++t) this->moduli_.add_vjp(t, of_elements[t].by, out);
    }

    Strains strains(const double* q) override {
        Strains out(this->elements(), 6 * points);
        loop_.each_pack([&](Index pack) {
            Pack3 x[N];
            loop_.gather(pack, q, x);
            for (int p = 0; p < points; ++p) ViscousStrain::at(gradient_of(pack, p, x), out.at(pack) + 6 * p);
        });
        return out;
    }

    Strains strain_rates(const double* step) override {
        Strains out(this->elements(), 6 * points);
        loop_.each_pack([&](Index pack) {
            Pack3 x[N], d[N];
            loop_.gather(pack, state_.data(), x);
            loop_.gather(pack, step, d);
            for (int p = 0; p < points; ++p)
                ViscousStrain::rate(gradient_of(pack, p, x), gradient_of(pack, p, d), out.at(pack) + 6 * p);
        });
        return out;
    }

    Strains stresses(const Strains& strains) const override {
        Strains out(this->elements(), 6 * points);
        loop_.each_pack([&](Index pack) {
            for (int p = 0; p < points; ++p) {
                Pack* s = out.at(pack) + 6 * p;
                ViscousStrain::stress(viscous_moduli(pack), strains.at(pack) + 6 * p, s);
                for (int i = 0; i < 6; ++i) s[i] *= rest_[pack].volume[p];
            }
        });
        return out;
    }

    void add_forces(const Strains& stresses, Residual& out) override {
        loop_.scatter_packs([&](Index pack) {
            Pack3 x[N], g[N], force[N];
            loop_.gather(pack, state_.data(), x);
            for (int p = 0; p < points; ++p)
                add_pull(pack, p, multiply(gradient_of(pack, p, x), Green::matrix(stresses.at(pack) + 6 * p)),
                         g, force);
            loop_.scatter(pack, force, out);
        });
    }

    std::size_t bytes() const override {
        return this->bytes_of_elements() + bytes_of(stress_.packs) + bytes_of(extrapolated_.packs) +
               bytes_of(state_) + bytes_of(viscous_.own.packs) + bytes_of(viscous_.extrapolated.packs);
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

    RestModuli viscous_moduli(Index pack) const {
        RestModuli moduli = Material::rest_moduli(constants_[pack].at);
        if constexpr (mean) moduli.lambda = Pack(-2.0 / 3.0) * moduli.mu;
        return moduli;
    }

    // Computes (scale - 1) d - shift at a point.
    void beyond_elastic(Index pack, int p, const Pack33& f, Pack d[6]) const {
        ViscousStrain::at(f, d);
        const Pack* shift = this->history_.shift->at(pack) + 6 * p;
        for (int i = 0; i < 6; ++i) d[i] = Pack(this->history_.scale - 1.0) * d[i] - shift[i];
    }

    void viscous_stress(Index pack, int p, const Pack33& f, Pack s[6]) const {
        Pack d[6];
        beyond_elastic(pack, p, f, d);
        ViscousStrain::stress(viscous_moduli(pack), d, s);
    }

    void add_viscous_vjp(Index pack, int p, const Pack33& f, const Pack33& along,
                         Pack by[n_constants]) const {
        Pack d[6], rate[6];
        beyond_elastic(pack, p, f, d);
        ViscousStrain::rate(f, along, rate);
        RestModuli moduli = ViscousStrain::work_by_moduli(d, rate);
        moduli.lambda *= rest_[pack].volume[p];
        moduli.mu *= rest_[pack].volume[p];
        if constexpr (mean) {
            moduli.mu += Pack(-2.0 / 3.0) * moduli.lambda;
            moduli.lambda = Pack(0.0);
        }
        Material::rest_moduli_vjp(constants_[pack].at, moduli, by);
    }

    const Index n_nodes_;
    Strains stress_, extrapolated_;
    ViscousStresses viscous_;
    std::vector<double> state_;  // positions of the last evaluated state
};

/// Creates the term of a solid with linear or quadratic elements of a material.
template <class Material, class Moduli>
std::unique_ptr<SolidTerm> make_tetrahedra_term(bool mean_volume, const Solid& solid, Index body,
                                                const ChunkLoop& chunks, const SystemMatrix& matrix,
                                                const Nodes& nodes, Registry& registry) {
    const auto make = [&]<class Term>(const auto& element_nodes, Term*) -> std::unique_ptr<SolidTerm> {
        return std::make_unique<Term>(solid, element_nodes, body, chunks, matrix, nodes, registry);
    };
    if (!solid.quadratic())
        return make(solid.linear_nodes,
                    static_cast<TetrahedraTerm<LinearTetrahedron, Material, Moduli, false>*>(nullptr));
    if (mean_volume)
        return make(solid.quadratic_nodes,
                    static_cast<TetrahedraTerm<QuadraticTetrahedron, Material, Moduli, true>*>(nullptr));
    return make(solid.quadratic_nodes,
                static_cast<TetrahedraTerm<QuadraticTetrahedron, Material, Moduli, false>*>(nullptr));
}

}  // namespace magshell
