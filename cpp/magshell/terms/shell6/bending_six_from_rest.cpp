// The Hessian of the reference shape with edge rotations measured from the reference orientation of the edge:
// they are then the rotation of the shell's normal there.
//
// Between two faces, a face measures w (theta_left + theta_right) +- phi at an edge, with theta_left and
// theta_right the rotations of the faces about the edge, phi the rotation relative to their mean, and w = 1/2.
// With psi = phi + (theta_right - theta_left) / 2 this is theta_left + psi on one side and theta_right - psi on
// the other, so each face depends on its own nodes only.
#include "magshell/terms/shell6/bending_six_term.h"
#include "magshell/terms/side_nodes.h"

namespace magshell {

void BendingSixTerm::count_rotations_from_rest(bool from_rest) {
    from_rest_ = from_rest;
    if (!from_rest) side_rotations_ = {};
}

void BendingSixTerm::prepare_assembly(const double* q, const LoadParameters&) {
    if (!from_rest_) return;
    side_rotations_.resize(shell_.dihedrals.size());
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
             first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, element_block.last_dihedral);
            for (int g = 0; g < 2; ++g) {
                const std::array<DihedralAngleSix::Side, 2> sides = dihedrals_at(first, last, g, q).sides();
                for (int lane = 0; lane < last - first; ++lane)
                    for (int side = 0; side < 2; ++side)
                        side_rotations_[first + lane][g][side] = {lane_of(sides[side].along, lane),
                                                                  sides[side].foot[lane]};
            }
        }
    });
}

/// Calls visit(dof of the rotation, node, weight of the node in (theta_right - theta_left) / 2) for all
/// rotations.
template <class Visit>
void BendingSixTerm::each_half_rotation(const Visit& visit) const {
    for (std::size_t h = 0; h < shell_.dihedrals.size(); ++h) {
        const DihedralSixStencil& fold = shell_.dihedrals[h];
        if (!fold.right_is_face) continue;
        const FaceSideSix& left = shell_.sides[fold.left.face][fold.left.corner];
        for (int g = 0; g < 2; ++g)
            for (const bool on_left : {true, false}) {
                const SideRotation& turn = side_rotations_[h][g][on_left ? 0 : 1];
                const Vec3 half = (on_left ? -0.5 : 0.5) * turn.along;
                for (int index = 0; index < 6; ++index)
                    visit(first_scalar_ + left.rotation[g], fold.nodes[node_on_side(index, on_left)],
                          DihedralAngleSix::side_weight(g, index, turn.foot) * half);
            }
    }
}

void BendingSixTerm::rotations_from_sides(VectorXd& motion) const {
    each_half_rotation([&](Index rotation, Index node, const Vec3& by_node) {
        motion[rotation] -= by_node.dot(motion.segment<3>(3 * node));
    });
}

void BendingSixTerm::forces_from_rest(VectorXd& forces) const {
    if (forces.tail(forces.size() - first_scalar_).isZero(0.0)) return;
    each_half_rotation([&](Index rotation, Index node, const Vec3& by_node) {
        forces.segment<3>(3 * node) -= forces[rotation] * by_node;
    });
}

