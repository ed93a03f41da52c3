#include "magshell/assembly/carried.h"

#include <algorithm>
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

}  // namespace

void Carried::find_places(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                          const SparsePattern& pattern) {
    for (Chunk& chunk : chunks_) {
        chunk.own.clear();
        chunk.beside.clear();
        chunk.places.assign(matrices.size(), {});
        for (Index j = 0; j < chunk.carrier->coordinates(); ++j) {
            const Index column = free_ + chunk.first + j;
            chunk.own.push_back(place_in(pattern, column, column));
            for (const Index other : chunk.later)
                chunk.beside[other].push_back(place_in(pattern, column, free_ + chunks_[other].first));
        }
    }
    for (std::size_t which = 0; which < matrices.size(); ++which)
        find_places(which, *matrices[which], reduced, pattern);
    coupled_.clear();
}

void Carried::find_places(std::size_t which, const SystemMatrix& matrix, const std::vector<Index>& reduced,
                          const SparsePattern& pattern) {
    const auto of = [&](Index carrier) -> Places& { return chunks_[carrier].places[which]; };
    for (Index column = 0; column < matrix.size(); ++column)
        for (Index k = matrix.column_starts()[column]; k < matrix.column_starts()[column + 1]; ++k) {
            const Index row = matrix.rows()[k], of_row = carrier_of_[row], of_column = carrier_of_[column];
            if (of_row >= 0 && of_column >= 0) {
                if (of_row == of_column)
                    of(of_row).inner.push_back({k, row_of_[row], row_of_[column]});
                else if (of_row > of_column)
                    of(of_column).across[of_row].push_back({k, row_of_[row], row_of_[column]});
                else
                    of(of_row).across[of_column].push_back({k, row_of_[column], row_of_[row]});
            } else if (of_row >= 0 && reduced[column] >= 0) {
                const Index to = place_in(pattern, reduced[column], free_ + chunks_[of_row].first);
                of(of_row).mixed.push_back({k, row_of_[row], to});
            } else if (of_column >= 0 && reduced[row] >= 0) {
                const Index to = place_in(pattern, reduced[row], free_ + chunks_[of_column].first);
                of(of_column).mixed.push_back({k, row_of_[column], to});
            }
        }
}

void Carried::linearize(const VectorXd& q) {
    at_ = q;
    for (Chunk& chunk : chunks_) {
        MatrixXd all = chunk.carrier->jacobian(q);
        if (chunk.carrier->driven() > 0) {
            chunk.driven = all.rightCols(chunk.carrier->driven());
            chunk.jacobian = all.leftCols(chunk.carrier->coordinates());
        } else
            chunk.jacobian = std::move(all);
        chunk.normal.compute(chunk.jacobian.transpose() * chunk.jacobian);
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
        const MatrixXd& b = chunk.jacobian;
        const Index n = chunk.carrier->coordinates();
        for (const Mixed& each : places.mixed)
            for (Index j = 0; j < n; ++j) values[each.to + j] += entries[each.from] * b(each.row, j);
        MatrixXd hb = MatrixXd::Zero(b.rows(), n);
        for (const Inner& each : places.inner) {
            hb.row(each.row) += entries[each.from] * b.row(each.column);
            if (each.row != each.column) hb.row(each.column) += entries[each.from] * b.row(each.row);
        }
        add_lower(chunk, b.transpose() * hb, values);
        for (const auto& [other, across] : places.across) {
            const MatrixXd& beside = chunks_[other].jacobian;
            MatrixXd block = MatrixXd::Zero(beside.cols(), n);
            for (const Inner& each : across)
                block += entries[each.from] * beside.row(each.row).transpose() * b.row(each.column);
            const std::vector<Index>& to = chunk.beside.at(other);
            for (Index j = 0; j < n; ++j)
                for (Index i = 0; i < block.rows(); ++i) values[to[j] + i] += block(i, j);
        }
    }
}

void Carried::add_weights(const VectorXd& weights, double* values) const {
    for (const Chunk& chunk : chunks_)
        add_lower(chunk,
                  chunk.jacobian.transpose() * chunk.carrier->gather(weights).asDiagonal() * chunk.jacobian,
                  values);
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
        const MatrixXd b = chunk.carrier->jacobian(q);
        chunk.carrier->scatter(b.rightCols(z.size()) * z, increment);
    }
}

