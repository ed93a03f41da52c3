// ContactRest: the gradient of contact forces by rest positions, through the areas of vertices and edges, the lengths at which edges count
// as parallel, and the rooms of neighbouring parts (contact/broad_phase.h).
#pragma once

#include <array>
#include <vector>

#include "magshell/contact/broad_phase.h"

namespace magshell {

class ContactRest {
  public:
    /// rest: reference positions of all nodes [m]. The arguments must outlive the object.
    ContactRest(const BroadPhase& phase, const std::vector<Vec3>& rest);

    /// Takes the gradient with respect to the numbers of a pair.
    void add(const NearPair& near, const PairEnergy::ByPair& by);
    /// Adds the gradient with respect to the nodes, three numbers each.
    void add_to(VectorXd& out) const;

  private:
    void add_edges(const NearPair& near, const PairEnergy::ByPair& by);
    void add_room(const NearPair& near, double by_room);

    const BroadPhase& phase_;
    const std::vector<Vec3>& rest_;
    // Gradients with respect to the areas of the vertices and edges of each surface.
    std::vector<std::vector<double>> by_vertex_areas_, by_edge_areas_;
    VectorXd by_nodes_;
};

}  // namespace magshell
