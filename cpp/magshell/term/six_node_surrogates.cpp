// What Projective Dynamics has in the place of the stiffnesses of six-node sheets: of waves in their plane, and of bending as
// it is at rest, along normals alone, taken for all three directions.
#include <Eigen/LU>

#include "magshell/strain/six_nodes.h"
#include "magshell/term/bending_six_term.h"
#include "magshell/term/membrane_six_term.h"

namespace magshell {
namespace {

Vec3 normal_of(const std::array<Vec3, 6>& x) {
    return (x[1] - x[0]).cross(x[2] - x[0]).normalized();
}

}  // namespace

// As of three nodes: h w grad N_k . grad N_l over the points inside, w = E/(1 - nu^2).
bool MembraneSixTerm::add_projective_stiffness(NodeMatrix& out) const {
    constexpr auto first = six_nodes::inside_towards(2, 1.0), second = six_nodes::inside_towards(1, -1.0);
    for (Index f = 0; f < sheet_.n_faces(); ++f) {
        const SheetMaterial& m = materials_[f];
        const double modulus = m.thickness * m.young_modulus / (1.0 - m.poisson_ratio * m.poisson_ratio);
        const std::array<Index, 6>& nodes = sheet_.own_nodes[f];
        for (std::size_t p = 0; p < six_nodes::inside.size(); ++p) {
            Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
            Eigen::Matrix<double, 2, 6> by_place;
            for (int k = 0; k < 6; ++k) {
                by_place.col(k) << first[p][k], second[p][k];
                tangents += sheet_.rest[f][k] * by_place.col(k).transpose();
            }
            const Eigen::Matrix2d metric = tangents.transpose() * tangents;
            const double factor =
                0.5 * six_nodes::inside[p].weight * std::sqrt(metric.determinant()) * modulus;
            const Eigen::Matrix<double, 6, 6> h = factor * by_place.transpose() * metric.inverse() * by_place;
            for (int k = 0; k < 6; ++k) {
                out.add_diagonal(nodes[k], h(k, k));
                for (int l = 0; l < k; ++l) out.add_pair(nodes[k], nodes[l], h(k, l));
            }
        }
    }
    return true;
}

std::vector<std::array<std::array<double, 9>, 2>> BendingSixTerm::slopes_at_rest() const {
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = sheet_.n_dihedrals();
    std::vector<std::array<std::array<double, 9>, 2>> slopes(n);
    for (Index first = 0; first < n; first += Pack::width) {
        const Index last = std::min<Index>(first + Pack::width, n);
        for (int g = 0; g < 2; ++g) {
            Pack3 by_node[9];
            dihedral_angles_at(first, last, g, q.data()).gradient(by_node);
            for (Index h = first; h < last; ++h) {
                Vec3 normal = Vec3::Zero();
                for (const DihedralStencil::Side& side :
                     {sheet_.dihedrals[h].left, sheet_.dihedrals[h].right})
                    if (side.face >= 0) normal += normal_of(sheet_.rest[side.face]);
                normal.normalize();
                for (int a = 0; a < 9; ++a) slopes[h][g][a] = lane_of(by_node[a], h - first).dot(normal);
            }
        }
    }
    return slopes;
}

bool BendingSixTerm::add_projective_stiffness(NodeMatrix& out) const {
    const std::vector<std::array<std::array<double, 9>, 2>> slopes = slopes_at_rest();
    for (Index pack = 0; pack < loop_.packs(); ++pack) {
        Pack3 x[6];
        for (int lane = 0; lane < Pack::width; ++lane)
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, sheet_.rest[loop_.element(pack, lane)][k]);
        SixNodeRows inside;
        BendingSix(x).rows(elements_[pack], inside);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.element(pack, lane);
            const Vec3 normal = normal_of(sheet_.rest[f]);
            NodeRows rows(9);
            for (int r = 0; r < 9; ++r)
                for (int k = 0; k < 6; ++k)
                    rows.add(r, sheet_.own_nodes[f][k], lane_of(inside.at[r][k], lane).dot(normal));
            for (int i = 0; i < 3; ++i) {
                const FaceSideSix& side = sheet_.sides[f][i];
                for (int g = 0; g < 2; ++g) {
                    for (int a = 0; a < 9 && side.dihedral >= 0; ++a)
                        if (const Index node = sheet_.dihedrals[side.dihedral].nodes[a]; node >= 0)
                            rows.add(3 * i + g, node, side.weight * slopes[side.dihedral][side.point(g)][a]);
                    if (side.rotation[g] < 0) continue;
                    rows.add(3 * i + g, out.point(side.rotation[g]), side.sign);
                    const std::array<Index, 6>& own = sheet_.own_nodes[f];
                    out.add_adjacent_face(side.rotation[g], {own[0], own[1], own[2]});
                }
            }
            rows.add_to(out, [&](int r, int s) { return stiffness_[pack](r, s)[lane]; });
        }
    }
    return true;
}

}  // namespace magshell
