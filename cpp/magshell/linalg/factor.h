// Factor: the interface of factorizations of sparse symmetric matrices, definite or indefinite.
//
// The pattern of a scene's Hessian does not change, so the work that needs only the pattern (a fill-reducing
// ordering and the symbolic analysis) is done once, by analyze(); factorize() and solve() may then be called
// any number of times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "magshell/core/large_memory.h"
#include "magshell/core/types.h"

namespace magshell {

/// The pattern of a lower triangle by columns: the rows of column j are rows[column_starts[j]] ...
/// rows[column_starts[j + 1] - 1], sorted, the first of them j itself.
struct SparsePattern {
    Index size = 0;
    std::vector<Index> column_starts, rows;

    bool operator==(const SparsePattern&) const = default;
};

/// Returns A x from the values of the lower triangle of A.
VectorXd product(const SparsePattern& pattern, const double* values, const VectorXd& x);

enum class Backend {
    supernodal,  // magshell's own multifrontal L D L^T; definite and indefinite at the same speed
    cholmod,     // CHOLMOD's supernodal L L^T; positive definite only
    eigen,       // Eigen's simplicial L D L^T; builds with MAGSHELL_TESTING
};

enum class Ordering {
    best,        // nested dissection, or AMD where that may need fewer operations and does
    dissection,  // magshell's own nested dissection
    amd,         // Eigen's minimum degree
    metis,       // METIS's nested dissection, for comparison; only with CHOLMOD. It takes over signals
};

struct FactorOptions {
    Backend backend = Backend::supernodal;
    Ordering ordering = Ordering::best;
    std::vector<Vec3> points = {};        // position of each unknown [m], for geometric cuts; or none
    std::function<void()> watch = [] {};  // called now and then during an analysis; may throw
};

/// The outcome of a factorization.
struct FactorReport {
    bool succeeded = false;
    std::string reason;          // cause of a failure and what it means; empty on success
    Index negative_pivots = 0;   // number of negative eigenvalues (Sylvester); meaningless after a failure
    Index perturbed_pivots = 0;  // pivots that were zero to round-off and were replaced; solve() then refines
    /// max l_ik^2 |d_k| over the largest entry of the (scaled) matrix: at most 1 for a positive definite
    /// matrix; 10^p costs about p digits of a solution. 0 if a backend does not measure it.
    double pivot_growth = 0.0;
};

/// An analysed pattern, and after factorize() a factorization. One thread at a time may factorize; any number
/// may solve.
class Factor {
  public:
    explicit Factor(std::shared_ptr<const SparsePattern> pattern) : pattern_(std::move(pattern)) { forget(); }
    virtual ~Factor() = default;

    /// Returns the values of the matrix in the order of the pattern, to be written before each factorize(),
    /// which overwrites them.
    LargeVector<double>& values() {
        values_.resize(pattern_->rows.size());
        return values_;
    }

    /// Factorizes the matrix that was written. Throws InvalidInput for NaN or infinity.
    virtual FactorReport factorize() = 0;

    /// Tells whether factorize() may leave the number of negative eigenvalues open until complete_report(), where counting them takes
    /// many solves. Direct methods know it at once.
    virtual void set_count_deferred(bool /*deferred*/) {}
    /// Returns the report of the last factorize() with the number of negative eigenvalues.
    virtual FactorReport complete_report() { return report_; }

    /// Discards the factorization; its memory is kept.
    void forget() {
        report_ = {};
        report_.reason = "factorize() has not been called";
    }

    /// Returns A x with the matrix factorized last.
    virtual VectorXd image(const VectorXd& x) const { return product(*pattern_, values_.data(), x); }

    /// Replaces each column of `rhs` (size, k) by the solution. Throws InvalidInput unless the last factorize()
    /// succeeded.
    virtual void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const = 0;

    /// Does the same for one column where a residual of `tolerance` over the norm of rhs is enough; direct methods solve exactly.
    virtual void solve_approximately(VectorXd& rhs, double /*tolerance*/) const { solve(rhs); }

    /// Returns another factor for the same pattern, not factorized yet. Both share the analysis if the backend
    /// can.
    virtual std::unique_ptr<Factor> sibling() const = 0;

    virtual std::string name() const = 0;
    const std::shared_ptr<const SparsePattern>& pattern() const { return pattern_; }
    Index size() const { return pattern_->size; }
    virtual std::int64_t nonzeros() const = 0;  // entries of L, diagonal included
    virtual double flops() const = 0;           // of one factorization, additions and multiplications
    virtual std::size_t bytes() const = 0;      // of the factor, its analysis and its work space
    /// Returns the part of these that another factor of the same analysis would take.
    virtual std::size_t own_bytes() const { return bytes(); }

  protected:
    const std::shared_ptr<const SparsePattern> pattern_;
    LargeVector<double> values_;
    FactorReport report_;
};

/// Orders and analyses a pattern. Throws InvalidInput if the pattern is malformed, if the points are not finite
/// or not one per unknown, or if the backend or the ordering was not built.
std::unique_ptr<Factor> analyze(std::shared_ptr<const SparsePattern> pattern,
                                const FactorOptions& options = {});

/// Return true if this build contains the backend or the ordering.
bool is_built(Backend backend);
bool is_built(Ordering ordering);

}  // namespace magshell
