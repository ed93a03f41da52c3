#include "magshell/scene/model_capabilities.h"

#include <algorithm>

namespace magshell {

double ModelCapabilities::max_step_length(const VectorXd& q, const VectorXd& p) const {
    double length = 1.0;
    for (const Term* term : terms_.restricting)
        length = std::min(length, term->max_step_length(q.data(), p.data()));
    return length;
}

std::string ModelCapabilities::invalid_state_reason(const VectorXd& q) const {
    for (const Term* term : terms_.restricting)
        if (std::string reason = term->invalid_state_reason(q.data()); !reason.empty()) return reason;
    return {};
}

double ModelCapabilities::admissible_step_length(const VectorXd& q, const VectorXd& p) const {
    constexpr double safety =
        0.8;  // [-] part of the distance to the first invalid state; see test_ball_falls_onto_a_sheet_and_never_through
    constexpr double shortest = 1e-12;  // [-] see test_a_body_squeezed_until_it_cannot_move
    if (!has_infeasible_states) return 1.0;
    double length = max_step_length(q, p / safety);
    if (!dof_map_.has_reduced_coordinates()) return length;
    for (; length > shortest; length *= 0.5) {  // reduced nodes move along curves
        VectorXd there = q;
        dof_map_.retract(there, length * p);
        if (max_step_length(q, there - q) >= 1.0) return length;
    }
    return 0.0;
}

std::string ModelCapabilities::describe_blocked_step(const VectorXd& q, const VectorXd& p) const {
    const double length = max_step_length(q, p);
    if (std::string reason = terms_.contacts.describe_blocking(q, p, length); !reason.empty()) return reason;
    constexpr double beyond = 1.01;  // [-] just past the limit
    return "elements block the step: " + invalid_state_reason(q + beyond * length * p);
}

std::string ModelCapabilities::crossing_reason(const VectorXd& q, const LoadParameters& load_parameters,
                                               const VectorXd& end,
                                               const LoadParameters& load_parameters_at_end) const {
    const Passage passage = terms_.contacts.first_crossing(q, load_parameters, end, load_parameters_at_end);
    return passage ? passage.describe(nodes_) + " within a step" : std::string();
}

}  // namespace magshell
