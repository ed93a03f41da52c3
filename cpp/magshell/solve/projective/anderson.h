// Anderson acceleration of a fixed-point iteration x <- G(x).                        [Anderson 1965; Peng et al. 2018]
//
// Each round is replaced by the affine combination of the last results G(x) whose residuals f = G(x) - x cancel best in the
// least-squares sense. No energy is needed, so G may be nonsmooth (contact with friction, solve/projective/coulomb_contact.h).
#pragma once

#include <deque>

#include "magshell/core/types.h"
#include "magshell/linalg/dense_decompositions.h"

namespace magshell {

class Anderson {
  public:
    /// history: largest number of previous rounds that are combined; 0 switches the acceleration off.
    explicit Anderson(int history) : most_(history) {}

    /// Returns the next iterate, given the result of a round, G(x), and its displacement, G(x) - x.
    VectorXd next(const VectorXd& end, const VectorXd& move) {
        // [-] Growth of the displacement that discards the history; see test_acceleration_changes_the_rounds_and_not_where_they_lead.
        constexpr double max_growth = 2.0;
        if (most_ == 0) return end;
        if (last_displacement_.size() > 0) {
            if (move.norm() > max_growth * last_displacement_.norm())
                changes_.clear();
            else
                changes_.push_back({end - last_end_, move - last_displacement_});
            if (static_cast<int>(changes_.size()) > most_) changes_.pop_front();
        }
        last_end_ = end;
        last_displacement_ = move;
        if (changes_.empty()) return end;
        const Eigen::Index count = static_cast<Eigen::Index>(changes_.size());
        Eigen::MatrixXd moves(move.size(), count);
        for (Eigen::Index k = 0; k < count; ++k) moves.col(k) = changes_[k].move;
        const VectorXd weights = least_squares(moves, move);
        VectorXd mixed = end;
        for (Eigen::Index k = 0; k < count; ++k) mixed -= weights[k] * changes_[k].end;
        return mixed;
    }

  private:
    struct Change {
        VectorXd end, move;
    };
    int most_;
    std::deque<Change> changes_;
    VectorXd last_end_, last_displacement_;
};

}  // namespace magshell
