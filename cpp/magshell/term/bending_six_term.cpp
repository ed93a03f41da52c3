#include "magshell/term/bending_six_term.h"

#include <cmath>
#include <numbers>

#include "magshell/term/side_nodes.h"

namespace magshell {

BendingSixTerm::BendingSixTerm(const SixNodeShell& sheet, Index body, const ChunkLoop& chunks,
                               const Nodes& nodes, const GrowthForm& growth, const SystemMatrix& matrix,
                               Registry& registry)
    : StrainScaffold(sheet.n_faces()),
      sheet_(sheet),
      body_(body),
      nodes_(nodes),
      first_scalar_(nodes.first_scalar()),
      chunks_(chunks),
      loop_(sheet.own_nodes, chunks, matrix),
      materials_(sheet.owner, sheet.faces, registry),
      growth_(sheet.owner, sheet.faces, growth, registry),
      rest_(sheet.rest.begin(), sheet.rest.end()),
      elements_(loop_.packs()),
      rest_measures_(loop_.packs()),
      stiffness_(loop_.packs()),
      folds_(sheet.dihedrals.size()) {
    for (Index pack = 0; pack < loop_.packs(); ++pack) {
        Pack3 x[6];
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.element(pack, lane);
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, sheet.rest[f][k]);
            for (int p = 0; p < BendingSix::points; ++p)
                elements_[pack].inverse_jacobian[p].set(lane, rest_[f].inverse_jacobian[p]);
            for (int r = 0; r < 9; ++r) elements_[pack].scale[r].set(lane, rest_[f].scale[r]);
        }
        BendingSix(x).measures(elements_[pack], rest_measures_[pack].data());
    }
    if (growth_.any())
        for (Index f = 0; f < sheet.n_faces(); ++f)
            rest_inside_.push_back(lane_of<9>(rest_measures_[f / Pack::width].data(), f % Pack::width));
    for (const SixNodeShell::Stencil& s : sheet.stencils) {
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
    for (const DihedralSixStencil& fold : sheet.dihedrals) {
        PairSlots<9>& slots = fold_slots_.emplace_back(pair_slots<9>(matrix, fold.nodes));
        for (int a = 6; a < 9; ++a)  // the two wings do not meet in d2theta
            for (int b = 3; b < 6; ++b) slots[lower_index(a - 1, b)] = -1;
    }
}

FoldSix BendingSixTerm::dihedral_angles_at(Index first, Index last, int point, const double* q) const {
    Pack3 x[9] = {};
    Pack right_is_face(0.0);
    for (int lane = 0; lane < Pack::width; ++lane) {
        const DihedralSixStencil& fold = sheet_.dihedrals[std::min(first + lane, last - 1)];
        for (int a = 0; a < 9; ++a)
            if (fold.nodes[a] >= 0) set_lane(x[a], lane, q + 3 * fold.nodes[a]);
        right_is_face.set(lane, fold.right_is_face ? 1.0 : 0.0);
    }
    return FoldSix(x, right_is_face, point);
}

double BendingSixTerm::angle_change(Index fold, int point, double angle) const {
    return std::remainder(angle - sheet_.dihedrals[fold].rest_angle[point], 2.0 * std::numbers::pi);
}

