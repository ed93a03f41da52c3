// Limited-memory BFGS around a fixed matrix: what the last few steps said of the Hessian's inverse corrects that of the
// matrix.                                                                   [Nocedal 1980; Liu, Bouaziz, Kavan 2017]
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class Secants {
  public:
    explicit Secants(int most) : most_(most) {}

    /// Takes a step and what it did to the gradient; passes over one that shows no positive stiffness.
    void add(VectorXd step, VectorXd change) {
        constexpr double least = 1e-12;  // the cosine between the two
        if (most_ == 0) return;
        const double curvature = step.dot(change);
        if (!(curvature > least * step.norm() * change.norm())) return;
        if (static_cast<int>(pairs_.size()) == most_) pairs_.pop_front();
        pairs_.push_back({std::move(step), std::move(change), 1.0 / curvature});
    }

    void clear() { pairs_.clear(); }
    bool empty() const { return pairs_.empty(); }

    /// Replaces a gradient by the inverse Hessian's product with it; `solve` does so with the matrix.
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
        double inverse;
    };
    int most_;
    std::deque<Pair> pairs_;
};

}  // namespace magshell
