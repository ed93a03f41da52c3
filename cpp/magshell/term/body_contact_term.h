// Contact of bodies with each other and with themselves: pairs of a vertex and a face, and of two edges, that are nearer
// than they may be.
//
//   E = sum A k m b(d - d_min)                                             [J]    contact/pair_energy.h
//
// Where a pair would have no gap there is no energy: the term refuses such states, and steps that lead through them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/body/nodes.h"
#include "magshell/contact/pair_energy.h"
#include "magshell/term/near_pairs.h"
#include "magshell/term/term.h"

namespace magshell {

class BodyContactTerm final : public Term {
  public:
    /// A pair that touches.
    struct Touch {
        Index contact;
        ContactPair pair;
        PairEnergy at;
        double far;  // [m] its largest coordinate
    };
    /// Numbers of friction.
    struct Rubbing {
        double kinetic, fixed, sticking_speed;  // fixed: of what sticks
    };

    /// The layer gets what of its Hessian there is.
    BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                    const std::vector<BodyContactInput>& contacts, ContactLayer& layer, Registry& registry);

    /// The pairs that touch at the last evaluated state, in the order of contacts.
    const std::vector<Touch>& touching() const { return touching_; }
    std::vector<Touch> touches(const double* q) const;
    const Rubbing& rubbing(Index contact) const { return rubbing_[contact]; }

    /// Which faces are in the way of a step p from q.
    std::string blocking(const double* q, const double* p) const;
    /// Whether what is negative of the Hessians of pairs is left out from now on.
    void be_cautious(bool cautious) { cautious_ = cautious; }
    /// Adds the magnitude of forces that cancel inside those between pairs at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;
    /// By the law of a contact: adds what PairEnergy::vjp says.
    void add_vjp(Index contact, const PairEnergy::ByLaw& by, VectorXd& by_values) const;
    const Slot& friction_slot(Index contact, int which) const { return slots_[contact].friction[which]; }

    std::string_view name() const override { return "body contact"; }
    bool set_values(const Values& values) override;
    bool refuses_states() const override { return true; }
    double largest_share(const double* q, const double* p) const override;
    std::string refusal(const double* q) const override;
    bool driven() const override { return false; }
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void prepare_assembly(const double* q, const Controls& controls) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::size_t bytes() const override;

    static PairPlaces places(const ContactPair& pair, const double* all) {
        PairPlaces x;
        for (int k = 0; k < nodes_of(pair.kind); ++k)
            x[k] = Eigen::Map<const Vec3>(all + 3 * pair.nodes[k]);
        return x;
    }

  private:
    struct Slots {
        Slot stiffness, reach, distance, smoothing;
        Slot friction[3];  // kinetic, of what sticks, sticking speed
    };

    /// What no state goes below: a penalty lets more in than its minimal distance.
    double least(Index contact) const { return laws_[contact].penalty ? 0.0 : laws_[contact].thickness; }

    std::vector<Slots> slots_;
    std::vector<BarrierLaw> laws_;
    std::vector<Rubbing> rubbing_;
    NearPairs near_;
    ContactLayer& layer_;
    std::vector<Touch> touching_;
    bool cautious_ = false;
};

}  // namespace magshell
