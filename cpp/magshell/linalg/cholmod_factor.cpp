// CholmodFactor: CHOLMOD's supernodal L L^T.
//
// This is the only file that calls CHOLMOD's Supernodal module, which is under the GPL (version 2 or later);
// magshell's own sources are under the MIT licence, and the default backend does not need that module.
#include <string>

#include "magshell/core/errors.h"
#include "magshell/linalg/backends.h"

#ifndef MAGSHELL_HAS_CHOLMOD

namespace magshell {

std::unique_ptr<Factor> make_cholmod_factor(std::shared_ptr<const SparsePattern>, Ordering) {
    throw InvalidInput("magshell was built without CHOLMOD; use the backend \"supernodal\" or \"eigen\"");
}

}  // namespace magshell

#else

#include "magshell/linalg/cholmod_workspace.h"
#include "magshell/linalg/pattern_checks.h"
#include "magshell/linalg/single_threaded.h"

namespace magshell {
namespace {

class CholmodFactor : public Factor {
  public:
    CholmodFactor(std::shared_ptr<const SparsePattern> pattern, Ordering ordering)
        : Factor(std::move(pattern)), ordering_(ordering) {
        if (pattern_->size == 0) return;
        const SingleThreaded guard;
        common_->supernodal = CHOLMOD_SUPERNODAL;
        common_->nmethods = 0;
        for (const Ordering each : {Ordering::amd, Ordering::metis}) {
            const bool one_is_wanted = ordering == Ordering::amd || ordering == Ordering::metis;
            if (one_is_wanted && ordering != each) continue;
            common_->method[common_->nmethods++].ordering =
                each == Ordering::amd ? CHOLMOD_AMD : CHOLMOD_METIS;
        }
        cholmod_sparse view = cholmod_view(*pattern_, nullptr);
        factor_ = cholmod_analyze(&view, common_);
        if (!factor_) throw InvalidInput("CHOLMOD could not analyse the matrix" + status());
        nonzeros_ = static_cast<std::int64_t>(common_->lnz);
        flops_ = common_->fl;
    }

    ~CholmodFactor() override { cholmod_free_factor(&factor_, common_); }

    FactorReport factorize() override {
        check_finite(values_);
        report_ = {};
        report_.succeeded = true;
        if (pattern_->size == 0) return report_;
        const SingleThreaded guard;
        cholmod_sparse view = cholmod_view(*pattern_, values_.data());
        const bool done = cholmod_factorize(&view, factor_, common_);
        if (!done || common_->status != CHOLMOD_OK) {
            report_.succeeded = false;
            report_.reason = common_->status == CHOLMOD_NOT_POSDEF
                                 ? "the matrix is not positive definite; the backend \"supernodal\" "
                                   "factorizes such matrices, too"
                                 : "CHOLMOD could not factorize the matrix" + status();
        }
        return report_;
    }

    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override {
        check_solvable(report_, pattern_->size, rhs);
        if (rhs.size() == 0) return;
        const SingleThreaded guard;
        CholmodCommon common;  // a workspace of this call, so that threads may solve at the same time
        cholmod_dense view{};
        view.nrow = rhs.rows();
        view.ncol = rhs.cols();
        view.d = rhs.outerStride();
        view.nzmax = view.d * view.ncol;
        view.x = rhs.data();
        view.xtype = CHOLMOD_REAL;
        view.dtype = CHOLMOD_DOUBLE;
        cholmod_dense* solution = cholmod_solve(CHOLMOD_A, factor_, &view, common);
        if (!solution) throw std::bad_alloc();
        rhs = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(solution->x), rhs.rows(),
                                                rhs.cols());
        cholmod_free_dense(&solution, common);
    }

    std::unique_ptr<Factor> sibling() const override {
        return std::make_unique<CholmodFactor>(pattern_, ordering_);
    }
    std::string name() const override { return "cholmod"; }
    std::int64_t nonzeros() const override { return nonzeros_; }
    double flops() const override { return flops_; }
    std::size_t bytes() const override {
        const std::size_t factor =
            factor_ ? factor_->xsize * sizeof(double) + factor_->ssize * sizeof(int) : 0;
        return factor + values_.size() * sizeof(double) + pattern_->rows.size() * sizeof(Index);
    }

  private:
    std::string status() const { return " (its status is " + std::to_string(common_.status()) + ")"; }

    Ordering ordering_;
    CholmodCommon common_;
    ::cholmod_factor* factor_ = nullptr;
    std::int64_t nonzeros_ = 0;
    double flops_ = 0.0;
};

}  // namespace

std::unique_ptr<Factor> make_cholmod_factor(std::shared_ptr<const SparsePattern> pattern, Ordering ordering) {
    return std::make_unique<CholmodFactor>(std::move(pattern), ordering);
}

}  // namespace magshell

#endif
