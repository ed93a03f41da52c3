#include "magshell/assembly/nonsymmetric_tangent.h"

namespace magshell {

void NonsymmetricTangent::add_product(const VectorXd& p, bool transposed, VectorXd& out) const {
    for (const NodeBlock& each : node_blocks_) {
        const Vec3 at = p.segment<3>(3 * each.node);
        out.segment<3>(3 * each.node) +=
            transposed ? Vec3(each.block.transpose() * at) : Vec3(each.block * at);
    }
    for (const FaceBlock& each : face_blocks_) {
        Vec3 at[3];
        for (int k = 0; k < 3; ++k) at[k] = p.segment<3>(3 * each.nodes[k]);
        if (transposed) {
            const Vec3 sum = each.weights[0] * at[0] + each.weights[1] * at[1] + each.weights[2] * at[2];
            for (int k = 0; k < 3; ++k)
                out.segment<3>(3 * each.nodes[k]) += each.block.middleCols<3>(3 * k).transpose() * sum;
            continue;
        }
        const Vec3 force = each.block.leftCols<3>() * at[0] + each.block.middleCols<3>(3) * at[1] +
                           each.block.rightCols<3>() * at[2];
        for (int k = 0; k < 3; ++k) out.segment<3>(3 * each.nodes[k]) += each.weights[k] * force;
    }
    for (const SkewBlock& each : skew_blocks_) {
        const auto& [a, b] = each.nodes;
        const Vec3 axis = transposed ? Vec3(-each.axis) : each.axis;
        out.segment<3>(3 * a) += axis.cross(Vec3(p.segment<3>(3 * b)));
        if (a != b) out.segment<3>(3 * b) += axis.cross(Vec3(p.segment<3>(3 * a)));
    }
    for (const PairBlock& each : pair_blocks_)
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                if (each.nodes[i] < 0 || each.nodes[j] < 0) continue;
                const Mat3& block = each.blocks[4 * i + j];
                if (transposed)
                    out.segment<3>(3 * each.nodes[j]) += block.transpose() * p.segment<3>(3 * each.nodes[i]);
                else
                    out.segment<3>(3 * each.nodes[i]) += block * p.segment<3>(3 * each.nodes[j]);
            }
}

}  // namespace magshell
