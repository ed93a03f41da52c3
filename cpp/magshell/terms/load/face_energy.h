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
/// out), the derivatives of rate . gradient by each parameter. The load factor scales the energy.
template <class Kernel>
class FaceEnergyTerm final : public Term {
  public:
    static constexpr int n_inputs = std::size(Kernel::inputs);

    FaceEnergyTerm(const std::string& owner, Index body, const Surface& surface, const FaceLoop& loop,
                   Registry& registry)
        : body_(body),
          loop_(loop),
          factor_(registry.controls.add("scene", "load_factor", "1", 1, 1)),
          inputs_(loop.packs()) {
        for (const FaceInput& input : Kernel::inputs)
            slots_.push_back(
                registry.values.add(owner, input.name, input.unit, surface.n_faces(), 1, &surface.faces));
    }

    std::string_view name() const override { return Kernel::name; }
    Index body() const override { return body_; }

    bool set_values(const Values& values) override {
        bool changed = false;
        for (int k = 0; k < n_inputs; ++k) {
            changed |= values.changed(slots_[k]);
            for (Index pack = 0; pack < loop_.packs(); ++pack)
                for (int lane = 0; lane < Pack::width; ++lane)
                    inputs_[pack].of[k].set(lane, values.number(slots_[k], loop_.face(pack, lane)));
        }
        return changed;
    }

    double energy(const double* q, const Controls& controls) const override {
        return controls[factor_.first] *
               loop_.sum([&](Index pack) { return kernel(pack, q).energy(inputs_[pack].of); });
    }

    void evaluate(const double* q, const Controls& controls, Residual& out) override {
        const Pack factor(controls[factor_.first]);
        loop_.scatter_packs([&](Index pack) {
            Pack3 g[3];
            kernel(pack, q).gradient(inputs_[pack].of, g);
            for (Pack3& of_corner : g) of_corner = factor * of_corner;
            loop_.scatter(pack, g, out);
        });
    }

    void assemble(const Chunk& chunk, const double* q, const Controls& controls, bool,
                  SystemMatrix& out) const override {
        const Pack factor(controls[factor_.first]);
        FaceLoop::over_packs(chunk, [&](Index pack) {
            Pack33 h[6];
            kernel(pack, q).hessian(inputs_[pack].of, h);
            for (Pack33& block : h) block = factor * block;
            loop_.scatter(pack, h, out);
        });
    }

    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override {
        const double factor = controls[factor_.first];
        for (Index pack = 0; pack < loop_.packs(); ++pack) {
            Pack3 rate[3], g[3];
            loop_.gather(pack, lambda, rate);
            const Kernel faces = kernel(pack, q);
            Pack by_input[n_inputs];
            faces.rate_by_inputs(inputs_[pack].of, rate, by_input);
            faces.gradient(inputs_[pack].of, g);
            const Pack along = dot(rate[0], g[0]) + dot(rate[1], g[1]) + dot(rate[2], g[2]);
            for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
                for (int k = 0; k < n_inputs; ++k)
                    out.values[slots_[k].at(loop_.face(pack, lane))] += factor * by_input[k][lane];
                out.controls[factor_.first] += along[lane];
            }
        }
    }

    std::size_t bytes() const override { return bytes_of(inputs_); }

  private:
    struct Inputs {
        Pack of[n_inputs];
    };

    Kernel kernel(Index pack, const double* q) const {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        return Kernel(x);
    }

    Index body_;
    const FaceLoop& loop_;
    Slot factor_;
    std::vector<Slot> slots_;
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
