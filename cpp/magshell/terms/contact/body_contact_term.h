// BodyContactTerm: contact of bodies with each other and with themselves. It acts between pairs of a vertex and
// a face, and of two edges, that are closer than the activation distance.
//
//   E = sum A k m b(d - d_min)                                             [J]    contact/pair_energy.h
//
// A pair without a gap has no energy. The term therefore rejects such states, and limits steps that would lead
// through them.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/contact/contact_rest.h"
#include "magshell/contact/slip_map.h"
#include "magshell/force/friction.h"
#include "magshell/terms/contact/contact_candidates.h"
#include "magshell/terms/contact/pair_stiffness.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/term.h"

namespace magshell {

class BodyContactTerm final : public Term, public RestShapeTerm {
  public:
    /// A pair closer than its activation distance.
    struct ActiveContact {
        NearPair near;
        PairEnergy at;
        double far;        // [m] its largest coordinate
        SlipStencil slip;  // without nodes if the contact has no friction
    };

    /// Creates the term. Its Hessian is added to `layer`, not to the system matrix.
    BodyContactTerm(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                    const std::vector<BodyContactInput>& contacts, ContactLayer& layer, Registry& registry);

    /// Returns the active pairs at q, always in the same order; evaluated_contacts() returns those at the last
    /// evaluated state.
    std::vector<ActiveContact> active_contacts(const double* q) const {
        return switched_off_ ? std::vector<ActiveContact>() : *found(q);
    }
    const std::vector<ActiveContact>& evaluated_contacts() const { return *evaluated_contacts_; }
    /// Returns true if any pair is active at q.
    bool acts(const double* q) const { return !found(q)->empty(); }
    /// Returns the directional derivative of the energy along p [J]: at q, or at the last evaluated state.
    /// curvature() returns its second derivative at the last evaluated state, without the contribution of
    /// rotating normals.
    double slope(const double* q, const double* p) const { return slope(*found(q), p); }
    double slope(const double* p) const { return slope(evaluated_contacts(), p); }
    double curvature(const double* p) const;
    /// Adds the stiffness along the normal of every active pair at the last evaluated state.
    void add_stiffness(std::vector<PairStiffness>& out) const;
    /// Multiplies the energy, and with it all forces, by a factor from now on; see Tableau::contact_factor().
    void set_factor(double factor);
    double factor() const { return factor_; }
    /// Switches the smooth contact law off while another method enforces contact. Steps are limited as before,
    /// so that no pair passes through each other.
    void set_switched_off(bool off) const { switched_off_ = off; }
    /// A pair as hard contact treats it: kept at the distance at which the smooth law begins.
    struct HardContactPair {
        NearPair near;
        Proximity at;
        double gap;  // [m] remaining distance until contact
        double friction;
    };
    /// Returns the pairs near each other at q that hard contact constrains: points and triangles, and edges
    /// that cross.
    std::vector<HardContactPair> hard_contact_pairs(const double* q) const;
    /// Throws InvalidInput if a contact has different static and kinetic coefficients of friction.
    void require_one_coefficient() const;
    /// Names the two faces with the largest contact force at the last evaluated state; an empty string without
    /// contact.
    std::string hardest() const;
    /// Returns the smallest reference distance [m] between neighbouring parts of a surface, with the names of
    /// the faces. The distance is infinite if the mesh has no neighbours closer than the activation distance.
    std::pair<double, std::string> nearest_neighbours(Index contact) const;
    std::size_t n_contacts() const { return laws_.size(); }
    const FrictionLaw& friction(const ActiveContact& active) const { return friction_[active.near.contact]; }
    /// Returns the nodes whose velocities are the slip of a pair.
    SlipStencil slip_stencil(const NearPair& near, const double* q) const;

