// Of SuiteSparse this file calls AMD (BSD) and METIS (Apache) through CHOLMOD's Core, Cholesky and Partition modules
// (LGPL); nothing of its Supernodal module, which is GPL.
#include "magshell/linalg/ordering.h"

#include <Eigen/OrderingMethods>
#include <mutex>

#ifdef MAGSHELL_HAS_CHOLMOD
#include "magshell/linalg/cholmod_workspace.h"
#endif

namespace magshell {
namespace {

std::vector<Index> eigen_amd(const SparsePattern& pattern) {
    const std::vector<double> values(pattern.rows.size(), 1.0);
    const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::ColMajor, Index>> lower(
        pattern.size, pattern.size, static_cast<Index>(pattern.rows.size()), pattern.column_starts.data(),
        pattern.rows.data(), values.data());
    const Eigen::SparseMatrix<double, Eigen::ColMajor, Index> matrix = lower;
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> permutation;
    Eigen::AMDOrdering<Index>()(matrix.selfadjointView<Eigen::Lower>(), permutation);
    return {permutation.indices().begin(), permutation.indices().end()};
}

}  // namespace

std::vector<Index> fill_reducing_order(const SparsePattern& pattern, Ordering ordering) {
    if (pattern.size == 0) return {};
#ifdef MAGSHELL_HAS_CHOLMOD
    static std::mutex one_at_a_time;  // METIS keeps the state of its random numbers in a global variable
    const std::lock_guard lock(one_at_a_time);
    CholmodCommon common;
    cholmod_sparse view = cholmod_view(pattern, nullptr);
    std::vector<Index> order(pattern.size);
    if (ordering == Ordering::metis && cholmod_metis(&view, nullptr, 0, 0, order.data(), common)) return order;
    if (cholmod_amd(&view, nullptr, 0, order.data(), common)) return order;
#endif
    (void)ordering;
    return eigen_amd(pattern);
}

AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, Ordering ordering) {
    if (ordering != Ordering::best) return assembly_tree(pattern, fill_reducing_order(pattern, ordering));
    AssemblyTree amd = assembly_tree(pattern, fill_reducing_order(pattern, Ordering::amd));
    AssemblyTree metis = assembly_tree(pattern, fill_reducing_order(pattern, Ordering::metis));
    return metis.flops() < amd.flops() ? metis : amd;
}

}  // namespace magshell
