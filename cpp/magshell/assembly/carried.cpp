#include "magshell/assembly/carried.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace magshell {

using Eigen::MatrixXd;

Carried::Carried(Carriers carriers, const SystemMatrix& matrix)
    : carrier_of_(matrix.size(), -1), row_of_(matrix.size(), -1) {
    for (std::unique_ptr<Carrier>& carrier : carriers) {
        Chunk& chunk = chunks_.emplace_back();
        chunk.carrier = std::move(carrier);
        chunk.first = coordinates_;
        coordinates_ += chunk.carrier->coordinates();
        drives_ |= chunk.carrier->driven() > 0;
        placed_ |= chunk.carrier->placed();
        Index row = 0;
        for (const Index node : chunk.carrier->nodes())
            for (int c = 0; c < 3; ++c) {
                carrier_of_[3 * node + c] = static_cast<Index>(chunks_.size()) - 1;
                row_of_[3 * node + c] = row++;
            }
    }
}

void Carried::couple(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                     Index free) {
    free_ = free;
    for (Chunk& chunk : chunks_) chunk.later.clear();
    for (const SystemMatrix* matrix : matrices)
        for (Index column = 0; column < matrix->size(); ++column)
            for (Index k = matrix->column_starts()[column]; k < matrix->column_starts()[column + 1]; ++k) {
                const Index row = matrix->rows()[k], of_row = carrier_of_[row],
                            of_column = carrier_of_[column];
                if (of_row >= 0 && reduced[column] >= 0) coupled_[reduced[column]].insert(of_row);
                if (of_column >= 0 && reduced[row] >= 0) coupled_[reduced[row]].insert(of_column);
                if (of_row >= 0 && of_column >= 0 && of_row != of_column)
                    chunks_[std::min(of_row, of_column)].later.insert(std::max(of_row, of_column));
            }
}

void Carried::append_rows(Index free, std::vector<Index>& rows) const {
    const auto found = coupled_.find(free);
    if (found == coupled_.end()) return;
    for (const Index each : found->second)
        for (Index j = 0; j < chunks_[each].carrier->coordinates(); ++j)
            rows.push_back(free_ + chunks_[each].first + j);
}

void Carried::append_columns(SparsePattern& pattern) const {
    for (const Chunk& chunk : chunks_)
        for (Index j = 0; j < chunk.carrier->coordinates(); ++j) {
            for (Index i = j; i < chunk.carrier->coordinates(); ++i)
                pattern.rows.push_back(free_ + chunk.first + i);
            for (const Index other : chunk.later)
                for (Index i = 0; i < chunks_[other].carrier->coordinates(); ++i)
                    pattern.rows.push_back(free_ + chunks_[other].first + i);
            pattern.column_starts.push_back(static_cast<Index>(pattern.rows.size()));
        }
}

namespace {

Index place_in(const SparsePattern& pattern, Index column, Index row) {
    Index k = pattern.column_starts[column];
    while (pattern.rows[k] != row) ++k;
    return k;
}

// B^T B.
MatrixXd normal_of(const LinkTwists& b) {
    return b.product(VectorXd::Ones(b.rows()));
}

// The coordinates, driven ones too, of a motion of the nodes.
VectorXd all_of(const LinkTwists& b, const VectorXd& rows) {
    return normal_of(b).ldlt().solve(b.pull_back(rows));
}

}  // namespace

void Carried::find_places(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                          const SparsePattern& pattern) {
    for (Chunk& chunk : chunks_) {
        chunk.own.clear();
        chunk.beside.clear();
        chunk.places.assign(matrices.size(), {});
        for (const Index other : chunk.later) chunk.beside[other] = {};
        for (Index j = 0; j < chunk.carrier->coordinates(); ++j) {
            const Index column = free_ + chunk.first + j;
            chunk.own.push_back(place_in(pattern, column, column));
            for (const Index other : chunk.later)
                if (chunks_[other].carrier->coordinates() > 0)
                    chunk.beside[other].push_back(place_in(pattern, column, free_ + chunks_[other].first));
        }
    }
    for (std::size_t which = 0; which < matrices.size(); ++which)
        find_places(which, *matrices[which], reduced, pattern);
    coupled_.clear();
}

