// Of SuiteSparse this file calls AMD (BSD) and METIS (Apache) through CHOLMOD's Core, Cholesky and Partition
// modules (LGPL); nothing of its Supernodal module, which is GPL.
#include "magshell/linalg/ordering.h"

#include <Eigen/OrderingMethods>
#include <mutex>

#include "magshell/linalg/quotient_graph.h"
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

// order[k] = the node to eliminate k-th.
std::vector<Index> order_nodes(const SparsePattern& pattern, Ordering ordering) {
#ifdef MAGSHELL_HAS_CHOLMOD
    static std::mutex one_at_a_time;  // METIS keeps the state of its random numbers in a global variable
    const std::lock_guard lock(one_at_a_time);
    CholmodCommon common;
    cholmod_sparse view = cholmod_view(pattern, nullptr);
    std::vector<Index> order(pattern.size);
    if (ordering == Ordering::metis && cholmod_metis(&view, nullptr, 0, 0, order.data(), common))
        return order;
    if (cholmod_amd(&view, nullptr, 0, order.data(), common)) return order;
#endif
    (void)ordering;
    return eigen_amd(pattern);
}

std::vector<Index> order_unknowns(const SparsePattern& pattern, const Quotient& quotient, Ordering ordering) {
    if (!quotient.is_even()) return order_nodes(pattern, ordering);
    std::vector<Index> order;
    order.reserve(pattern.size);
    for (const Index node : order_nodes(quotient.pattern, ordering)) {
        order.insert(order.end(), quotient.members[node].begin(), quotient.members[node].end());
    }
    return order;
}

}  // namespace

AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, Ordering ordering) {
    if (pattern.size == 0) return {};
    const Quotient quotient = quotient_graph(pattern);
    if (ordering != Ordering::best)
        return assembly_tree(pattern, order_unknowns(pattern, quotient, ordering));

    // With three unknowns a vertex METIS saves a fifth of the operations. With one an edge besides, it has to
    // order the unknowns themselves: that takes longer than many factorizations of 30,000 faces, of which it
    // saves a third, and as long as three of 130,000, of which it saves half (measured).
    constexpr double many_operations = 2.5e5;  // an unknown
    AssemblyTree amd = assembly_tree(pattern, order_unknowns(pattern, quotient, Ordering::amd));
    if (!quotient.is_even() && amd.flops() < many_operations * pattern.size) return amd;
    AssemblyTree metis = assembly_tree(pattern, order_unknowns(pattern, quotient, Ordering::metis));
    return metis.flops() < amd.flops() ? metis : amd;
}

}  // namespace magshell
