#include "magshell/linalg/quotient_graph.h"

#include <algorithm>
#include <cstdint>
#include <map>

namespace magshell {
namespace {

std::uint64_t mixed(
    std::uint64_t value) {  // the finalizer of splitmix64: each bit depends on all bits of the argument
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

}  // namespace

bool Quotient::is_even() const {
    std::map<std::size_t, std::size_t> nodes_of_size;
    for (const std::vector<Index>& each : members) ++nodes_of_size[each.size()];
    std::size_t most = 0;
    for (const auto& [size, nodes] : nodes_of_size) most = std::max(most, nodes);
    return 10 * most >= 9 * members.size();
}

Quotient quotient_graph(const SparsePattern& pattern) {
    // Equal sums over the neighbours stand for equal neighbours; a coincidence would spoil the ordering's
    // quality only.
    std::vector<std::uint64_t> fingerprint(pattern.size, 0);
    for (Index j = 0; j < pattern.size; ++j) {
        const std::uint64_t own = mixed(static_cast<std::uint64_t>(j) + 1);
        fingerprint[j] += own;
        for (Index k = pattern.column_starts[j] + 1; k < pattern.column_starts[j + 1]; ++k) {
            fingerprint[j] += mixed(static_cast<std::uint64_t>(pattern.rows[k]) + 1);
            fingerprint[pattern.rows[k]] += own;
        }
    }
    Quotient result;
    std::vector<Index> node(pattern.size, -1);
    std::vector<Index> first_member;
    for (Index j = 0; j < pattern.size; ++j) {
        if (node[j] != -1) continue;
        const Index label = static_cast<Index>(result.members.size());
        result.members.emplace_back();
        first_member.push_back(j);
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index i = pattern.rows[k];
            if (fingerprint[i] != fingerprint[j]) continue;
            node[i] = label;
            result.members[label].push_back(i);
        }
    }
    result.pattern.size = static_cast<Index>(result.members.size());
    result.pattern.column_starts.push_back(0);
    for (const Index j : first_member) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index i = pattern.rows[k];
            if (first_member[node[i]] == i) result.pattern.rows.push_back(node[i]);
        }
        result.pattern.column_starts.push_back(static_cast<Index>(result.pattern.rows.size()));
    }
    return result;
}

}  // namespace magshell
