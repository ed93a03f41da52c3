// FaceEnergy: energies of single linear triangles that depend on the corners and on some parameters per face
// only. A kernel is all that has to be written for a new one; see docs/adding/energy.md.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
#include "magshell/core/parameters.h"
#include "magshell/terms/term.h"

namespace magshell {

/// Creates the terms of one kind of energy, whichever kernel it uses.
class FaceEnergy {
  public:
    virtual ~FaceEnergy() = default;

    /// Creates the term of a surface. Its parameters are registered under the name `owner`.
    virtual std::unique_ptr<Term> term(const std::string& owner, Index body, const Surface& surface,
                                       const FaceLoop& loop, Registry& registry) const = 0;
};

/// The term of a kernel. A kernel provides `name`; `inputs`, its parameters per face; a constructor from the
/// corners x[3]; energy(in); gradient(in, g); hessian(in, h) as lower blocks; and rate_by_inputs(in, rate,
/// out), the derivatives of rate . gradient with respect to each parameter. The load factor scales the energy.
template <class Kernel>
class FaceEnergyTerm final : public Term {
  public:
    static constexpr int n_inputs = std::size(Kernel::inputs);

    FaceEnergyTerm(const std::string& owner, Index body, const Surface& surface, const FaceLoop& loop,
                   Registry& registry)
        : body_(body),
          loop_(loop),
          factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)),
          inputs_(loop.groups()) {
        for (const FaceInput& input : Kernel::inputs)
            slices_.push_back(
                registry.values.add(owner, input.name, input.unit, surface.n_faces(), 1, &surface.faces));
    }

    std::string_view name() const override { return Kernel::name; }
    Index body() const override { return body_; }

    bool set_values(const Values& values) override {
        bool changed = false;
        for (int k = 0; k < n_inputs; ++k) {
            changed |= values.changed(slices_[k]);
            for (Index group = 0; group < loop_.groups(); ++group)
                for (int lane = 0; lane < SimdDouble::width; ++lane)
                    inputs_[group].of[k].set(lane, values.number(slices_[k], loop_.face(group, lane)));
        }
        return changed;
    }

    double energy(const double* q, const LoadParameters& load_parameters) const override {
        return load_parameters[factor_.first] *
               loop_.sum([&](Index group) { return kernel(group, q).energy(inputs_[group].of); });
    }

    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override {
        const SimdDouble factor(load_parameters[factor_.first]);
        loop_.scatter_groups([&](Index group) {
            SimdVec3 g[3];
            kernel(group, q).gradient(inputs_[group].of, g);
            for (SimdVec3& of_corner : g) of_corner = factor * of_corner;
            loop_.scatter(group, g, out);
        });
    }

    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override {
        const SimdDouble factor(load_parameters[factor_.first]);
        FaceLoop::over_groups(element_block, [&](Index group) {
            SimdMat3 h[6];
            kernel(group, q).hessian(inputs_[group].of, h);
            for (SimdMat3& block : h) block = factor * block;
            loop_.scatter(group, h, out);
        });
    }

    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override {
        const double factor = load_parameters[factor_.first];
        for (Index group = 0; group < loop_.groups(); ++group) {
            SimdVec3 rate[3], g[3];
            loop_.gather(group, lambda, rate);
            const Kernel faces = kernel(group, q);
            SimdDouble by_input[n_inputs];
            faces.rate_by_inputs(inputs_[group].of, rate, by_input);
            faces.gradient(inputs_[group].of, g);
            const SimdDouble along = dot(rate[0], g[0]) + dot(rate[1], g[1]) + dot(rate[2], g[2]);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                for (int k = 0; k < n_inputs; ++k)
                    out.values[slices_[k].at(loop_.face(group, lane))] += factor * by_input[k][lane];
                out.load_parameters[factor_.first] += along[lane];
            }
        }
    }

    std::size_t bytes() const override { return bytes_of(inputs_); }

  private:
    struct Inputs {
        SimdDouble of[n_inputs];
    };

    Kernel kernel(Index group, const double* q) const {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        return Kernel(x);
    }

    Index body_;
    const FaceLoop& loop_;
    ParameterSlice factor_;
    std::vector<ParameterSlice> slices_;
    std::vector<Inputs> inputs_;
};

template <class Kernel>
class FaceEnergyOf final : public FaceEnergy {
  public:
    std::unique_ptr<Term> term(const std::string& owner, Index body, const Surface& surface,
                               const FaceLoop& loop, Registry& registry) const override {
        return std::make_unique<FaceEnergyTerm<Kernel>>(owner, body, surface, loop, registry);
    }
};

}  // namespace magshell
