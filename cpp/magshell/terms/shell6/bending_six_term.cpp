#include "magshell/terms/shell6/bending_six_term.h"

#include <cmath>
#include <numbers>

#include "magshell/terms/side_nodes.h"

namespace magshell {
namespace {

Vec3 normal_of(const std::array<Vec3, 6>& x) {
    return (x[1] - x[0]).cross(x[2] - x[0]).normalized();
}

}  // namespace

BendingSixTerm::BendingSixTerm(const SixNodeShell& shell, Index body, const ColoredLoop& element_blocks,
                               const Nodes& nodes, const GrowthForm& growth, const SystemMatrix& matrix,
                               Registry& registry)
    : StrainScaffold(shell.n_faces()),
      shell_(shell),
      body_(body),
      nodes_(nodes),
      first_scalar_(nodes.first_scalar()),
      element_blocks_(element_blocks),
      loop_(shell.own_nodes, element_blocks, matrix),
      materials_(shell.owner, shell.faces, registry),
      growth_(shell.owner, shell.faces, growth, registry),
      rest_(shell.rest.begin(), shell.rest.end()),
      elements_(loop_.groups()),
      rest_measures_(loop_.groups()),
      stiffness_(loop_.groups()),
      dihedrals_(shell.dihedrals.size()) {
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6];
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell.rest[f][k]);
            for (int p = 0; p < BendingSix::points; ++p)
                elements_[group].inverse_jacobian[p].set(lane, rest_[f].inverse_jacobian[p]);
            for (int r = 0; r < 9; ++r) elements_[group].scale[r].set(lane, rest_[f].scale[r]);
        }
        BendingSix(x).measures(elements_[group], rest_measures_[group].data());
    }
    if (growth_.any())
        for (Index f = 0; f < shell.n_faces(); ++f)
            reference_interior_.push_back(
                lane_of<9>(rest_measures_[f / SimdDouble::width].data(), f % SimdDouble::width));
    for (const SixNodeShell::Stencil& s : shell.stencils) {
        FaceSlots& slots = face_slots_.emplace_back();
        slots.nodes = pair_slots<15>(matrix, s.nodes);
        for (int a = 0; a < 6; ++a) {
            const Index r = s.rotations[a];
            for (int k = 0; k < 15; ++k)
                slots.rotation_nodes[a][k] =
                    r < 0 || s.nodes[k] < 0 ? -1 : matrix.rotation_slot(r, s.nodes[k]);
            for (int b = 0; b <= a; ++b)
                slots.rotations[lower_index(a, b)] =
                    r < 0 || s.rotations[b] < 0 ? -1 : matrix.rotations_slot(r, s.rotations[b]);
        }
    }
    for (const DihedralSixStencil& fold : shell.dihedrals) {
        PairSlots<9>& slots = dihedral_slots_.emplace_back(pair_slots<9>(matrix, fold.nodes));
        for (int a = 6; a < 9; ++a)  // the two half-planes do not meet in d2theta
            for (int b = 3; b < 6; ++b) slots[lower_index(a - 1, b)] = -1;
    }
}

DihedralAngleSix BendingSixTerm::dihedrals_at(Index first, Index last, int point, const double* q) const {
    SimdVec3 x[9] = {};
    SimdDouble right_is_face(0.0);
    for (int lane = 0; lane < SimdDouble::width; ++lane) {
        const DihedralSixStencil& fold = shell_.dihedrals[std::min(first + lane, last - 1)];
        for (int a = 0; a < 9; ++a)
            if (fold.nodes[a] >= 0) set_lane(x[a], lane, q + 3 * fold.nodes[a]);
        right_is_face.set(lane, fold.right_is_face ? 1.0 : 0.0);
    }
    return DihedralAngleSix(x, right_is_face, point);
}

double BendingSixTerm::angle_change(Index fold, int point, double angle) const {
    return std::remainder(angle - shell_.dihedrals[fold].rest_angle[point], 2.0 * std::numbers::pi);
}

