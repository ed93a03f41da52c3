#include "magshell/assembly/element_coloring.h"

#include <algorithm>

#include "magshell/core/parallel.h"
#include "magshell/core/simd_double.h"

namespace magshell {
namespace {

// Returns the number of elements per block of a body, a multiple of the SIMD width. The longest block of a shell, 512 faces, has about 600 kB of
// Hessian, slots and element data. A smaller body gets shorter blocks, so that there are several of each colour. A four-node tetrahedron
// takes a quarter of the memory of a face, and its blocks share more nodes with each other, so they are longer if there are enough elements.
Index part_length(const Body& of) {
    // Elements per block (shortest, longest, longest_of_four), and blocks per body (element_blocks, blocks_of_four); "four": of four-node
    // tetrahedra. Only speed depends on them. See test_any_number_of_threads_gives_the_same_bits_on_a_large_sheet.
    constexpr Index shortest = 128, longest = 512, element_blocks = 8, longest_of_four = 2048,
                    blocks_of_four = 32;
#if defined(__SANITIZE_THREAD__)  // several blocks in the small scenes of tests
    return SimdDouble::width;
#endif
    const Index elements = of.n_elements();
    Index length = std::clamp(elements / element_blocks, shortest, longest);
    if (elements > 0 && of.n_dihedrals() == 0 && of.nodes_of(0).size() == 4)
        length = std::max(length, std::min(elements / blocks_of_four, longest_of_four));
    return length / SimdDouble::width * SimdDouble::width;
}

// The neighbours of each block: the blocks that share a node with it.
class Neighbours {
  public:
    Neighbours(Index nodes, const std::vector<const Body*>& bodies,
               const std::vector<ElementBlock>& element_blocks)
        : element_blocks_at_(nodes), nodes_in_(element_blocks.size()) {
        for (const ElementBlock& element_block : element_blocks)
            for (Index element = element_block.first; element < element_block.last; ++element)
                for (const Index node : bodies[element_block.body]->nodes_of(element))
                    if (node >= 0 && (element_blocks_at_[node].empty() ||
                                      element_blocks_at_[node].back() != element_block.number)) {
                        element_blocks_at_[node].push_back(element_block.number);
                        nodes_in_[element_block.number].push_back(node);
                    }
    }

    /// Returns the colour of each block: the smallest number that no neighbour coloured before it has (greedy colouring).
    std::vector<Index> colours() const {
        std::vector<Index> colour_of(nodes_in_.size(), -1);
        Index count = 0;
        for (std::size_t p = 0; p < nodes_in_.size(); ++p) {
            std::vector<bool> taken(count + 1, false);
            each_beside(p, [&](Index other) {
                if (colour_of[other] >= 0) taken[colour_of[other]] = true;
            });
            colour_of[p] = static_cast<Index>(std::find(taken.begin(), taken.end(), false) - taken.begin());
            count = std::max(count, colour_of[p] + 1);
        }
        return colour_of;
    }

    /// Returns the blocks by number, except that the neighbours of a block with earlier colours come before it.
    std::vector<Index> order(const std::vector<Index>& colour_of) const {
        std::vector<Index> order;
        std::vector<bool> taken(nodes_in_.size(), false);
        const auto take = [&](const auto& self,
                              Index p) -> void {  // the recursion is as deep as there are colours
            if (taken[p]) return;
            taken[p] = true;
            each_beside(p, [&](Index other) {
                if (colour_of[other] < colour_of[p]) self(self, other);
            });
            order.push_back(p);
        };
        for (Index p = 0; p < static_cast<Index>(nodes_in_.size()); ++p) take(take, p);
        return order;
    }

  private:
    template <class Visit>
    void each_beside(std::size_t p, const Visit& visit) const {
        for (const Index node : nodes_in_[p])
            for (const Index other : element_blocks_at_[node]) visit(other);
    }

