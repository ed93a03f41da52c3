#include "magshell/contact/slip_map.h"

#include <algorithm>

namespace magshell {
namespace {

Mat3 cross_product_with(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

double weight_of(const PairWeights& weights, int k) {
    return k < 4 ? weights[k] : 0.0;
}

}  // namespace

SlipStencil::SlipStencil(const ContactPair& pair, const std::array<Index, 3>& triangle, const double* all)
    : SlipStencil() {
    count = nodes_of(pair.kind);
    std::copy_n(pair.nodes.begin(), count, nodes.begin());
    const int first = pair.kind == PairKind::edge_edge ? 2 : 1;
    if (pair.kind != PairKind::point_triangle)
        for (const Index node : triangle) {
            const auto end = nodes.begin() + count;
            const auto found = std::find(nodes.begin(), end, node);
            if (found == end) {
                nodes[count++] = node;
            } else if (found - nodes.begin() < first) {
                count = 0;
                return;
            }
        }
    corner = first;
    positions = of(all);
}

SlipVectors SlipStencil::of(const double* all) const {
    SlipVectors vectors;
    vectors.fill(Vec3::Zero());
    for (int k = 0; k < count; ++k) vectors[k] = Eigen::Map<const Vec3>(all + 3 * nodes[k]);
    return vectors;
}

SlipMap::SlipMap(const Proximity& near, const SlipStencil& stencil) : near_(near), first_(stencil.corner) {
    map_.fill(Mat3::Zero());
    gradients_.fill(Vec3::Zero());
    spin_.fill(Mat3::Zero());
    if (stencil.count == 0) return;
    const Vec3 one = stencil.positions[first_ + 1] - stencil.positions[first_],
               two = stencil.positions[first_ + 2] - stencil.positions[first_], normal = one.cross(two);
    const double squared_area = normal.squaredNorm();
    if (squared_area > 0.0) {
        triangle_normal_ = normal.normalized();
        gradients_[1] = two.cross(normal) / squared_area;
        gradients_[2] = normal.cross(one) / squared_area;
        gradients_[0] = -gradients_[1] - gradients_[2];
    }
    const Vec3& m = triangle_normal_;
    for (int c = 0; c < 3; ++c)
        spin_[c] = gradients_[c].cross(m) * m.transpose() + 0.5 * m * m.cross(gradients_[c]).transpose();
    const Mat3 across = Mat3::Identity() - near.normal * near.normal.transpose(),
               arm = near.distance * cross_product_with(near.normal);
    for (int k = 0; k < stencil.count; ++k) map_[k] = weight_of(near.weights, k) * across;
    for (int c = 0; c < 3; ++c) map_[first_ + c] += arm * spin_[c];
}

Vec3 SlipMap::slip(const SlipVectors& velocities) const {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < slip_nodes; ++k) sum += map_[k] * velocities[k];
    return sum;
}

SlipVectors SlipMap::forces(const Vec3& friction) const {
    SlipVectors forces;
    for (int k = 0; k < slip_nodes; ++k) forces[k] = map_[k].transpose() * friction;
    return forces;
}

std::array<Mat3, slip_nodes> SlipMap::rate(const Rate& along) const {
    const Vec3& n = near_.normal;
    const Mat3 across = Mat3::Identity() - n * n.transpose();
    const Mat3 tilt = -along.normal * n.transpose() - n * along.normal.transpose();
    const Mat3 arm = cross_product_with(along.distance * n + near_.distance * along.normal);
    std::array<Mat3, slip_nodes> rates;
    for (int k = 0; k < slip_nodes; ++k)
        rates[k] = weight_of(along.weights, k) * across + weight_of(near_.weights, k) * tilt;
    for (int c = 0; c < 3; ++c) rates[first_ + c] += arm * spin_[c];
    return rates;
}

// A motion of the corner c along e has the rates dm = - (e . m) g_c, and dg_k = - (e . g_k) g_c + (g_c . g_k) (e . m) m.
std::array<Mat3, slip_nodes> SlipMap::rate_by_corner(int c, int axis) const {
    const Vec3 &m = triangle_normal_, &own = gradients_[c];
    const Vec3 m_rate = -m[axis] * own;
    const Mat3 arm = near_.distance * cross_product_with(near_.normal);
    std::array<Mat3, slip_nodes> rates;
    rates.fill(Mat3::Zero());
    for (int k = 0; k < 3; ++k) {
        const Vec3& g = gradients_[k];
        const Vec3 g_rate = -g[axis] * own + own.dot(g) * m[axis] * m;
        const Mat3 spin_rate = (g_rate.cross(m) + g.cross(m_rate)) * m.transpose() +
                               g.cross(m) * m_rate.transpose() + 0.5 * m_rate * m.cross(g).transpose() +
                               0.5 * m * (m_rate.cross(g) + m.cross(g_rate)).transpose();
        rates[first_ + k] = arm * spin_rate;
    }
    return rates;
}

}  // namespace magshell