void BendingSixTerm::store_folds(const double* q) {
    state_.assign(q, q + 3 * nodes_.n_nodes());
    chunks_.each([&](const Chunk& chunk) {
        for (Index first = chunk.first_dihedral; first < chunk.last_dihedral; first += Pack::width) {
            const Index last = std::min(first + Pack::width, chunk.last_dihedral);
            for (int g = 0; g < 2; ++g) {
                const FoldSix fold = dihedral_angles_at(first, last, g, q);
                const Pack angle = fold.angle();
                Pack3 by_node[9];
                fold.gradient(by_node);
                for (int lane = 0; lane < last - first; ++lane) {
                    FoldState& state = folds_[first + lane][g];
                    state.turn = angle_change(first + lane, g, angle[lane]);
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
    chunks_.each([&](const Chunk& chunk) {
        for (Index h = chunk.first_dihedral; h < chunk.last_dihedral; ++h)
            for (FoldState& state : folds_[h]) {
                state.rate = 0.0;
                for (int a = 0; a < 9; ++a) {
                    const Index node = sheet_.dihedrals[h].nodes[a];
                    if (node < 0) continue;
                    for (int c = 0; c < 3; ++c) state.rate += state.gradient[3 * a + c] * p[3 * node + c];
                }
            }
    });
}

/// Adds what the edges of a pack of faces measure, from a number turn(fold, point) and the rotations in q; linear.
template <class Turn>
void BendingSixTerm::measure(Index pack, const double* q, const Turn& turn, Pack d[9]) const {
    const double* rotation = q + first_scalar_;
    for (int lane = 0; lane < Pack::width; ++lane)
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = sheet_.sides[loop_.element(pack, lane)][i];
            for (int g = 0; g < 2; ++g) {
                double delta = side.dihedral < 0 ? 0.0 : side.weight * turn(side.dihedral, side.point(g));
                if (side.rotation[g] >= 0) delta += side.sign * rotation[side.rotation[g]];
                d[3 * i + g].set(lane, d[3 * i + g][lane] + delta);
            }
        }
}

void BendingSixTerm::inside(Index pack, const double* q, Pack f[9]) const {
    Pack3 x[6];
    loop_.gather(pack, q, x);
    BendingSix(x).measures(elements_[pack], f);
    for (int r = 0; r < 9; ++r) f[r] -= rest_measures_[pack][r];
}

void BendingSixTerm::strain(Index pack, const double* q, Pack d[9]) const {
    inside(pack, q, d);
    measure(pack, q, [&](Index fold, int g) { return folds_[fold][g].turn; }, d);
}

void BendingSixTerm::rate(Index pack, const double* p, Pack d[9]) const {
    Pack3 x[6], along[6];
    SixNodeRows rows;
    loop_.gather(pack, state_.data(), x);
    loop_.gather(pack, p, along);
    BendingSix(x).rows(elements_[pack], rows);
    rows.along(along, d);
    measure(pack, p, [&](Index fold, int g) { return folds_[fold][g].rate; }, d);
}

std::vector<std::array<double, 2>> BendingSixTerm::turns_at(const double* q) const {
    std::vector<std::array<double, 2>> turns(folds_.size());
    chunks_.each([&](const Chunk& chunk) {
        for (Index first = chunk.first_dihedral; first < chunk.last_dihedral; first += Pack::width) {
            const Index last = std::min(first + Pack::width, chunk.last_dihedral);
            for (int g = 0; g < 2; ++g) {
                const Pack angle = dihedral_angles_at(first, last, g, q).angle();
                for (Index h = first; h < last; ++h) turns[h][g] = angle_change(h, g, angle[h - first]);
            }
        }
    });
    return turns;
}

Strains BendingSixTerm::look(const double* q) const {
    const std::vector<std::array<double, 2>> turns = turns_at(q);
    Strains out(sheet_.n_faces(), 9);
    each_pack([&](Index pack) {
        inside(pack, q, out.at(pack));
        measure(pack, q, [&](Index fold, int g) { return turns[fold][g]; }, out.at(pack));
    });
    return out;
}

double BendingSixTerm::energy(const double* q, const Controls&) const {
    const std::vector<std::array<double, 2>> turns = turns_at(q);
    return loop_.sum([&](Index pack) {
        Pack d[9], stress[9];
        inside(pack, q, d);
        measure(pack, q, [&](Index fold, int g) { return turns[fold][g]; }, d);
        stiffness_[pack].times(d, stress);
        Pack sum = d[0] * stress[0];
        for (int r = 1; r < 9; ++r) sum += d[r] * stress[r];
        return Pack(0.5) * sum;
    });
}

void BendingSixTerm::evaluate(const double* q, const Controls&, Residual& out) {
    store_folds(q);
    each_pack([&](Index pack) {
        Pack d[9];
        strain(pack, q, d);
        keep_stress(pack, d);
    });
    add_forces(stress_, out);
}

/// dE/dtheta at a point of a fold: what the strains that it enters are worth.
double BendingSixTerm::moment(const DihedralSixStencil& fold, int point, const Strains& stress) const {
    double sum = 0.0;
    if (fold.left.face >= 0) sum += stress.number(fold.left.face, 3 * fold.left.corner + point);
    if (fold.right.face >= 0) sum += stress.number(fold.right.face, 3 * fold.right.corner + 1 - point);
    return fold.weight() * sum;
}

void BendingSixTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[6], g[6];
        SixNodeRows rows;
        loop_.gather(pack, state_.data(), x);
        BendingSix(x).rows(elements_[pack], rows);
        rows.forces(stresses.at(pack), g);
        loop_.scatter(pack, g, out);
    });
    // Faces that share a rotation share an edge and so a node: chunks of one colour meet at no rotation either.
    chunks_.scatter([&](const Chunk& chunk) {
        for (Index h = chunk.first_dihedral; h < chunk.last_dihedral; ++h)
            for (int g = 0; g < 2; ++g) {
                const double m = moment(sheet_.dihedrals[h], g, stresses);
                for (int a = 0; a < 9; ++a) {
                    const Index node = sheet_.dihedrals[h].nodes[a];
                    if (node < 0) continue;
                    for (int c = 0; c < 3; ++c) out.add(3 * node + c, m * folds_[h][g].gradient[3 * a + c]);
                }
            }
        for (Index f = chunk.first; f < chunk.last; ++f)
            for (int i = 0; i < 3; ++i) {
                const FaceSideSix& side = sheet_.sides[f][i];
                for (int g = 0; g < 2; ++g)
                    if (side.rotation[g] >= 0)
                        out.add(first_scalar_ + side.rotation[g], side.sign * stresses.number(f, 3 * i + g));
            }
    });
}

void BendingSixTerm::assemble(const Chunk& chunk, const double* q, const Controls&, bool extrapolated_stress,
                              SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    if (from_rest_) {
        ElementLoop<6>::over_packs(chunk, [&](Index pack) { assemble_from_rest(pack, q, out); });
        return;
    }
    ElementLoop<6>::over_packs(chunk, [&](Index pack) { assemble_faces(pack, q, stress, out); });
    for (Index first = chunk.first_dihedral; first < chunk.last_dihedral; first += Pack::width)
        assemble_folds(first, std::min(first + Pack::width, chunk.last_dihedral), q, stress, out);
}

void BendingSixTerm::assemble_faces(Index pack, const double* q, const Strains& stress,
                                    SystemMatrix& out) const {
    Pack3 x[6];
    SixNodeRows rows;
    loop_.gather(pack, q, x);
    const BendingSix face(x);
    face.rows(elements_[pack], rows);
    // Folds add to the rows of their edge: to the face's own nodes, and to the three beyond.
    Pack3 beyond[3][2][3] = {};
    Pack sign[3] = {};
    for (int lane = 0; lane < Pack::width; ++lane)
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = sheet_.sides[loop_.element(pack, lane)][i];
            sign[i].set(lane, side.sign);
            if (side.dihedral < 0) continue;
            const SideNodes& at = side.on_left ? left_side : right_side;
            const std::array<int, 6> own = face_order(i);
            for (int g = 0; g < 2; ++g) {
                const std::array<double, 27>& by_node = folds_[side.dihedral][side.point(g)].gradient;
                const auto part = [&](int a) -> Vec3 { return side.weight * Vec3(by_node.data() + 3 * a); };
                for (int k = 0; k < 6; ++k) {
                    Pack3& row = rows.at[3 * i + g][own[k]];
                    set_lane(row, lane, lane_of(row, lane) + part(at.own[k]));
                }
                for (int k = 0; k < 3; ++k) set_lane(beyond[i][g][k], lane, part(at.beyond + k));
            }
        }
    const Symmetric9 stiffness = history_.scaled(stiffness_[pack]);
    const SixNodeRows stiff = rows.times(stiffness);
    Pack33 h[120];
    rows.blocks(stiff, h);
    face.add_curvature(elements_[pack], stress.at(pack), h);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            const int row = 6 + 3 * i + k;
            for (int a = 0; a < 6; ++a)
                h[lower_index(row, a)] = outer(beyond[i][0][k], stiff.at[3 * i][a]) +
                                         outer(beyond[i][1][k], stiff.at[3 * i + 1][a]);
            for (int j = 0; j <= i; ++j) {
                // What the nodes beyond edge i feel of those beyond edge j.
                Pack3 felt[2];
                for (int g = 0; g < 2; ++g)
                    felt[g] = stiffness(3 * i, 3 * j + g) * beyond[i][0][k] +
                              stiffness(3 * i + 1, 3 * j + g) * beyond[i][1][k];
                for (int l = 0; l < 3; ++l)
                    if (6 + 3 * j + l <= row)
                        h[lower_index(row, 6 + 3 * j + l)] =
                            outer(felt[0], beyond[j][0][l]) + outer(felt[1], beyond[j][1][l]);
            }
        }
    Pack3 beside[6][15];  // rotation 2 i + g against the nodes
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g) {
            for (int a = 0; a < 6; ++a) beside[2 * i + g][a] = sign[i] * stiff.at[3 * i + g][a];
            for (int j = 0; j < 3; ++j)
                for (int l = 0; l < 3; ++l)
                    beside[2 * i + g][6 + 3 * j + l] =
                        sign[i] * (stiffness(3 * i + g, 3 * j) * beyond[j][0][l] +
                                   stiffness(3 * i + g, 3 * j + 1) * beyond[j][1][l]);
        }
    for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
        const Index f = loop_.element(pack, lane);
        const SixNodeShell::Stencil& stencil = sheet_.stencils[f];
        const FaceSlots& slots = face_slots_[f];
        scatter_blocks<15>(out, stencil.nodes, slots.nodes, h, lane);
        for (int a = 0; a < 6; ++a) {
            if (stencil.rotations[a] < 0) continue;
            for (int k = 0; k < 15; ++k)
                if (stencil.nodes[k] >= 0)
                    out.add_rotation_row(slots.rotation_nodes[a][k], out.column_length(stencil.nodes[k]),
                                         beside[a][k], lane);
        }
        add_rotations(pack, lane, sign, stiffness, out);
    }
}

