#include "magshell/linalg/ordering/ordering.h"

#include <mutex>

#include "magshell/core/errors.h"
#ifdef MAGSHELL_HAS_CHOLMOD
#include "magshell/linalg/cholmod_workspace.h"
#endif

namespace magshell {
namespace {

#ifdef MAGSHELL_HAS_CHOLMOD
// Returns nodes in the order of the first of their unknowns.
std::vector<Index> nodes_in_order(const Quotient& quotient, const std::vector<Index>& unknowns) {
    std::vector<Index> node_of(unknowns.size()), order;
    for (Index node = 0; node < quotient.pattern.size; ++node)
        for (const Index unknown : quotient.members(node)) node_of[unknown] = node;
    std::vector<char> is_in(quotient.pattern.size, false);
    order.reserve(quotient.pattern.size);
    for (const Index unknown : unknowns) {
        if (is_in[node_of[unknown]]) continue;
        is_in[node_of[unknown]] = true;
        order.push_back(node_of[unknown]);
    }
    return order;
}

std::vector<Index> metis(const SparsePattern& pattern) {
    static std::mutex one_at_a_time;  // METIS keeps the state of its random numbers in a global variable
    const std::lock_guard lock(one_at_a_time);
    CholmodCommon common;
    cholmod_sparse view = cholmod_view(pattern, nullptr);
    std::vector<Index> order(pattern.size);
    if (!cholmod_metis(&view, nullptr, 0, 0, order.data(), common))
        throw InvalidInput("METIS could not order the matrix");
    return order;
}
#endif

// Returns true if the factor's columns have about the same length, as in a band: the mean square of their
// lengths divided by the square of their mean is 1.5 in a rod and 2 to 3 in squares and cubes.
bool is_long(const AssemblyTree& tree, Index size) {
    const double nonzeros = static_cast<double>(tree.nonzeros());
    constexpr double limit = 1.75;  // [-] fixed by test_a_rod_of_tetrahedra_is_ordered_by_minimum_degree
    return tree.flops() * size < limit * nonzeros * nonzeros;
}

}  // namespace

AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, const FactorOptions& options) {
    if (pattern.size == 0) return {};
    const Quotient quotient = quotient_graph(pattern);
    const NodeGraph graph = node_graph(quotient, options.points);
    const auto by_amd = [&] {
        return assembly_tree(quotient, approximate_minimum_degree(graph, options.watch));
    };
    if (options.ordering == Ordering::amd) return by_amd();
#ifdef MAGSHELL_HAS_CHOLMOD
    if (options.ordering == Ordering::metis)
        return assembly_tree(quotient, nodes_in_order(quotient, metis(pattern)));
#endif
    AssemblyTree dissection = assembly_tree(quotient, nested_dissection(graph, options.watch));
    if (options.ordering == Ordering::dissection) return dissection;
    // Skips AMD, which takes a good part of the time of a factorization, where it cannot win. It beats nested
    // dissection where cuts are short compared with the whole, above all on narrow strips and rods, and may
    // where only the pattern is known.
    // [operations per unknown] below which AMD is tried; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr double few_operations = 5.5e4;
    // [unknowns] up to which the time of AMD is negligible; fixed by
    // test_minimum_degree_needs_as_few_operations_as_another
    constexpr Index few_unknowns = 6000;
    if (!options.points.empty() && pattern.size > few_unknowns &&
        dissection.flops() > few_operations * pattern.size && !is_long(dissection, pattern.size))
        return dissection;
    options.watch();
    AssemblyTree amd = by_amd();
    return amd.flops() < dissection.flops() ? amd : dissection;
}

}  // namespace magshell
