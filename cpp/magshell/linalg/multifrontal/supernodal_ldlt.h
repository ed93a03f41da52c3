// SupernodalLdlt: magshell's own factorization: multifrontal L D L^T (Duff and Reid 1983) of a symmetric
// matrix, definite or not.
//
//     P S A S P^T = L D L^T
//
// S scales rows and columns by powers of two, so that the result does not depend on units. Pivots are 1x1 or
// 2x2 and are chosen among the 32 columns of a block, never across fronts: the pattern of L is fixed by the
// analysis, and definite and mildly indefinite matrices cost the same. A matrix that has no such pivots, as a
// saddle point may, is factorized again with delayed pivots (DelayedLdlt). A pivot that vanishes to round-off
// even then is replaced; solutions are refined, and if that does not recover a known solution the matrix is
// reported as singular.
//
// Every sum is formed in an order that depends on the pattern only, and with delayed pivots on the values: the
// bits are the same for any number of threads.
#pragma once

#include <memory>

#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/delayed_ldlt.h"
#include "magshell/linalg/multifrontal/pivot_block.h"
#include "magshell/linalg/multifrontal/work_spaces.h"

namespace magshell {

class SupernodalLdlt : public Factor {
  public:
    SupernodalLdlt(std::shared_ptr<const SparsePattern> pattern, const FactorOptions& options);

    std::unique_ptr<Factor> sibling() const override;
    FactorReport factorize() override;
    VectorXd image(const VectorXd& x) const override;
    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override;

    std::string name() const override { return "supernodal"; }
    std::int64_t nonzeros() const override { return analysis_->nonzeros; }
    double flops() const override { return analysis_->flops; }
    std::size_t bytes() const override;
    std::size_t own_bytes() const override;

  private:
    struct Analysis {
        AssemblyPlan plan;
        std::int64_t nonzeros;
        double flops;
        std::mutex mutex;
        std::weak_ptr<SharedWork> work;  // work memory of the existing factors

        std::shared_ptr<SharedWork> shared_work();
    };

    SupernodalLdlt(std::shared_ptr<const SparsePattern> pattern, std::shared_ptr<Analysis> analysis);
    static std::shared_ptr<Analysis> analysed(const SparsePattern& pattern, const FactorOptions& options);

    /// Factorizes a front. from, to: work spaces that contain the updates of its children, and that receive its
    /// own.
    PivotTally process(Index front, double* from, double* to);
    /// Factorizes with pivots inside fronts; ends early where these are not stable.
    PivotTally factorize_by_plan();
    bool is_doubtful(const PivotTally& tally) const;
    void solve_factored(Eigen::Ref<Eigen::MatrixXd> rhs) const;
    VectorXd refined_solution(const VectorXd& rhs) const;
    bool recovers_known_solution() const;

    std::shared_ptr<Analysis> analysis_;
    const AssemblyPlan& plan_ = analysis_->plan;

    // After factorize(), values_ are those of S A S.
    std::vector<double> scale_;    // S
    double largest_scaled_ = 0.0;  // largest |entry| of S A S
    slabs::Buffer factor_;
    std::shared_ptr<SharedWork> work_;
    std::vector<double> diagonal_, coupling_;  // D
    std::vector<Index> pivot_order_;           // within each front
    std::unique_ptr<DelayedLdlt> delayed_;  // replaces all of these where pivots inside fronts are not stable
};

}  // namespace magshell
