#include "magshell/linalg/ordering.h"

#include <mutex>

#include "magshell/core/errors.h"
#include "magshell/linalg/approximate_degree.h"
#include "magshell/linalg/nested_dissection.h"
#ifdef MAGSHELL_HAS_CHOLMOD
#include "magshell/linalg/cholmod_workspace.h"
#endif

namespace magshell {
namespace {

#ifdef MAGSHELL_HAS_CHOLMOD
// Nodes in the order of the first of their unknowns.
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

// Whether the factor's columns are of about the same length, as in a band: the mean square of their lengths over the square
// of the mean is 1.5 in a rod, 2 to 3 in squares and cubes.
bool is_long(const AssemblyTree& tree, Index size) {
    const double nonzeros = static_cast<double>(tree.nonzeros());
    return tree.flops() * size < 1.75 * nonzeros * nonzeros;
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
    // AMD takes a good part of the time of a factorization. It does better than nested dissection where cuts are short
    // beside the whole, on narrow strips and rods above all, and may where nothing is known but the pattern.
    constexpr double few_operations = 5.5e4;  // an unknown
    constexpr Index few_unknowns = 6000;      // that AMD takes no time to speak of
    if (!options.points.empty() && pattern.size > few_unknowns &&
        dissection.flops() > few_operations * pattern.size && !is_long(dissection, pattern.size))
        return dissection;
    options.watch();
    AssemblyTree amd = by_amd();
    return amd.flops() < dissection.flops() ? amd : dissection;
}

}  // namespace magshell
