// RepeatedOperator: a symmetric operator that becomes a dense matrix once it has been multiplied with as often as it has columns. Single
// products and those for the matrix then take the same time, so all together take at most twice that of the better choice made in advance.
// The matrix sums in another order: later products differ from earlier ones by round-off.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "magshell/core/types.h"

namespace magshell {

class RepeatedOperator {
  public:
    using Product = std::function<VectorXd(const VectorXd&)>;

    RepeatedOperator() = default;
    /// is_constant: whether the product stays the same; otherwise it never becomes a matrix.
    RepeatedOperator(Product product, Index size, bool is_constant = true) {
        if (product) state_ = std::make_shared<State>(std::move(product), size, is_constant);
    }

    explicit operator bool() const { return state_ != nullptr; }
    bool is_dense() const {
        const std::lock_guard lock(state_->changes);
        return state_->matrix.size() > 0;
    }
    /// Returns the memory of the matrix, if there is one.
    std::size_t bytes() const {
        if (!state_) return 0;
        const std::lock_guard lock(state_->changes);
        return static_cast<std::size_t>(state_->matrix.size()) * sizeof(double);
    }
    VectorXd operator()(const VectorXd& x) const {
        // Columns up to which a matrix is made; it takes 72 MB then. See test_many_products_make_an_operator_dense.
        constexpr Index most_dense = 3000;
        State& state = *state_;
        {
            const std::lock_guard lock(state.changes);
            if (state.is_constant && state.size <= most_dense && state.products++ == state.size) state.fill();
        }
        if (is_dense()) return state.matrix * x;
        return state.product(x);
    }

  private:
    struct State {
        Product product;
        Index size, products = 0;
        bool is_constant;
        Eigen::MatrixXd matrix{};  // empty until it is worth its time
        mutable std::mutex changes{};

        State(Product given, Index columns, bool constant)
            : product(std::move(given)), size(columns), is_constant(constant) {}

        void fill() {
            Eigen::MatrixXd columns(size, size);
            for (Index k = 0; k < size; ++k) columns.col(k) = product(VectorXd::Unit(size, k));
            matrix = 0.5 * (columns + columns.transpose());
        }
    };

    std::shared_ptr<State> state_;
};

}  // namespace magshell