    // The blocks of each node, and the nodes of each block.
    std::vector<std::vector<Index>> element_blocks_at_, nodes_in_;
};

// Cuts an order of blocks into segments, and each segment into one round per colour. A segment is so long that several threads have blocks of
// each colour to process.
std::vector<std::vector<Index>> rounds(const std::vector<Index>& order, const std::vector<Index>& colour_of) {
    constexpr std::size_t stretch =
        32;  // blocks per segment; see test_results_have_the_same_bits_with_more_threads_than_processors
    std::vector<std::vector<Index>> rounds;
    for (std::size_t first = 0; first < order.size(); first += stretch) {
        std::vector<std::vector<Index>> of_colours;
        for (std::size_t k = first; k < std::min(first + stretch, order.size()); ++k) {
            const std::size_t colour = colour_of[order[k]];
            if (colour >= of_colours.size()) of_colours.resize(colour + 1);
            of_colours[colour].push_back(order[k]);
        }
        for (std::vector<Index>& element_blocks : of_colours)
            if (!element_blocks.empty()) rounds.push_back(std::move(element_blocks));
    }
    return rounds;
}

}  // namespace

ElementColoring::ElementColoring(Index nodes, const std::vector<const Body*>& bodies)
    : loops_(bodies.size()) {
    for (Index body = 0; body < static_cast<Index>(bodies.size()); ++body) cut(*bodies[body], body);
    set_order(nodes, bodies);
}

void ElementColoring::cut(const Body& of, Index body) {
    Index dihedral = 0;
    const Index elements = of.n_elements(), dihedrals = of.n_dihedrals(), length = part_length(of);
    for (Index first = 0; first < elements; first += length) {
        const Index last = std::min(elements, first + length);
        const Index first_dihedral = dihedral;
        while (dihedral < dihedrals && of.element_of_dihedral(dihedral) < last) ++dihedral;
        const ElementBlock element_block{
            static_cast<Index>(all_.element_blocks_.size()), body, first, last, first_dihedral, dihedral};
        all_.element_blocks_.push_back(element_block);
        loops_[body].element_blocks_.push_back(element_block);
    }
}

void ElementColoring::set_order(Index nodes, const std::vector<const Body*>& bodies) {
    const Neighbours neighbours(nodes, bodies, all_.element_blocks_);
    const std::vector<Index> colour_of = neighbours.colours();
    all_.order_ = neighbours.order(colour_of);
    all_.rounds_ = rounds(all_.order_, colour_of);
    for (ColoredLoop& loop : loops_) {
        if (loop.element_blocks_.empty()) continue;
        const Index first = loop.element_blocks_.front().number, last = loop.element_blocks_.back().number;
        const auto own = [&](const std::vector<Index>& of_all) {
            std::vector<Index> of_body;
            for (const Index p : of_all)
                if (first <= p && p <= last) of_body.push_back(p - first);
            return of_body;
        };
        loop.order_ = own(all_.order_);
        for (const std::vector<Index>& round : all_.rounds_)
            if (std::vector<Index> of_body = own(round); !of_body.empty())
                loop.rounds_.push_back(std::move(of_body));
    }
}

std::vector<ElementBlock> ElementColoring::in_order() const {
    std::vector<ElementBlock> order;
    for (const Index p : all_.order_) order.push_back(all_.element_blocks_[p]);
    return order;
}

std::size_t ElementColoring::bytes() const {
    return 2 * all_.element_blocks_.size() * (sizeof(ElementBlock) + 2 * sizeof(Index));
}

void ColoredLoop::scatter(const std::function<void(const ElementBlock&)>& body) const {
    if (num_threads() == 1) {
        for (const Index p : order_) body(element_blocks_[p]);
        return;
    }
    for (const std::vector<Index>& element_blocks : rounds_)
        parallel_for(static_cast<int>(element_blocks.size()),
                     [&](int k) { body(element_blocks_[element_blocks[k]]); });
}

void ColoredLoop::each(const std::function<void(const ElementBlock&)>& body) const {
    parallel_for(static_cast<int>(element_blocks_.size()), [&](int p) { body(element_blocks_[p]); });
}

double ColoredLoop::sum(const std::function<double(const ElementBlock&)>& body) const {
    std::vector<double> shares(element_blocks_.size());
    parallel_for(static_cast<int>(element_blocks_.size()),
                 [&](int p) { shares[p] = body(element_blocks_[p]); });
    double total = 0.0;
    for (const double share : shares) total += share;
    return total;
}

}  // namespace magshell