VectorXd Carried::free_part(const Chunk& chunk, const VectorXd& full) const {
    return chunk.normal.solve(chunk.jacobian.transpose() * chunk.carrier->gather(full));
}

VectorXd Carried::driven_part(const Chunk& chunk, const VectorXd& full) const {
    MatrixXd b(chunk.jacobian.rows(), chunk.jacobian.cols() + chunk.driven.cols());
    b << chunk.jacobian, chunk.driven;
    return (b.transpose() * b)
        .ldlt()
        .solve(b.transpose() * chunk.carrier->gather(full))
        .tail(chunk.driven.cols());
}

void Carried::add_driven_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates(), m = chunk.carrier->driven();
        if (m == 0 || n == 0) continue;
        const VectorXd pull =
            chunk.carrier->curvature(at_, gradient).topRightCorner(n, m) * driven_part(chunk, move);
        VectorXd own = chunk.carrier->gather(forces);
        own += chunk.jacobian * chunk.normal.solve(pull);
        chunk.carrier->scatter(own, forces);
    }
}

void Carried::driven_vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                         Gradient& out) const {
    for (const Chunk& chunk : chunks_) {
        const Index n = chunk.carrier->coordinates(), m = chunk.carrier->driven();
        if (m == 0) continue;
        VectorXd by_driven = chunk.driven.transpose() * chunk.carrier->gather(by_state);
        if (n > 0)
            by_driven +=
                chunk.carrier->curvature(at_, gradient).bottomLeftCorner(m, n) * free_part(chunk, lambda);
        chunk.carrier->driven_vjp(by_driven, out);
    }
}

VectorXd Carried::driving(const VectorXd& gradient) const {
    VectorXd all;
    for (const Chunk& chunk : chunks_) {
        const Index m = chunk.carrier->driven();
        if (m == 0) continue;
        all.conservativeResize(all.size() + m);
        all.tail(m) = chunk.carrier->driven_units().cwiseProduct(chunk.driven.transpose() *
                                                                 chunk.carrier->gather(gradient));
    }
    return all;
}

void Carried::pull_back(const VectorXd& full, VectorXd& reduced) const {
    for (const Chunk& chunk : chunks_)
        reduced.segment(free_ + chunk.first, chunk.carrier->coordinates()) =
            chunk.jacobian.transpose() * chunk.carrier->gather(full);
}

void Carried::diagonal(const VectorXd& weights, VectorXd& reduced) const {
    for (const Chunk& chunk : chunks_)
        reduced.segment(free_ + chunk.first, chunk.carrier->coordinates()) =
            chunk.jacobian.cwiseAbs2().transpose() * chunk.carrier->gather(weights);
}

void Carried::push_forward(const VectorXd& reduced, VectorXd& full) const {
    for (const Chunk& chunk : chunks_)
        chunk.carrier->scatter(
            chunk.jacobian * reduced.segment(free_ + chunk.first, chunk.carrier->coordinates()), full);
}

void Carried::project(VectorXd& full) const {
    for (const Chunk& chunk : chunks_) {
        chunk.carrier->scatter(chunk.jacobian * free_part(chunk, full), full);
    }
}

void Carried::replace(const VectorXd& from, VectorXd& to) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->scatter(chunk.carrier->gather(from), to);
}

void Carried::advance(VectorXd& q, const VectorXd& p) const {
    const VectorXd from = q;
    q += p;
    for (const Chunk& chunk : chunks_) {
        const MatrixXd b = chunk.carrier->jacobian(from);
        const VectorXd z = (b.transpose() * b).ldlt().solve(b.transpose() * chunk.carrier->gather(p));
        chunk.carrier->scatter(chunk.carrier->gather(from), q);
        chunk.carrier->advance(q, z);
    }
}

void Carried::settle(VectorXd& q, VectorXd* v) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->settle(q, v);
}

void Carried::settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v) const {
    for (const Chunk& chunk : chunks_) chunk.carrier->settle_vjp(q, v, by_q, by_v);
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
    for (const Chunk& chunk : chunks_)
        for (const Places& places : chunk.places)
            total += places.mixed.capacity() * sizeof(Mixed) + places.inner.capacity() * sizeof(Inner);
    for (const Chunk& chunk : chunks_) total += chunk.jacobian.size() * sizeof(double);
    return total;
}

}  // namespace magshell
