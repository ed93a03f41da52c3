// Contact of bodies with each other and with themselves: pairs of a vertex and a face, and of two edges, that are nearer
// than they may be.
//
//   E = sum A k m b(d - d_min)                                             [J]    contact/pair_energy.h
//
// Where a pair has no gap there is no energy: the term refuses such states, and steps that lead through them.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/contact/pair_energy.h"
#include "magshell/force/friction.h"
#include "magshell/term/contact_candidates.h"
#include "magshell/term/pair_stiffness.h"
#include "magshell/term/term.h"

namespace magshell {

class BodyContactTerm final : public Term {
  public:
    /// A pair that touches.
    struct Touch {
        NearPair near;
        PairEnergy at;
        double far;  // [m] its largest coordinate
    };

    /// What of its Hessian there is goes to the layer.
    BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                    const std::vector<BodyContactInput>& contacts, ContactLayer& layer, Registry& registry);

    /// The pairs that touch at q, always in the same order; and those at the last evaluated state.
    std::vector<Touch> touches(const double* q) const { return aside_ ? std::vector<Touch>() : *found(q); }
    const std::vector<Touch>& touching() const { return *touching_; }
    /// Whether any pair touches at q.
    bool acts(const double* q) const { return !found(q)->empty(); }
    /// How the energy at q changes along p [J]; how it does at the last evaluated state, and how fast that changes, but
    /// for what turns.
    double slope(const double* q, const double* p) const { return slope(*found(q), p); }
    double slope(const double* p) const { return slope(touching(), p); }
    double curvature(const double* p) const;
    /// Of the pairs that touch at the last evaluated state, along their normals.
    void add_stiffness(std::vector<PairStiffness>& out) const;
    /// From now on, until told otherwise, nothing touches: somebody else keeps bodies apart. Steps pass none all the same.
    void stand_aside(bool aside) const { aside_ = aside; }
    /// A pair as hard contact has it: kept at the distance at which the law begins.
    struct HardPair {
        NearPair near;
        Proximity at;
        double gap;  // [m] that is left to that
        double friction;
    };
    /// Those near each other at q: points and triangles, and edges that cross.
    std::vector<HardPair> hard_pairs(const double* q) const;
    /// Throws InvalidInput where what sticks has another coefficient of friction than what slides.
    void require_one_coefficient() const;
    /// The faces that push each other hardest at the last evaluated state, in words; empty: none touch.
    std::string hardest() const;
    /// The neighbours along a surface that a contact has nearest each other at rest: [m], and in words; endlessly far and
    /// without a name where their mesh puts none nearer than they push each other.
    std::pair<double, std::string> nearest_neighbours(Index contact) const;
    std::size_t n_contacts() const { return laws_.size(); }
    const FrictionLaw& friction(const Touch& touch) const { return friction_[touch.near.contact]; }

    /// Which faces are in the way of a step p from q, in words.
    std::string blocking(const double* q, const double* p) const;
    /// Whether what is negative of the Hessians of pairs is left out from now on.
    void set_psd_projection(bool cautious) override { cautious_ = cautious; }
    /// Adds the magnitude of forces that cancel inside those between pairs at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;
    /// Adds the gradient by the numbers of a pair's contact.
    void add_vjp(const Touch& touch, const PairEnergy::ByLaw& by, const FrictionLaw& by_friction,
                 VectorXd& by_values) const;
    ContactLayer& layer() const { return layer_; }
    /// From now on as if no state had been looked at: a solve has the same bits whatever came before it.
    void forget() const {
        candidates_.forget();
        found_.clear();
        layer_.add_couplings({});
        layer_.use(false);
        untouched_ = 0;
        assembled_ = often;
        ahead_ = least_ahead;
        soon_ = {};
    }
    /// The layer couples these as well, whether they still touch or not, until others take their place.
    void keep_coupled(const std::vector<Touch>& touches);

    std::string_view name() const override { return "body contact"; }
    bool set_values(const Values& values) override;
    bool has_infeasible_states() const override { return true; }
    double max_step_length(const double* q, const double* p) const override;
    std::string invalid_state_reason(const double* q) const override;
    bool driven() const override { return false; }
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void prepare_assembly(const double* q, const Controls& controls) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::size_t bytes() const override;

  private:
    struct Slots {
        Slot stiffness, reach, distance, smoothing, kinetic, fixed, sticking_speed;
    };

    using Touches = std::shared_ptr<const std::vector<Touch>>;

    /// Where touching nodes are, and what touches there.
    struct FoundAt {
        VectorXd at;
        std::shared_ptr<std::vector<Touch>> touches;
    };

    static constexpr double least_ahead = 0.25;
    static constexpr int often = 32;  // assemblies, after which it is coupled anew

    /// Those that touch at q; asked again at the same place, the same.
    Touches found(const double* q) const;
    static double slope(const std::vector<Touch>& touches, const double* p);
    /// Calls found(pair, share) where a pair lets a step go less far than all before it; nullptr: its length does.
    template <class Found>
    void each_limit(const double* q, const double* p, const Found& found) const;

    std::vector<Slots> slots_;
    std::vector<BarrierLaw> laws_;
    std::vector<FrictionLaw> friction_;
    std::vector<double> least_;  // of each contact, what no distance goes below [m]
    mutable ContactCandidates candidates_;
    ContactLayer& layer_;
    mutable std::deque<FoundAt> found_;              // the last few
    mutable std::vector<std::vector<Touch>> parts_;  // room for what tasks find
    Touches touching_ = std::make_shared<const std::vector<Touch>>();
    std::vector<ContactLayer::Group> kept_;
    bool cautious_ = false;
    mutable bool aside_ = false;
    // Assemblies since anything touched, and since the layer couples what it couples; what it has coupled ahead of its
    // touching then, as a share of the margin: little, as it fills the factorization, but more where pairs change fast.
    mutable int untouched_ = 0, assembled_ = often;
    mutable double ahead_ = least_ahead;
    mutable ContactCandidates::Soon soon_;  // what it coupled then
};

}  // namespace magshell