void Carried::find_places(std::size_t which, const SystemMatrix& matrix, const std::vector<Index>& reduced,
                          const SparsePattern& pattern) {
    struct Mixed {
        Index carrier, to, link, from, row;
    };
    std::vector<Mixed> mixed;
    const auto of = [&](Index carrier) -> Places& { return chunks_[carrier].places[which]; };
    const auto link = [&](Index unknown) {
        return chunks_[carrier_of_[unknown]].twists.link_of_row(row_of_[unknown]);
    };
    const auto add_mixed = [&](Index free, Index carried, Index k) {
        const Index carrier = carrier_of_[carried];
        if (chunks_[carrier].carrier->coordinates() == 0) return;  // it is where joints hold or drive it
        const Index to = place_in(pattern, reduced[free], free_ + chunks_[carrier].first);
        mixed.push_back({carrier, to, link(carried), k, row_of_[carried]});
    };
    for (Index column = 0; column < matrix.size(); ++column)
        for (Index k = matrix.column_starts()[column]; k < matrix.column_starts()[column + 1]; ++k) {
            const Index row = matrix.rows()[k], of_row = carrier_of_[row], of_column = carrier_of_[column];
            if (of_row >= 0 && of_column >= 0) {
                if (of_row < of_column)
                    of(of_row).across[of_column].add(k, row_of_[column], link(column), row_of_[row],
                                                     link(row), 1.0);
                else if (of_row > of_column)
                    of(of_column).across[of_row].add(k, row_of_[row], link(row), row_of_[column],
                                                     link(column), 1.0);
                else  // the lower half stands for both
                    of(of_row).inner.add(k, row_of_[row], link(row), row_of_[column], link(column),
                                         row == column ? 0.5 : 1.0);
            } else if (of_row >= 0 && reduced[column] >= 0)
                add_mixed(column, row, k);
            else if (of_column >= 0 && reduced[row] >= 0)
                add_mixed(row, column, k);
        }
    std::ranges::sort(mixed, {}, [](const Mixed& m) { return std::tuple(m.carrier, m.to, m.link, m.from); });
    for (const Mixed& each : mixed) of(each.carrier).mixed.add(each.from, each.row, each.link, each.to);
}

void Carried::linearize(const VectorXd& q) {
    at_ = q;
    for (Chunk& chunk : chunks_) {
        chunk.twists = chunk.carrier->twists(q);
        chunk.normal.reset();
    }
}

void Carried::add_lower(const Chunk& chunk, const MatrixXd& block, double* values) const {
    for (Index j = 0; j < block.cols(); ++j)
        for (Index i = j; i < block.rows(); ++i) values[chunk.own[j] + i - j] += block(i, j);
}

void Carried::add_matrix(std::size_t which, const SystemMatrix& full, double* values) const {
    const double* entries = full.values().data();
    for (const Chunk& chunk : chunks_) {
        const Places& places = chunk.places[which];
        const LinkTwists& b = chunk.twists;
        const Index n = chunk.carrier->coordinates();
        places.mixed.add_columns(entries, b, n, values);
        if (!places.inner.empty()) {
            const MatrixXd half = b.product(places.inner.blocks(entries, b, b), b).topLeftCorner(n, n);
            add_lower(chunk, half + half.transpose(), values);
        }
        for (const auto& [other, across] : places.across) {
            const LinkTwists& beside = chunks_[other].twists;
            const MatrixXd block = b.product(across.blocks(entries, beside, b), beside);
            const std::vector<Index>& to = chunk.beside.at(other);
            if (to.empty()) continue;
            for (Index j = 0; j < n; ++j)
                for (Index i = 0; i < chunks_[other].carrier->coordinates(); ++i)
                    values[to[j] + i] += block(i, j);
        }
    }
}

void Carried::add_weights(const VectorXd& weights, double* values) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates();
        add_lower(chunk, chunk.twists.product(chunk.carrier->gather(weights)).topLeftCorner(n, n), values);
    }
}

void Carried::add_curvature(const VectorXd& gradient, double* values) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates();
        add_lower(chunk, chunk.carrier->curvature(at_, gradient).topLeftCorner(n, n), values);
    }
}