void BendingSixTerm::assemble_from_rest(Index group, const double* q, SystemMatrix& out) const {
    SimdVec3 x[6];
    SixNodeRows rows;
    loop_.gather(group, q, x);
    BendingSix(x).rows(elements_[group], rows);
    // The only nodes outside a face are the directions across clamped edges.
    SimdVec3 directions[3][2] = {};
    SimdDouble sign[3] = {};
    std::array<bool, 3> any_directions{};
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = shell_.sides[loop_.element(group, lane)][i];
            sign[i].set(lane, side.sign);
            if (side.dihedral < 0) continue;
            const bool is_held = !shell_.dihedrals[side.dihedral].right_is_face;
            any_directions[i] |= is_held;
            const SideNodes& at = side.on_left ? left_side : right_side;
            const std::array<int, 6> own = face_order(i);
            for (int g = 0; g < 2; ++g) {
                const int point = side.point(g);
                const std::array<double, 27>& by_node = dihedrals_[side.dihedral][point].gradient;
                const SideRotation& turn = side_rotations_[side.dihedral][point][side.on_left ? 0 : 1];
                const auto part = [&](int a) -> Vec3 {
                    if (is_held) return Vec3(by_node.data() + 3 * a);
                    return DihedralAngleSix::side_weight(point, index_on_side(a), turn.foot) * turn.along;
                };
                for (int k = 0; k < 6; ++k) {
                    SimdVec3& row = rows.at[3 * i + g][own[k]];
                    set_lane(row, lane, lane_of(row, lane) + part(at.own[k]));
                }
                if (is_held) set_lane(directions[i][g], lane, part(at.beyond));
            }
        }
    const Symmetric9 stiffness = history_.scaled(stiffness_[group]);
    const SixNodeRows stiff = rows.times(stiffness);
    SimdMat3 h[21];
    rows.blocks(stiff, h);
    loop_.scatter(group, h, out);
    SimdVec3 by_rotation[6][6];
    for (int a = 0; a < 6; ++a)
        for (int k = 0; k < 6; ++k) by_rotation[a][k] = sign[a / 2] * stiff.at[3 * (a / 2) + a % 2][k];
    for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
        const Index f = loop_.element(group, lane);
        const std::array<Index, 6>& nodes = shell_.own_nodes[f];
        Index length[6];
        for (int k = 0; k < 6; ++k) length[k] = out.column_length(nodes[k]);
        for (int a = 0; a < 6; ++a)
            if (shell_.stencils[f].rotations[a] >= 0)
                for (int k = 0; k < 6; ++k)
                    out.add_rotation_row(face_slots_[f].rotation_nodes[a][k], length[k], by_rotation[a][k],
                                         lane);
        add_rotations(group, lane, sign, stiffness, out);
    }
    if (any_directions[0] || any_directions[1] || any_directions[2])
        add_directions(group, directions, sign, stiffness, stiff, out);
}

/// Adds the blocks between the directions across clamped edges and the nodes and rotations of their faces, and
/// among directions.
void BendingSixTerm::add_directions(Index group, const SimdVec3 (&directions)[3][2], const SimdDouble sign[3],
                                    const Symmetric9& stiffness, const SixNodeRows& stiff,
                                    SystemMatrix& out) const {
    for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
        const Index f = loop_.element(group, lane);
        const std::array<Index, 15>& nodes = shell_.stencils[f].nodes;
        const auto is_held = [&](int i) {
            const Index fold = shell_.sides[f][i].dihedral;
            return fold >= 0 && !shell_.dihedrals[fold].right_is_face;
        };
        const auto add = [&](int row, int column, const SimdMat3& block) {
            const SystemMatrix::Slot slot = face_slots_[f].nodes[lower_index(row - 1, column)];
            if (slot == same_node) out.add_block_and_transpose(nodes[row], block, lane);
            if (slot >= 0)
                out.add_block(slot, out.column_length(nodes[slot & 1 ? row : column]), block, lane);
        };
        for (int i = 0; i < 3; ++i) {
            if (!is_held(i)) continue;
            const int row = 6 + 3 * i;
            for (int k = 0; k < 6; ++k)
                add(row, k,
                    outer(directions[i][0], stiff.at[3 * i][k]) +
                        outer(directions[i][1], stiff.at[3 * i + 1][k]));
            for (int j = 0; j < 3; ++j) {
                SimdVec3 stressed[2];  // coupling with the strains of edge j
                for (int g = 0; g < 2; ++g)
                    stressed[g] = stiffness(3 * i, 3 * j + g) * directions[i][0] +
                                  stiffness(3 * i + 1, 3 * j + g) * directions[i][1];
                if (is_held(j) && j <= i) {
                    const SimdMat3 block =
                        outer(stressed[0], directions[j][0]) + outer(stressed[1], directions[j][1]);
                    if (j == i)
                        out.add_diagonal_block(nodes[row], block, lane);
                    else
                        add(row, 6 + 3 * j, block);
                }
                for (int g = 0; g < 2; ++g)
                    if (shell_.stencils[f].rotations[2 * j + g] >= 0)
                        out.add_rotation_row(face_slots_[f].rotation_nodes[2 * j + g][row],
                                             out.column_length(nodes[row]), sign[j] * stressed[g], lane);
            }
        }
    }
}

}  // namespace magshell
