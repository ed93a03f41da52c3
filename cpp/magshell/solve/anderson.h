// Anderson's acceleration of a fixed-point iteration x <- G(x): of the last few rounds, the affine combination of their ends
// whose moves f = G(x) - x cancel best. It needs no energy, and bears kinks.       [Anderson 1965; Peng et al. 2018]
#pragma once

#include <Eigen/QR>
#include <deque>

#include "magshell/core/types.h"

namespace magshell {

class Anderson {
  public:
    explicit Anderson(int most) : most_(most) {}

    /// Where to go on from, given where a round ended and how far it moved.
    VectorXd next(const VectorXd& end, const VectorXd& move) {
        constexpr double worse = 2.0;
        if (most_ == 0) return end;
        if (last_move_.size() > 0) {
            if (move.norm() > worse * last_move_.norm())
                changes_.clear();
            else
                changes_.push_back({end - last_end_, move - last_move_});
            if (static_cast<int>(changes_.size()) > most_) changes_.pop_front();
        }
        last_end_ = end;
        last_move_ = move;
        if (changes_.empty()) return end;
        const Eigen::Index count = static_cast<Eigen::Index>(changes_.size());
        Eigen::MatrixXd moves(move.size(), count);
        for (Eigen::Index k = 0; k < count; ++k) moves.col(k) = changes_[k].move;
        const VectorXd shares = moves.colPivHouseholderQr().solve(move);
        VectorXd mixed = end;
        for (Eigen::Index k = 0; k < count; ++k) mixed -= shares[k] * changes_[k].end;
        return mixed;
    }

  private:
    struct Change {
        VectorXd end, move;
    };
    int most_;
    std::deque<Change> changes_;
    VectorXd last_end_, last_move_;
};

}  // namespace magshell