void Carried::add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates(), first = free_ + chunk.first;
        out.segment(first, n) +=
            chunk.carrier->curvature(at_, gradient).topLeftCorner(n, n) * reduced.segment(first, n);
    }
}

void Carried::set_values(const Values& values) {
    for (Chunk& chunk : chunks_) chunk.carrier->set_values(values);
}

void Carried::add_driven_increment(const VectorXd& q, VectorXd& increment) const {
    for (const Chunk& chunk : chunks_) {
        if (chunk.carrier->driven() == 0) continue;
        const VectorXd z = chunk.carrier->driven_increment(q);
        if (z.isZero(0.0)) continue;
        chunk.carrier->scatter(chunk.carrier->twists(q).motion_from(chunk.carrier->coordinates(), z),
                               increment);
    }
}

const Eigen::LDLT<MatrixXd>& Carried::normal(const Chunk& chunk) {
    const Index n = chunk.carrier->coordinates();
    if (!chunk.normal) chunk.normal.emplace(normal_of(chunk.twists).topLeftCorner(n, n));
    return *chunk.normal;
}

VectorXd Carried::pull_back_free(const Chunk& chunk, const VectorXd& rows) const {
    return chunk.twists.pull_back(rows).head(chunk.carrier->coordinates());
}

VectorXd Carried::driven_of(const Chunk& chunk, const VectorXd& rows) {
    return chunk.twists.pull_back(rows).tail(chunk.carrier->driven());
}

VectorXd Carried::free_part(const Chunk& chunk, const VectorXd& full) const {
    return normal(chunk).solve(pull_back_free(chunk, chunk.carrier->gather(full)));
}

VectorXd Carried::driven_part(const Chunk& chunk, const VectorXd& full) const {
    return all_of(chunk.twists, chunk.carrier->gather(full)).tail(chunk.carrier->driven());
}

void Carried::add_driven_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates(), m = chunk.carrier->driven();
        if (m == 0 || n == 0) continue;
        add_forces_of(chunk,
                      chunk.carrier->curvature(at_, gradient).topRightCorner(n, m) * driven_part(chunk, move),
                      forces);
    }
}

void Carried::add_forces_of(const Chunk& chunk, const VectorXd& by_coordinates, VectorXd& forces) const {
    VectorXd own = chunk.carrier->gather(forces);
    own += chunk.twists.motion(normal(chunk).solve(by_coordinates));
    chunk.carrier->scatter(own, forces);
}

VectorXd Carried::driven_rates(const Chunk& chunk, const VectorXd& all, Index& first) {
    const Index m = chunk.carrier->driven();
    if (m == 0) return {};
    first += m;
    return chunk.carrier->driven_units().cwiseProduct(all.segment(first - m, m));
}

VectorXd Carried::driving_motion(const VectorXd& by_driving) const {
    VectorXd motion = VectorXd::Zero(at_.size());
    Index first = 0;
    for (const Chunk& chunk : chunks_)
        if (const VectorXd z = driven_rates(chunk, by_driving, first); z.size() > 0)
            chunk.carrier->scatter(chunk.twists.motion_from(chunk.carrier->coordinates(), z), motion);
    return motion;
}

void Carried::add_driving_change(const VectorXd& gradient, const VectorXd& by_driving,
                                 VectorXd& forces) const {
    Index first = 0;
    for (const Chunk& chunk : chunks_) {
        const VectorXd z = driven_rates(chunk, by_driving, first);
        const Index n = chunk.carrier->coordinates();
        if (z.size() > 0 && n > 0)
            add_forces_of(chunk, chunk.carrier->driving_change(at_, gradient, z).head(n), forces);
    }
}

void Carried::vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                  const VectorXd& by_driving, Gradient& out) const {
    Index first = 0;
    for (const Chunk& chunk : chunks_) {
        const Carrier& carrier = *chunk.carrier;
        const Index n = carrier.coordinates(), m = carrier.driven();
        if (m == 0 && !carrier.placed()) continue;
        VectorXd z = VectorXd::Zero(n + m);
        if (n > 0) z.head(n) = free_part(chunk, lambda);
        if (by_driving.size() > 0 && m > 0) z.tail(m) = driven_rates(chunk, by_driving, first);
        carrier.places_vjp(at_, by_state, z, gradient, out);
        if (m == 0) continue;
        VectorXd by_driven = driven_of(chunk, carrier.gather(by_state));
        if (n > 0) by_driven += carrier.curvature(at_, gradient).bottomLeftCorner(m, n) * z.head(n);
        if (by_driving.size() > 0) by_driven += carrier.driving_change(at_, gradient, z.tail(m)).tail(m);
        carrier.driven_vjp(at_, by_driven, out);
    }
}

