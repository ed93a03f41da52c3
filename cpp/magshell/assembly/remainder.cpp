#include "magshell/assembly/remainder.h"

namespace magshell {

void Remainder::add_product(const VectorXd& p, bool transposed, VectorXd& out) const {
    for (const Point& each : points_) {
        const Vec3 at = p.segment<3>(3 * each.node);
        out.segment<3>(3 * each.node) += transposed ? Vec3(each.block.transpose() * at) : Vec3(each.block * at);
    }
    for (const Face& each : faces_) {
        Eigen::Matrix<double, 9, 1> at;
        for (int k = 0; k < 3; ++k) at.segment<3>(3 * k) = p.segment<3>(3 * each.nodes[k]);
        for (int k = 0; k < 9; ++k) {
            const double share = transposed ? each.block.col(k).dot(at) : each.block.row(k).dot(at);
            out[3 * each.nodes[k / 3] + k % 3] += share;
        }
    }
}

}  // namespace magshell