void BendingSixTerm::store_dihedrals(const double* q) {
    state_.assign(q, q + 3 * nodes_.n_nodes());
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
             first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, element_block.last_dihedral);
            for (int g = 0; g < 2; ++g) {
                const DihedralAngleSix fold = dihedrals_at(first, last, g, q);
                const SimdDouble angle = fold.angle();
                SimdVec3 by_node[9];
                fold.gradient(by_node);
                for (int lane = 0; lane < last - first; ++lane) {
                    DihedralState& state = dihedrals_[first + lane][g];
                    state.angle_change = angle_change(first + lane, g, angle[lane]);
                    for (int a = 0; a < 9; ++a) {
                        state.gradient[3 * a] = by_node[a].x[lane];
                        state.gradient[3 * a + 1] = by_node[a].y[lane];
                        state.gradient[3 * a + 2] = by_node[a].z[lane];
                    }
                }
            }
        }
    });
}

void BendingSixTerm::store_rates(const double* p) {
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index h = element_block.first_dihedral; h < element_block.last_dihedral; ++h)
            for (DihedralState& state : dihedrals_[h]) {
                state.rate = 0.0;
                for (int a = 0; a < 9; ++a) {
                    const Index node = shell_.dihedrals[h].nodes[a];
                    if (node < 0) continue;
                    for (int c = 0; c < 3; ++c) state.rate += state.gradient[3 * a + c] * p[3 * node + c];
                }
            }
    });
}

template <class AngleOf>
void BendingSixTerm::add_edge_strains(Index group, const double* q, const AngleOf& angle_of,
                                      SimdDouble d[9]) const {
    const double* rotation = q + first_scalar_;
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = shell_.sides[loop_.element(group, lane)][i];
            for (int g = 0; g < 2; ++g) {
                double delta = side.dihedral < 0 ? 0.0 : side.weight * angle_of(side.dihedral, side.point(g));
                if (side.rotation[g] >= 0) delta += side.sign * rotation[side.rotation[g]];
                d[3 * i + g].set(lane, d[3 * i + g][lane] + delta);
            }
        }
}

void BendingSixTerm::interior(Index group, const double* q, SimdDouble f[9]) const {
    SimdVec3 x[6];
    loop_.gather(group, q, x);
    BendingSix(x).measures(elements_[group], f);
    for (int r = 0; r < 9; ++r) f[r] -= rest_measures_[group][r];
}

void BendingSixTerm::strain(Index group, const double* q, SimdDouble d[9]) const {
    interior(group, q, d);
    add_edge_strains(group, q, [&](Index fold, int g) { return dihedrals_[fold][g].angle_change; }, d);
}

void BendingSixTerm::rate(Index group, const double* p, SimdDouble d[9]) const {
    SimdVec3 x[6], along[6];
    SixNodeRows rows;
    loop_.gather(group, state_.data(), x);
    loop_.gather(group, p, along);
    BendingSix(x).rows(elements_[group], rows);
    rows.along(along, d);
    add_edge_strains(group, p, [&](Index fold, int g) { return dihedrals_[fold][g].rate; }, d);
}

std::vector<std::array<double, 2>> BendingSixTerm::angle_changes_at(const double* q) const {
    std::vector<std::array<double, 2>> changes(dihedrals_.size());
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
             first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, element_block.last_dihedral);
            for (int g = 0; g < 2; ++g) {
                const SimdDouble angle = dihedrals_at(first, last, g, q).angle();
                for (Index h = first; h < last; ++h) changes[h][g] = angle_change(h, g, angle[h - first]);
            }
        }
    });
    return changes;
}

Strains BendingSixTerm::strains_at(const double* q) const {
    const std::vector<std::array<double, 2>> changes = angle_changes_at(q);
    Strains out(shell_.n_faces(), 9);
    each_group([&](Index group) {
        interior(group, q, out.at(group));
        add_edge_strains(group, q, [&](Index fold, int g) { return changes[fold][g]; }, out.at(group));
    });
    return out;
}

double BendingSixTerm::energy(const double* q, const LoadParameters&) const {
    const std::vector<std::array<double, 2>> changes = angle_changes_at(q);
    return loop_.sum([&](Index group) {
        SimdDouble d[9], stress[9];
        interior(group, q, d);
        add_edge_strains(group, q, [&](Index fold, int g) { return changes[fold][g]; }, d);
        stiffness_[group].times(d, stress);
        SimdDouble sum = d[0] * stress[0];
        for (int r = 1; r < 9; ++r) sum += d[r] * stress[r];
        return SimdDouble(0.5) * sum;
    });
}

void BendingSixTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    store_dihedrals(q);
    each_group([&](Index group) {
        SimdDouble d[9];
        strain(group, q, d);
        store_stress(group, d);
    });
    add_forces(stress_, out);
}

/// Returns dE/dtheta at a point of a dihedral stencil: the sum of the stresses whose strains depend on theta.
double BendingSixTerm::moment(const DihedralSixStencil& fold, int point, const Strains& stress) const {
    double sum = 0.0;
    if (fold.left.face >= 0) sum += stress.number(fold.left.face, 3 * fold.left.corner + point);
    if (fold.right.face >= 0) sum += stress.number(fold.right.face, 3 * fold.right.corner + 1 - point);
    return fold.weight() * sum;
}

void BendingSixTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[6], g[6];
        SixNodeRows rows;
        loop_.gather(group, state_.data(), x);
        BendingSix(x).rows(elements_[group], rows);
        rows.forces(stresses.at(group), g);
        loop_.scatter(group, g, out);
    });
    // Faces that share a rotation share an edge and hence a node, so blocks of one colour do not share
    // rotations either.
    element_blocks_.scatter([&](const ElementBlock& element_block) {
        for (Index h = element_block.first_dihedral; h < element_block.last_dihedral; ++h)
            for (int g = 0; g < 2; ++g) {
                const double m = moment(shell_.dihedrals[h], g, stresses);
                for (int a = 0; a < 9; ++a) {
                    const Index node = shell_.dihedrals[h].nodes[a];
                    if (node < 0) continue;
                    for (int c = 0; c < 3; ++c)
                        out.add(3 * node + c, m * dihedrals_[h][g].gradient[3 * a + c]);
                }
            }
        for (Index f = element_block.first; f < element_block.last; ++f)
            for (int i = 0; i < 3; ++i) {
                const FaceSideSix& side = shell_.sides[f][i];
                for (int g = 0; g < 2; ++g)
                    if (side.rotation[g] >= 0)
                        out.add(first_scalar_ + side.rotation[g], side.sign * stresses.number(f, 3 * i + g));
            }
    });
}

void BendingSixTerm::assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                              bool extrapolated_stress, SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    if (from_rest_) {
        ElementLoop<6>::over_groups(element_block, [&](Index group) { assemble_from_rest(group, q, out); });
        return;
    }
    ElementLoop<6>::over_groups(element_block, [&](Index group) { assemble_faces(group, q, stress, out); });
    for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
         first += SimdDouble::width)
        assemble_dihedrals(first, std::min(first + SimdDouble::width, element_block.last_dihedral), q, stress,
                           out);
}

