#include "magshell/assembly/system_matrix.h"

#include <algorithm>
#include <limits>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// Returns the stencils that contain each dof of a kind.
template <std::size_t N>
std::vector<std::vector<Index>> holders(Index count, const std::vector<Stencil>& stencils,
                                        std::array<Index, N> Stencil::* members) {
    std::vector<std::vector<Index>> of(count);
    for (Index s = 0; s < static_cast<Index>(stencils.size()); ++s)
        for (const Index member : stencils[s].*members)
            if (member >= 0) of[member].push_back(s);
    return of;
}

// Returns the cliques that contain each dof of a kind.
std::vector<std::vector<Index>> holders(Index count, const std::vector<Clique>& cliques,
                                        std::span<const Index> Clique::* members) {
    std::vector<std::vector<Index>> of(count);
    for (Index c = 0; c < static_cast<Index>(cliques.size()); ++c)
        for (const Index member : cliques[c].*members)
            if (member >= 0) of[member].push_back(c);
    return of;
}

// Collects the distinct numbers of a round. A new round needs no clearing, because each number is marked with its last round.
class Marks {
  public:
    explicit Marks(Index count) : last_(count, -1) {}
    void collect(Index round, Index number, std::vector<Index>& into) {
        if (last_[number] == round) return;
        last_[number] = round;
        into.push_back(number);
    }

  private:
    std::vector<Index> last_;
};

}  // namespace

SystemMatrix::SystemMatrix(Index nodes, Index rotations, const std::vector<Stencil>& stencils,
                           const std::vector<Clique>& cliques)
    : nodes_(nodes), rotations_(rotations) {
    const std::vector<std::vector<Index>> node_holders = holders(nodes, stencils, &Stencil::nodes);
    const std::vector<std::vector<Index>> rotation_holders =
        holders(rotations, stencils, &Stencil::rotations);
    const std::vector<std::vector<Index>> node_cliques = holders(nodes, cliques, &Clique::nodes);
    const std::vector<std::vector<Index>> scalar_cliques = holders(rotations, cliques, &Clique::scalars);

    column_starts_.reserve(size() + 1);
    column_starts_.push_back(0);
    Marks node_marks(nodes), rotation_marks(rotations), own_marks(rotations);
    std::vector<Index> beside, beside_rotations;
    const auto close_column = [&] {
        if (rows_.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max() / 2))
            throw InvalidInput("the mesh is too large: its Hessian has more than 2^30 entries");
        column_starts_.push_back(static_cast<Index>(rows_.size()));
    };
    // The rows of each column, from the diagonal on: those of the nodes, then of the edge rotations, with which node j is coupled.
    for (Index j = 0; j < nodes; ++j) {
        beside.clear();
        beside_rotations.clear();
        for (const Index s : node_holders[j]) {
            for (const Index i : stencils[s].nodes)
                if (i > j) node_marks.collect(j, i, beside);
            for (const Index r : stencils[s].rotations)
                if (r >= 0) rotation_marks.collect(j, r, beside_rotations);
        }
        for (const Index c : node_cliques[j]) {
            for (const Index i : cliques[c].nodes)
                if (i > j) node_marks.collect(j, i, beside);
            for (const Index r : cliques[c].scalars)
                if (r >= 0) rotation_marks.collect(j, r, beside_rotations);
        }
        std::sort(beside.begin(), beside.end());
        std::sort(beside_rotations.begin(), beside_rotations.end());
        for (Index column = 0; column < 3; ++column) {
            for (Index c = column; c < 3; ++c) rows_.push_back(3 * j + c);
            for (const Index i : beside)
                for (Index c = 0; c < 3; ++c) rows_.push_back(3 * i + c);
            for (const Index r : beside_rotations) rows_.push_back(3 * nodes + r);
            close_column();
        }
    }
    for (Index j = 0; j < rotations; ++j) {
        beside_rotations.clear();
        for (const Index s : rotation_holders[j])
            for (const Index r : stencils[s].rotations)
                if (r >= j) own_marks.collect(j, r, beside_rotations);
        for (const Index c : scalar_cliques[j])
            for (const Index r : cliques[c].scalars)
                if (r >= j) own_marks.collect(j, r, beside_rotations);
        std::sort(beside_rotations.begin(), beside_rotations.end());
        for (const Index r : beside_rotations) rows_.push_back(3 * nodes + r);
        close_column();
    }
    values_.assign(rows_.size(), 0.0);
}

Index SystemMatrix::find(Index column, Index row) const {
    const auto first = rows_.begin() + column_starts_[column],
               last = rows_.begin() + column_starts_[column + 1];
    return static_cast<Index>(std::lower_bound(first, last, row) - rows_.begin());
}

SystemMatrix::Slot SystemMatrix::node_slot(Index i, Index j) const {
    return i >= j ? 2 * find(3 * j, 3 * i) : 2 * find(3 * i, 3 * j) + 1;
}

Index SystemMatrix::rotation_slot(Index rotation, Index node) const {
    return find(3 * node, 3 * nodes_ + rotation);
}

Index SystemMatrix::rotations_slot(Index a, Index b) const {
    return find(3 * nodes_ + std::min(a, b), 3 * nodes_ + std::max(a, b));
}

bool SystemMatrix::couples(Index i, Index j) const {
    const Index column = 3 * std::min(i, j), row = 3 * std::max(i, j), at = find(column, row);
    return at < column_starts_[column + 1] && rows_[at] == row;
}

void SystemMatrix::add_diagonal(VectorXd& out) const {
    for (Index k = 0; k < size(); ++k)
        if (column_starts_[k] < column_starts_[k + 1]) out[k] += values_[column_starts_[k]];
}

void SystemMatrix::add_product(const double* x, double* y) const {
    // Processes the three columns of a node at once, because their rows are the same. a, b, c: these columns, shifted so that index k means
    // the same row in all three; their diagonal entries are a[0], b[1] and c[2].
    for (Index j = 0; j < 3 * nodes_; j += 3) {
        const Index start = column_starts_[j], length = column_starts_[j + 1] - start;
        const double *a = values_.data() + start, *b = a + length - 1, *c = b + length - 2;
        const double x0 = x[j], x1 = x[j + 1], x2 = x[j + 2];
        double sum0 = a[0] * x0 + a[1] * x1 + a[2] * x2, sum1 = a[1] * x0 + b[1] * x1 + b[2] * x2,
               sum2 = a[2] * x0 + b[2] * x1 + c[2] * x2;
        const Index* rows = rows_.data() + start;
        for (Index k = 3; k < length; ++k) {
            const double xi = x[rows[k]];
            y[rows[k]] += a[k] * x0 + b[k] * x1 + c[k] * x2;
            sum0 += a[k] * xi;
            sum1 += b[k] * xi;
            sum2 += c[k] * xi;
        }
        y[j] += sum0;
        y[j + 1] += sum1;
        y[j + 2] += sum2;
    }
    for (Index j = 3 * nodes_; j < size(); ++j) {
        double sum = 0.0;
        for (Index k = column_starts_[j]; k < column_starts_[j + 1]; ++k) {
            const Index i = rows_[k];
            y[i] += values_[k] * x[j];
            if (i != j) sum += values_[k] * x[i];
        }
        y[j] += sum;
    }
}

std::size_t SystemMatrix::bytes() const {
    return rows_.size() * (sizeof(Index) + sizeof(double)) + column_starts_.size() * sizeof(Index);
}

}  // namespace magshell
