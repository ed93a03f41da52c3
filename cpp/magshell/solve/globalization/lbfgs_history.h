// Limited-memory BFGS history: corrects the inverse of a fixed matrix by the last few steps and the changes of the gradient along them
// (two-loop recursion, N&W algorithm 7.4).                             [Nocedal 1980; Liu, Bouaziz, Kavan 2017]
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "magshell/solve/step_rules.h"

namespace magshell {

class LbfgsHistory {
  public:
    /// max_pairs: largest number of stored steps; 0: nothing is stored.
    explicit LbfgsHistory(std::size_t max_pairs) : most_(max_pairs) {}

    /// Stores a step and the change of the gradient along it, unless the change shows no positive curvature.
    void add(VectorXd step, VectorXd change) {
        if (most_ == 0) return;
        const double curvature = step.dot(change);
        if (!(curvature > energy_tolerance * step.norm() * change.norm())) return;
        if (pairs_.size() == most_) pairs_.pop_front();
        pairs_.push_back({std::move(step), std::move(change), 1.0 / curvature});
    }

    void clear() { pairs_.clear(); }
    bool empty() const { return pairs_.empty(); }

    /// Replaces a gradient by the product of the approximate inverse Hessian with it; `matrix` applies the inverse of the fixed matrix.
    void solve(VectorXd& g, const std::function<void(VectorXd&)>& matrix) const {
        std::vector<double> along(pairs_.size());
        for (std::size_t k = pairs_.size(); k-- > 0;) {
            along[k] = pairs_[k].inverse * pairs_[k].step.dot(g);
            g -= along[k] * pairs_[k].change;
        }
        matrix(g);
        for (std::size_t k = 0; k < pairs_.size(); ++k)
            g += (along[k] - pairs_[k].inverse * pairs_[k].change.dot(g)) * pairs_[k].step;
    }

  private:
    struct Pair {
        VectorXd step, change;
        double inverse;  // of the product of both
    };
    std::size_t most_;
    std::deque<Pair> pairs_;
};

}  // namespace magshell