void BendingSixTerm::assemble_faces(Index group, const double* q, const Strains& stress,
                                    SystemMatrix& out) const {
    SimdVec3 x[6];
    SixNodeRows rows;
    loop_.gather(group, q, x);
    const BendingSix face(x);
    face.rows(elements_[group], rows);
    // J has a row for each strain 3 i + g and a block for each node. Dihedral angles add to the rows of their edge i: to the blocks of the
    // face's own nodes, and to those of the three nodes across the edge, which are in across[i][g].
    SimdVec3 across[3][2][3] = {};
    SimdDouble sign[3] = {};
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = shell_.sides[loop_.element(group, lane)][i];
            sign[i].set(lane, side.sign);
            if (side.dihedral < 0) continue;
            const SideNodes& at = side.on_left ? left_side : right_side;
            const std::array<int, 6> own = face_order(i);
            for (int g = 0; g < 2; ++g) {
                const std::array<double, 27>& by_node = dihedrals_[side.dihedral][side.point(g)].gradient;
                const auto part = [&](int a) -> Vec3 { return side.weight * Vec3(by_node.data() + 3 * a); };
                for (int k = 0; k < 6; ++k) {
                    SimdVec3& row = rows.at[3 * i + g][own[k]];
                    set_lane(row, lane, lane_of(row, lane) + part(at.own[k]));
                }
                for (int k = 0; k < 3; ++k) set_lane(across[i][g][k], lane, part(at.beyond + k));
            }
        }
    const Symmetric9 stiffness = history_.scaled(stiffness_[group]);
    const SixNodeRows stiff = rows.times(stiffness);
    SimdMat3 h[120];
    rows.blocks(stiff, h);
    face.add_curvature(elements_[group], stress.at(group), h);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            const int row = 6 + 3 * i + k;
            for (int a = 0; a < 6; ++a)
                h[lower_index(row, a)] = outer(across[i][0][k], stiff.at[3 * i][a]) +
                                         outer(across[i][1][k], stiff.at[3 * i + 1][a]);
            for (int j = 0; j <= i; ++j) {
                // The coupling of the nodes across edge i with those across edge j.
                SimdVec3 stressed[2];
                for (int g = 0; g < 2; ++g)
                    stressed[g] = stiffness(3 * i, 3 * j + g) * across[i][0][k] +
                                  stiffness(3 * i + 1, 3 * j + g) * across[i][1][k];
                for (int l = 0; l < 3; ++l)
                    if (6 + 3 * j + l <= row)
                        h[lower_index(row, 6 + 3 * j + l)] =
                            outer(stressed[0], across[j][0][l]) + outer(stressed[1], across[j][1][l]);
            }
        }
    SimdVec3 by_rotation[6][15];  // blocks of the Hessian between rotation 2 i + g and the nodes
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g) {
            for (int a = 0; a < 6; ++a) by_rotation[2 * i + g][a] = sign[i] * stiff.at[3 * i + g][a];
            for (int j = 0; j < 3; ++j)
                for (int l = 0; l < 3; ++l)
                    by_rotation[2 * i + g][6 + 3 * j + l] =
                        sign[i] * (stiffness(3 * i + g, 3 * j) * across[j][0][l] +
                                   stiffness(3 * i + g, 3 * j + 1) * across[j][1][l]);
        }
    for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
        const Index f = loop_.element(group, lane);
        const SixNodeShell::Stencil& stencil = shell_.stencils[f];
        const FaceSlots& slots = face_slots_[f];
        scatter_blocks<15>(out, stencil.nodes, slots.nodes, h, lane);
        for (int a = 0; a < 6; ++a) {
            if (stencil.rotations[a] < 0) continue;
            for (int k = 0; k < 15; ++k)
                if (stencil.nodes[k] >= 0)
                    out.add_rotation_row(slots.rotation_nodes[a][k], out.column_length(stencil.nodes[k]),
                                         by_rotation[a][k], lane);
        }
        add_rotations(group, lane, sign, stiffness, out);
    }
}

/// Adds the blocks between the rotations of a face.
void BendingSixTerm::add_rotations(Index group, int lane, const SimdDouble sign[3],
                                   const Symmetric9& stiffness, SystemMatrix& out) const {
    const std::array<Index, 21>& slots = face_slots_[loop_.element(group, lane)].rotations;
    for (int a = 0; a < 6; ++a)
        for (int b = 0; b <= a; ++b)
            if (const Index slot = slots[lower_index(a, b)]; slot >= 0)
                out.add(slot, sign[a / 2][lane] * sign[b / 2][lane] *
                                  stiffness(3 * (a / 2) + a % 2, 3 * (b / 2) + b % 2)[lane]);
}

void BendingSixTerm::assemble_dihedrals(Index first, Index last, const double* q, const Strains& stress,
                                        SystemMatrix& out) const {
    SimdMat3 h[45] = {};
    for (int g = 0; g < 2; ++g) {
        SimdDouble moments(0.0);
        for (Index fold = first; fold < last; ++fold)
            moments.set(fold - first, moment(shell_.dihedrals[fold], g, stress));
        dihedrals_at(first, last, g, q).add_curvature(moments, h);
    }
    for (Index fold = first; fold < last; ++fold)
        scatter_blocks<9>(out, shell_.dihedrals[fold].nodes, dihedral_slots_[fold], h, fold - first);
}