/// What the rotations of a face feel of each other.
void BendingSixTerm::add_rotations(Index pack, int lane, const Pack sign[3], const Symmetric9& stiffness,
                                   SystemMatrix& out) const {
    const std::array<Index, 21>& slots = face_slots_[loop_.element(pack, lane)].rotations;
    for (int a = 0; a < 6; ++a)
        for (int b = 0; b <= a; ++b)
            if (const Index slot = slots[lower_index(a, b)]; slot >= 0)
                out.add(slot, sign[a / 2][lane] * sign[b / 2][lane] *
                                  stiffness(3 * (a / 2) + a % 2, 3 * (b / 2) + b % 2)[lane]);
}

void BendingSixTerm::assemble_folds(Index first, Index last, const double* q, const Strains& stress,
                                    SystemMatrix& out) const {
    Pack33 h[45] = {};
    for (int g = 0; g < 2; ++g) {
        Pack moments(0.0);
        for (Index fold = first; fold < last; ++fold)
            moments.set(fold - first, moment(sheet_.dihedrals[fold], g, stress));
        dihedral_angles_at(first, last, g, q).add_curvature(moments, h);
    }
    for (Index fold = first; fold < last; ++fold)
        scatter_blocks<9>(out, sheet_.dihedrals[fold].nodes, fold_slots_[fold], h, fold - first);
}

