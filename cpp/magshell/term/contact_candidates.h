// Pairs that may touch, kept as long as no node has moved far.
//
// They are found within a margin beyond what matters. Until two nodes could have come so much nearer, nothing else can
// touch. Which pairs touch, and in which order, does not depend on when they were looked for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/contact/broad_phase.h"
#include "magshell/term/body_contact_input.h"

namespace magshell {

class ContactCandidates {
  public:
    /// The nodes have to outlive it.
    ContactCandidates(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                      const std::vector<BodyContactInput>& contacts);

    /// Of each contact, the distance within which pairs touch [m].
    void set_distances(const std::vector<double>& distances);

    /// Those that touch at q, and others; and whether one of them, by its number, may be among those that touch.
    const std::vector<NearPair>& near(const double* q);
    bool may_be_active(std::size_t k) const { return slack_[k] <= possible_approach_; }
    /// What may touch if nodes come nearer by a share of the margin; and whether nothing else may now.
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
    /// Where all that can touch is.
    VectorXd contact_positions(const double* q) const;
    /// Points and triangles, and edges, that may come nearer than that, one a contact, on straight ways from q to
    /// q + share p.
    std::vector<NearPair> near_along_path(const double* q, const double* p, double share,
                                          const std::vector<double>& distances);
    /// The longest of what p moves them by [m].
    double largest_displacement(const double* p) const;
    /// See BroadPhase.
    const std::optional<BroadPhase::NeighbourPair>& nearest_neighbours(Index contact) const {
        return phase_.nearest_neighbours(contact);
    }
    /// Faces that pass through each other at q.
    std::vector<NearPair> crossings(const double* q) { return phase_.crossings(q); }

    /// As far as a step lets a node go at most [m]: what may be met on a longer way would be nearly everything.
    double max_displacement() const { return max_displacement_; }
    /// The faces of a pair, in words.
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
    std::vector<double> distances_;     // with the margin
    std::vector<Index> contact_nodes_;
    std::vector<NearPair> near_;
    VectorXd searched_at_;            // where those nodes were; empty: nowhere
    std::vector<double> slack_;       // by how much a pair was farther apart then than where it touches [m]
    double round_off_ = 0.0;          // of distances [m]
    std::int64_t searches_ = 0;       // how often it looked
    double possible_approach_ = 0.0;  // by how much any pair may have come nearer since [m]
};

}  // namespace magshell