// Bounds round-off as BendingTerm does: an angle is exact to one unit of round-off, or to that of the positions
// divided by the heights of the faces.
void BendingSixTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const double height = shell_.smallest_height(f);
        const double angle = 1.0 + 0.25 * (shell_.largest_coordinate(f) + beyond) / height;
        for (int r = 0; r < 9; ++r) {
            double moment = 0.0;
            for (int s = 0; s < 9; ++s)
                moment += std::abs(stiffness_[f / SimdDouble::width](r, s)[f % SimdDouble::width]) * angle;
            if (r % 3 < 2)
                if (const Index rotation = shell_.sides[f][r / 3].rotation[r % 3]; rotation >= 0)
                    out[first_scalar_ + rotation] += moment;
            for (const Index node : shell_.own_nodes[f]) out.segment<3>(3 * node).array() += moment / height;
        }
    }
}

std::size_t BendingSixTerm::bytes() const {
    return bytes_of(face_slots_) + bytes_of(dihedral_slots_) + materials_.bytes() + growth_.bytes() +
           bytes_of(rest_) + bytes_of(reference_interior_) + bytes_of(elements_) + bytes_of(rest_measures_) +
           bytes_of(stiffness_) + bytes_of_stresses() + bytes_of(dihedrals_) + bytes_of(state_) +
           loop_.bytes();
}

bool BendingSixTerm::set_values(const Values& values) {
    const bool material_changed = materials_.set_values(values), grew = growth_.set_values(values);
    if (!material_changed && !grew) return false;
    if (grew) set_natural_measures();
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            set_lane(stiffness_[group], lane, rest_[f].bending_stiffness(materials_[f]));
        }
    return true;
}

Vec9 BendingSixTerm::rest_angles(Index face) const {
    Vec9 angles = Vec9::Zero();
    for (int i = 0; i < 3; ++i) {
        const FaceSideSix& side = shell_.sides[face][i];
        for (int g = 0; g < 2 && side.dihedral >= 0; ++g)
            angles[3 * i + g] = side.weight * shell_.dihedrals[side.dihedral].rest_angle[side.point(g)];
    }
    return angles;
}

// Dihedral angles are measured from their reference values already, so `angles` is subtracted from the natural
// measures.
void BendingSixTerm::set_natural_measures() {
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix face = grown(f);
            rest_[f] = face.face();
            for (int p = 0; p < BendingSix::points; ++p)
                elements_[group].inverse_jacobian[p].set(lane, rest_[f].inverse_jacobian[p]);
            const Vec9 angles = rest_angles(f);
            const Vec9 natural = face.reference_factors().cwiseProduct(reference_interior_[f] + angles) +
                                 face.curvature_measures() - angles;
            for (int r = 0; r < 9; ++r) {
                elements_[group].scale[r].set(lane, rest_[f].scale[r]);
                rest_measures_[group][r].set(lane, natural[r]);
            }
        }
}

// Returns the gradient of by . d by growth for a fixed shape whose interior measures are `inside`.
GrownFace::ByNatural BendingSixTerm::strains_by_growth(const GrownSix& face, Index number, const Vec9& by,
                                                       const Vec9& interior) const {
    GrownFace::ByNatural found =
        face.natural_by_growth(-by, reference_interior_[number] + rest_angles(number));
    found.growth += face.interior_by_growth(by, interior);
    return found;
}

void BendingSixTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    store_rates(lambda);
    std::vector<Eigen::Vector2d> of_faces(shell_.n_faces());
    each_group([&](Index group) {
        SimdDouble d[9], along[9];
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const Eigen::Vector<double, 9> rates = lane_of<9>(along, lane);
            of_faces[f] = {rates.dot(lane_of<9>(stress_.at(group), lane)),
                           rates.dot(rest_[f].bending_by_poisson_ratio(materials_[f]) * lane_of<9>(d, lane))};
        }
    });
    for (Index f = 0; f < shell_.n_faces(); ++f)
        materials_.add_vjp(f, 3, of_faces[f][0], of_faces[f][1], out);
    if (growth_.any()) add_growth_vjp(q, lambda, out);
}