    /// Names the faces that limit a step p from q.
    std::string blocking(const double* q, const double* p) const;
    /// Replaces the Hessian of each pair by a positive semidefinite one, or uses the exact one again.
    void set_psd_projection(bool project_psd) override { psd_projection_ = project_psd; }
    /// Adds the magnitude [N] of the forces that cancel within pair forces at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;
    /// Adds the gradient with respect to the parameters of a pair's contact. factor: the factor of the stiffness that `active` was
    /// computed with.
    void add_vjp(const ActiveContact& active, const PairEnergy::ByLaw& by, const FrictionLaw& by_friction,
                 double factor, VectorXd& by_values) const;
    ContactLayer& layer() const { return layer_; }
    /// Resets all stored searches and couplings, so that the bits of a solve do not depend on earlier ones.
    void forget() const {
        candidates_.forget();
        found_.clear();
        layer_.add_couplings({});
        layer_.use(false);
        assemblies_without_contact_ = 0;
        assemblies_since_coupling_ = often;
        ahead_ = least_ahead;
        coupled_margin_ = {};
    }
    /// Makes the contact layer couple these pairs as well, whether they are still active or not, until the next
    /// call.
    void set_extra_couplings(const std::vector<ActiveContact>& active_contacts);
    bool has_extra_couplings() const { return !extra_couplings_.empty(); }

    std::string_view name() const override { return "body contact"; }
    bool set_values(const Values& values) override;
    Capabilities capabilities() const override {
        return {.has_infeasible_states = true, .has_barrier = true, .has_psd_projection = true};
    }
    double max_step_length(const double* q, const double* p) const override;
    std::string invalid_state_reason(const double* q) const override;
    bool depends_on_loads() const override { return false; }
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                      VectorXd& out) override;
    /// Returns what adds up the gradient with respect to rest positions from that of each pair.
    ContactRest rest_gradient() const { return {candidates_.phase(), nodes_.rest}; }
    std::size_t bytes() const override;

  private:
    struct ParameterSlices {
        ParameterSlice stiffness, activation_distance, min_distance, smoothing, kinetic, fixed,
            sticking_speed;
    };

    using ActiveContacts = std::shared_ptr<const std::vector<ActiveContact>>;

    /// The positions of all contact nodes, and the active pairs there.
    struct FoundAt {
        VectorXd at;
        std::shared_ptr<std::vector<ActiveContact>> active_contacts;
    };

    static constexpr double least_ahead = 0.25;
    static constexpr int often = 32;  // [-] assemblies after which the layer is coupled anew

    /// Returns the active pairs at q; repeated calls with the same positions return the stored result.
    ActiveContacts found(const double* q) const;
    static double slope(const std::vector<ActiveContact>& active_contacts, const double* p);
    /// Calls found(pair, fraction) for each pair that limits the step more than all pairs before it; pair is
    /// nullptr where the length of the step is the limit.
    template <class Found>
    void each_limit(const double* q, const double* p, const Found& found) const;

    const Nodes& nodes_;
    std::vector<ParameterSlices> slices_;
    std::vector<BarrierLaw> laws_;  // with the stiffness times factor_
    double factor_ = 1.0;
    std::vector<double> stiffness_;  // [Pa] of each contact, without the factor
    std::vector<FrictionLaw> friction_;
    std::vector<double> least_;  // minimum separation of each contact [m]
    std::vector<bool> has_friction_;
    mutable ContactCandidates candidates_;
    ContactLayer& layer_;
    mutable std::deque<FoundAt> found_;                      // the last few results
    mutable std::vector<std::vector<ActiveContact>> parts_;  // per-task buffers
    ActiveContacts evaluated_contacts_ = std::make_shared<const std::vector<ActiveContact>>();
    std::vector<ContactLayer::Group> extra_couplings_;
    bool psd_projection_ = false;
    mutable bool switched_off_ = false;
    // The number of assemblies since a pair was active, and since the layer's couplings were chosen; and how
    // far ahead pairs are coupled before they become active, as a fraction of the search margin. A small
    // fraction keeps the factor sparse; it grows where pairs change quickly.
    mutable int assemblies_without_contact_ = 0, assemblies_since_coupling_ = often;
    mutable double ahead_ = least_ahead;
    mutable ContactCandidates::CandidateMargin coupled_margin_;  // margin of the pairs that the layer couples
};

}  // namespace magshell
