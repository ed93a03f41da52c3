#include "magshell/linalg/ordering/quotient_graph.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace magshell {
namespace {

// Mixes the bits of a number (the finalizer of splitmix64): each bit of the result depends on all bits of the
// argument.
std::uint64_t mixed(std::uint64_t value) {
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

// Returns a fingerprint of each unknown's neighbourhood, itself included: equal sums of hashes stand for equal
// neighbours.
std::vector<std::uint64_t> fingerprints(const SparsePattern& pattern) {
    std::vector<std::uint64_t> own(pattern.size), sum(pattern.size, 0);
    for (Index j = 0; j < pattern.size; ++j) own[j] = mixed(static_cast<std::uint64_t>(j) + 1);
    for (Index j = 0; j < pattern.size; ++j) {
        std::uint64_t below = own[j];
        for (Index k = pattern.column_starts[j] + 1; k < pattern.column_starts[j + 1]; ++k) {
            below += own[pattern.rows[k]];
            sum[pattern.rows[k]] += own[j];
        }
        sum[j] += below;
    }
    return sum;
}

// Returns true if the pattern is exactly that of the quotient: every entry has one there, and their numbers
// agree.
bool stands_for(const Quotient& quotient, const std::vector<Index>& node, const SparsePattern& pattern) {
    const SparsePattern& nodes = quotient.pattern;
    std::vector<Index> last(nodes.size, -1);  // the last node in whose column this one is
    std::size_t pairs = 0;
    for (Index b = 0; b < nodes.size; ++b) {
        const std::size_t own = quotient.members(b).size();
        pairs += own * (own + 1) / 2;
        last[b] = b;
        for (Index k = nodes.column_starts[b] + 1; k < nodes.column_starts[b + 1]; ++k) {
            last[nodes.rows[k]] = b;
            pairs += own * quotient.members(nodes.rows[k]).size();
        }
        for (const Index j : quotient.members(b)) {
            for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
                const Index a = node[pattern.rows[k]];
                if (last[a] == b) continue;
                // needed if members of two nodes are numbered alternately
                const auto column = nodes.rows.begin();
                if (a > b || !std::binary_search(column + nodes.column_starts[a],
                                                 column + nodes.column_starts[a + 1], b))
                    return false;
            }
        }
    }
    return pairs == pattern.rows.size();
}

Quotient each_by_itself(const SparsePattern& pattern) {
    Quotient result{pattern, std::vector<Index>(pattern.size + 1), std::vector<Index>(pattern.size)};
    std::iota(result.starts.begin(), result.starts.end(), 0);
    std::iota(result.unknowns.begin(), result.unknowns.end(), 0);
    return result;
}

}  // namespace

Quotient quotient_graph(const SparsePattern& pattern) {
    const std::vector<std::uint64_t> fingerprint = fingerprints(pattern);
    Quotient result;
    std::vector<Index> node(pattern.size, -1);
    std::vector<Index> first_member;
    for (Index j = 0; j < pattern.size; ++j) {
        if (node[j] != -1) continue;
        const Index label = static_cast<Index>(first_member.size());
        first_member.push_back(j);
        result.starts.push_back(static_cast<Index>(result.unknowns.size()));
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index i = pattern.rows[k];
            if (fingerprint[i] != fingerprint[j]) continue;
            node[i] = label;
            result.unknowns.push_back(i);
        }
    }
    result.starts.push_back(static_cast<Index>(result.unknowns.size()));
    result.pattern.size = static_cast<Index>(first_member.size());
    result.pattern.column_starts.push_back(0);
    for (const Index j : first_member) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index i = pattern.rows[k];
            if (first_member[node[i]] == i) result.pattern.rows.push_back(node[i]);
        }
        result.pattern.column_starts.push_back(static_cast<Index>(result.pattern.rows.size()));
    }
    // Two different neighbourhoods may have equal sums by chance.
    return stands_for(result, node, pattern) ? result : each_by_itself(pattern);
}

}  // namespace magshell