VectorXd Carried::driving(const VectorXd& gradient) const {
    VectorXd all;
    for (const Chunk& chunk : chunks_) {
        const Index m = chunk.carrier->driven();
        if (m == 0) continue;
        all.conservativeResize(all.size() + m);
        all.tail(m) =
            chunk.carrier->driven_units().cwiseProduct(driven_of(chunk, chunk.carrier->gather(gradient)));
    }
    return all;
}

void Carried::pull_back(const VectorXd& full, VectorXd& reduced) const {
    for (const Chunk& chunk : chunks_)
        reduced.segment(free_ + chunk.first, chunk.carrier->coordinates()) =
            pull_back_free(chunk, chunk.carrier->gather(full));
}

void Carried::diagonal(const VectorXd& weights, VectorXd& reduced) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates();
        if (n == 0) continue;  // an empty matrix has no diagonal to point to
        reduced.segment(free_ + chunk.first, n) =
            chunk.twists.product(chunk.carrier->gather(weights)).diagonal().head(n);
    }
}

void Carried::push_forward(const VectorXd& reduced, VectorXd& full) const {
    for (const Chunk& chunk : chunks_)
        chunk.carrier->scatter(
            chunk.twists.motion(reduced.segment(free_ + chunk.first, chunk.carrier->coordinates())), full);
}

void Carried::project(VectorXd& full) const {
    for (const Chunk& chunk : chunks_)
        chunk.carrier->scatter(chunk.twists.motion(free_part(chunk, full)), full);
}

void Carried::replace(const VectorXd& from, VectorXd& to) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->scatter(chunk.carrier->gather(from), to);
}

void Carried::advance(VectorXd& q, const VectorXd& p) const {
    const VectorXd from = q;
    q += p;
    for (const Chunk& chunk : chunks_) {
        const VectorXd z = all_of(chunk.carrier->twists(from), chunk.carrier->gather(p));
        chunk.carrier->scatter(chunk.carrier->gather(from), q);
        chunk.carrier->advance(q, z);
    }
}

VectorXd Carried::rounding(const VectorXd& q) const {
    VectorXd of_all = VectorXd::Zero(q.size());
    for (const Chunk& chunk : chunks_) {
        const VectorXd of_nodes = chunk.carrier->rounding(q);
        for (std::size_t k = 0; k < chunk.carrier->nodes().size(); ++k)
            of_all.segment<3>(3 * chunk.carrier->nodes()[k]).setConstant(of_nodes[static_cast<Index>(k)]);
    }
    return of_all;
}

void Carried::settle(VectorXd& q, VectorXd* v) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->settle(q, v);
}

void Carried::settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                         Gradient& out) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->settle_vjp(q, v, by_q, by_v, out);
}

void Carried::append_points(const std::vector<Vec3>& full, std::vector<Vec3>& points) const {
    for (const Chunk& chunk : chunks_) {
        Vec3 mean = Vec3::Zero();
        for (const Index node : chunk.carrier->nodes())
            mean += full[3 * node] / static_cast<double>(chunk.carrier->nodes().size());
        points.insert(points.end(), chunk.carrier->coordinates(), mean);
    }
}

std::size_t Carried::bytes() const {
    std::size_t total = (carrier_of_.capacity() + row_of_.capacity()) * sizeof(Index);
    for (const Chunk& chunk : chunks_) {
        for (const Places& places : chunk.places) {
            total += places.mixed.bytes() + places.inner.bytes();
            for (const auto& [other, across] : places.across) total += across.bytes();
        }
        const Index n = chunk.carrier->coordinates();
        total += chunk.twists.bytes() + n * n * sizeof(double);
    }
    return total;
}

}  // namespace magshell