// As for triangles of three nodes: angles are exact to a unit of round-off, or as the positions over the heights.
void BendingSixTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < sheet_.n_faces(); ++f) {
        const double height = sheet_.smallest_height(f);
        const double angle = 1.0 + 0.25 * (sheet_.largest_coordinate(f) + beyond) / height;
        for (int r = 0; r < 9; ++r) {
            double moment = 0.0;
            for (int s = 0; s < 9; ++s)
                moment += std::abs(stiffness_[f / Pack::width](r, s)[f % Pack::width]) * angle;
            if (r % 3 < 2)
                if (const Index rotation = sheet_.sides[f][r / 3].rotation[r % 3]; rotation >= 0)
                    out[first_scalar_ + rotation] += moment;
            for (const Index node : sheet_.own_nodes[f]) out.segment<3>(3 * node).array() += moment / height;
        }
    }
}

std::size_t BendingSixTerm::bytes() const {
    return bytes_of(face_slots_) + bytes_of(fold_slots_) + materials_.bytes() + growth_.bytes() +
           bytes_of(rest_) + bytes_of(rest_inside_) + bytes_of(elements_) + bytes_of(rest_measures_) +
           bytes_of(stiffness_) + bytes_of_stresses() + bytes_of(folds_) + bytes_of(state_) + loop_.bytes();
}

}  // namespace magshell
