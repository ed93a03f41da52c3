// ContactCandidates: the pairs that may be in contact, found by a broad phase and kept until nodes have moved
// far.
//
// The search includes a margin beyond the activation distance. As long as no two nodes can have approached by
// more than the margin, no other pair can be in contact. The pairs that are found active, and their order, do
// not depend on when the search was done.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/contact/broad_phase.h"
#include "magshell/terms/contact/body_contact_input.h"

namespace magshell {

class ContactCandidates {
  public:
    /// Stores a reference to the nodes, which must outlive the object.
    ContactCandidates(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                      const std::vector<BodyContactInput>& contacts);

    /// Sets the distance [m] within which pairs of each contact are active.
    void set_distances(const std::vector<double>& distances);

    /// near() returns all active pairs at q, and others. may_be_active() tells whether pair k of them can be
    /// active.
    const std::vector<NearPair>& near(const double* q);
    bool may_be_active(std::size_t k) const { return slack_[k] <= possible_approach_; }
    /// The pairs that can become active if nodes approach by a given fraction of the margin.
    /// covers_all_candidates() tells whether every pair that can be active now was among them.
    struct CandidateMargin {
        std::int64_t searches = -1;
        double nearer = 0.0;  // [m]
    };
    CandidateMargin margin_ahead(double share) const {
        return {searches_, possible_approach_ + share * margin_};
    }
    bool may_be_active(std::size_t k, const CandidateMargin& margin) const {
        return slack_[k] <= margin.nearer;
    }
    bool covers_all_candidates(const CandidateMargin& margin) const {
        return margin.searches == searches_ && possible_approach_ <= margin.nearer;
    }
    void forget() { searched_at_.resize(0); }
    /// Returns the positions [m] of all nodes of contact surfaces.
    VectorXd contact_positions(const double* q) const;
    /// Returns the pairs of points and triangles, and of edges, that may come closer than the given distances
    /// (one per contact, [m]) while nodes move straight from q to q + share p.
    std::vector<NearPair> near_along_path(const double* q, const double* p, double share,
                                          const std::vector<double>& distances);
    /// Returns the largest displacement [m] of a contact node under p.
    double largest_displacement(const double* p) const;
    /// Returns the closest neighbouring parts of a contact; see BroadPhase.
    const std::optional<BroadPhase::NeighbourPair>& nearest_neighbours(Index contact) const {
        return phase_.nearest_neighbours(contact);
    }
    /// Returns the pairs of faces that intersect at q.
    std::vector<NearPair> crossings(const double* q) { return phase_.crossings(q); }

    /// Returns the largest displacement [m] of a node that one step may have. Longer paths would meet nearly
    /// every other face.
    double max_displacement() const { return max_displacement_; }
    const BroadPhase& phase() const { return phase_; }
    /// Names the two faces of a pair.
    std::string describe(const NearPair& pair) const;
    std::size_t bytes() const;

  private:
    struct Name {
        std::string body;
        std::vector<Index> faces;
    };

    const Nodes& nodes_;
    std::vector<BodyContactInput> contacts_;
    std::vector<Name> names_;  // of each surface
    BroadPhase phase_;
    double margin_, max_displacement_;  // [m]
    std::vector<double> distances_;     // activation distances including the margin [m]
    std::vector<Index> contact_nodes_;
    std::vector<NearPair> near_;
    VectorXd searched_at_;            // positions at the last search; empty before the first one
    std::vector<double> slack_;       // how much farther apart each pair was than its activation distance [m]
    double round_off_ = 0.0;          // round-off of distances [m]
    std::int64_t searches_ = 0;       // number of searches
    double possible_approach_ = 0.0;  // bound of the approach of any pair since the last search [m]
};

}  // namespace magshell
