#include "magshell/terms/joint/corner_form.h"

#include <algorithm>
#include <cmath>

#include "magshell/terms/contact/contact_term.h"

namespace magshell {

LinkPair::LinkPair(const Index* parent, const Index* child, const std::vector<Vec3>& rest,
                   const SystemMatrix& matrix)
    : first_(parent ? 0 : 4) {
    for (int side = parent ? 0 : 1; side < 2; ++side) {
        const Index* corners = side == 0 ? parent : child;
        middle_[side] = Vec3::Zero();
        for (int k = 0; k < 4; ++k) {
            nodes_[4 * side + k] = corners[k];
            rest_.col(4 * side + k) = rest[corners[k]];
            middle_[side] += 0.25 * rest[corners[k]];
        }
        for (int k = 0; k < 4; ++k) {
            const Vec3 rho = rest[corners[k]] - middle_[side];
            offsets_[4 * side + k] = rho * (3.0 / (4.0 * rho.squaredNorm()));  // |rho|^2 = 3 l^2
        }
    }
    for (int i = first_; i < 8; ++i)
        for (int j = first_; j < i; ++j) slots_[i][j] = matrix.node_slot(nodes_[i], nodes_[j]);
}

double LinkPair::length() const {
    const double child = 1.0 / (4.0 * offsets_[4].norm()), parent = 1.0 / (4.0 * offsets_[0].norm());
    return std::sqrt(3.0) * (world() ? child : std::min(child, parent));
}

CornerSum LinkPair::vector(bool of_child, const Vec3& at_rest) const {
    CornerSum sum;
    if (!of_child && world()) {
        sum.fixed = at_rest;
        return sum;
    }
    const int first = of_child ? 4 : 0;
    for (int k = first; k < first + 4; ++k) sum.weights[k] = offsets_[k].dot(at_rest);
    return sum;
}

CornerSum LinkPair::point(bool of_child, const Vec3& at_rest) const {
    if (!of_child && world()) return vector(of_child, at_rest);
    CornerSum sum = vector(of_child, at_rest - middle_[of_child]);
    sum.weights.segment<4>(of_child ? 4 : 0).array() += 0.25;
    return sum;
}

CornerForm::Corners LinkPair::gather(const double* all) const {
    CornerForm::Corners x = CornerForm::Corners::Zero();
    for (int k = first_; k < 8; ++k) x.col(k) = Eigen::Map<const Vec3>(all + 3 * nodes_[k]);
    return x;
}

CornerForm::Corners LinkPair::positions(const double* q) const {
    CornerForm::Corners x = gather(q);
    if (!world()) x.colwise() -= Vec3(x.col(0));
    return x;
}

void LinkPair::add(const Eigen::Matrix<double, 8, 8>& h, const CornerForm::Corners& a, double factor,
                   const CornerForm::Corners& b, double cross, SystemMatrix& out) const {
    for (int i = first_; i < 8; ++i)
        for (int j = first_; j <= i; ++j) {
            Mat3 block = h(i, j) * Mat3::Identity() + factor * a.col(i) * a.col(j).transpose();
            if (cross != 0.0)
                block += cross * (a.col(i) * b.col(j).transpose() + b.col(i) * a.col(j).transpose());
            if (i == j)
                out.add_diagonal_block(nodes_[i], to_simd(block), 0);
            else
                out.add_block(slots_[i][j], out.column_length(std::min(nodes_[i], nodes_[j])), to_simd(block),
                              0);
        }
}

}  // namespace magshell