void BendingSixTerm::add_growth_vjp(const double* q, const double* lambda, Gradient& out) const {
    std::vector<GrownFace::ByNatural> by_faces(shell_.n_faces());
    each_group([&](Index group) {
        SimdVec3 x[6], p[6];
        SimdDouble now[9], along_inside[9], d[9], along[9], stresses[9];
        SixNodeRows rows;
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, p);
        const BendingSix interior(x);
        interior.measures(elements_[group], now);
        interior.rows(elements_[group], rows);
        rows.along(p, along_inside);
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        stiffness_[group].times(along, stresses);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix face = grown(f);
            GrownFace::ByNatural& by = by_faces[f];
            by = strains_by_growth(face, f, history_.factor() * lane_of<9>(stresses, lane),
                                   lane_of<9>(now, lane));
            by.growth +=
                face.bending_by_growth(materials_[f], lane_of<9>(along, lane), lane_of<9>(d, lane)) +
                face.interior_by_growth(lane_of<9>(stress_.at(group), lane), lane_of<9>(along_inside, lane));
        }
    });
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const GrownSix face = grown(f);
        growth_.add_vjp(f, face.in_world(by_faces[f].growth), face.in_world(by_faces[f].curvature), out);
    }
}

void BendingSixTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    if (!growth_.any()) return;
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6];
        SimdDouble now[9];
        loop_.gather(group, state_.data(), x);
        BendingSix(x).measures(elements_[group], now);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix face = grown(f);
            Vec9 by;
            for (int r = 0; r < 9; ++r) by[r] = stresses.number(f, r);
            const GrownFace::ByNatural found = strains_by_growth(face, f, by, lane_of<9>(now, lane));
            growth_.add_vjp(f, face.in_world(found.growth), face.in_world(found.curvature), out);
        }
    }
}

std::vector<std::array<std::array<double, 9>, 2>> BendingSixTerm::slopes_at_rest() const {
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = shell_.n_dihedrals();
    std::vector<std::array<std::array<double, 9>, 2>> slopes(n);
    for (Index first = 0; first < n; first += SimdDouble::width) {
        const Index last = std::min<Index>(first + SimdDouble::width, n);
        for (int g = 0; g < 2; ++g) {
            SimdVec3 by_node[9];
            dihedrals_at(first, last, g, q.data()).gradient(by_node);
            for (Index h = first; h < last; ++h) {
                Vec3 normal = Vec3::Zero();
                for (const DihedralStencil::Side& side :
                     {shell_.dihedrals[h].left, shell_.dihedrals[h].right})
                    if (side.face >= 0) normal += normal_of(shell_.rest[side.face]);
                normal.normalize();
                for (int a = 0; a < 9; ++a) slopes[h][g][a] = lane_of(by_node[a], h - first).dot(normal);
            }
        }
    }
    return slopes;
}

bool BendingSixTerm::add_projective_stiffness(NodeMatrix& out) const {
    const std::vector<std::array<std::array<double, 9>, 2>> slopes = slopes_at_rest();
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6];
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell_.rest[loop_.element(group, lane)][k]);
        SixNodeRows interior;
        BendingSix(x).rows(elements_[group], interior);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const Vec3 normal = normal_of(shell_.rest[f]);
            NodeRows rows(9);
            for (int r = 0; r < 9; ++r)
                for (int k = 0; k < 6; ++k)
                    rows.add(r, shell_.own_nodes[f][k], lane_of(interior.at[r][k], lane).dot(normal));
            for (int i = 0; i < 3; ++i) {
                const FaceSideSix& side = shell_.sides[f][i];
                for (int g = 0; g < 2; ++g) {
                    for (int a = 0; a < 9 && side.dihedral >= 0; ++a)
                        if (const Index node = shell_.dihedrals[side.dihedral].nodes[a]; node >= 0)
                            rows.add(3 * i + g, node, side.weight * slopes[side.dihedral][side.point(g)][a]);
                    if (side.rotation[g] < 0) continue;
                    rows.add(3 * i + g, out.point(side.rotation[g]), side.sign);
                    const std::array<Index, 6>& own = shell_.own_nodes[f];
                    out.add_adjacent_face(side.rotation[g], {own[0], own[1], own[2]});
                }
            }
            rows.add_to(out, [&](int r, int s) { return stiffness_[group](r, s)[lane]; });
        }
    }
    return true;
}

}  // namespace magshell
