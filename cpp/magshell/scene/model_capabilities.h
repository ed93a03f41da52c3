// ModelCapabilities: what a solver must know of a scene besides its energy and derivatives: the answers of all terms together, and how
// far a step may go.
#pragma once

#include <string>

#include "magshell/assembly/low_rank.h"
#include "magshell/dofs/dof_map.h"
#include "magshell/scene/scene_terms.h"

namespace magshell {

class ModelCapabilities : public Capabilities {
  public:
    /// The references must outlive it. low_rank: that part of the Hessian assembled last.
    ModelCapabilities(const SceneTerms& terms, const DofMap& dof_map, const Nodes& nodes,
                      const LowRank& low_rank)
        : Capabilities(terms.capabilities),
          terms_(terms),
          dof_map_(dof_map),
          nodes_(nodes),
          low_rank_(low_rank) {}
    ModelCapabilities(const ModelCapabilities&) = delete;
    ModelCapabilities& operator=(const ModelCapabilities&) = delete;

    /// Returns true if the Hessian assembled last with project_psd equals the exact one.
    bool projection_is_exact() const { return !has_psd_projection && low_rank_.empty(); }
    /// Returns true if the stresses that a load step extrapolates are a good start of the next one. Those of solids are not, as their
    /// elements are stretched at first, nor those of liquids, whose pressure belongs to another volume at first.
    bool has_stress_prediction() const { return !has_transient_stresses && low_rank_.empty(); }

    /// max_step_length() returns the largest step length along p up to which there is an energy, at most 1; invalid_state_reason() describes
    /// what is wrong with a state, or returns an empty string.
    double max_step_length(const VectorXd& q, const VectorXd& p) const;
    std::string invalid_state_reason(const VectorXd& q) const;
    /// Returns the step length that may be taken along p: a safety factor times the distance to the first inverted element or the first
    /// collision of bodies, at most 1; 0 if there is none.
    double admissible_step_length(const VectorXd& q, const VectorXd& p) const;
    /// Returns a sentence that names the elements or faces that limit a step.
    std::string describe_blocked_step(const VectorXd& q, const VectorXd& p) const;
    /// Returns why a step from q to `end` is impossible: a point would cross an obstacle. Empty if no point does.
    std::string crossing_reason(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& end,
                                const LoadParameters& load_parameters_at_end) const;

  private:
    const SceneTerms& terms_;
    const DofMap& dof_map_;
    const Nodes& nodes_;
    const LowRank& low_rank_;
};

}  // namespace magshell
