#include "magshell/terms/shell/bending_term.h"

#include <cmath>

#include "magshell/assembly/dihedral_angles.h"

namespace magshell {
namespace {

// Prefetches entries of an array that a loop will read soon.
template <class Array>
void fetch(const Array& array, Index first, Index count) {
    const Index last = std::min(first + count, static_cast<Index>(array.size()));
    if (first >= last) return;
    const char *at = reinterpret_cast<const char*>(&array[first]),
               *end = reinterpret_cast<const char*>(&array[last - 1] + 1);
    for (; at < end; at += 64) __builtin_prefetch(at);
}

}  // namespace

BendingTerm::BendingTerm(const Shell& shell, Index body, const ColoredLoop& element_blocks,
                         const GrowthForm& growth, const Nodes& nodes, const SystemMatrix& matrix,
                         Registry& registry)
    : StrainScaffold(shell.n_faces()),
      shell_(shell),
      body_(body),
      element_blocks_(element_blocks),
      nodes_(nodes),
      first_scalar_(nodes.first_scalar()),
      materials_(shell, registry),
      growth_(shell.owner, shell.faces, growth, registry),
      curvature_scale_(registry.values.add(shell.owner, "curvature_scale", "1", shell.n_edges(), 1)),
      stiffness_(face_groups()),
      angle_changes_(shell.dihedrals.size()),
      rates_(shell.dihedrals.size()),
      gradients_(shell.dihedrals.size()) {
    face_slots_.reserve(shell.n_faces());
    fold_slots_.reserve(shell.dihedrals.size());
    for (const Stencil& s : shell.stencils) {
        FaceSlots& slots = face_slots_.emplace_back();
        slots.nodes = pair_slots<6>(matrix, s.nodes);
        for (int i = 0; i < 3; ++i) {
            const Index r = s.rotations[i];
            for (int k = 0; k < 6; ++k)
                slots.rotation_nodes[6 * i + k] =
                    r < 0 || s.nodes[k] < 0 ? -1 : matrix.rotation_slot(r, s.nodes[k]);
            for (int j = 0; j <= i; ++j)
                slots.rotations[lower_index(i, j)] =
                    r < 0 || s.rotations[j] < 0 ? -1 : matrix.rotations_slot(r, s.rotations[j]);
        }
    }
    for (const DihedralStencil& fold : shell.dihedrals) {
        fold_slots_.push_back(pair_slots<4>(matrix, fold.nodes));
        fold_slots_.back()[lower_index(2, 2)] = -1;  // (3, 2): the two half-planes do not meet in d2theta
    }
}

bool BendingTerm::set_values(const Values& values) {
    const bool material_changed = materials_.set_values(values), grew = growth_.set_values(values);
    if (!material_changed && !grew && !values.changed(curvature_scale_)) return false;
    curvature_scales_ = Eigen::Map<const VectorXd>(values[curvature_scale_], curvature_scale_.size());
    for (Index group = 0; group < face_groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = element_of(group, lane, shell_.n_faces());
            const Vec3 scale = scales_of(f);
            const Mat3 stiffness = rest_face(f).bending_stiffness(materials_[f]);
            const Mat3 scaled = scale.asDiagonal() * stiffness * scale.asDiagonal();
            set_lane(stiffness_[group], lane, scaled);
        }
    if (grew) find_natural_angles();
    return true;
}

RestFace BendingTerm::rest_face(Index face) const {
    return growth_.any() ? grown(face).face() : RestFace(shell_.rest_corners(face).data());
}

Vec3 BendingTerm::rest_angles(Index face) const {
    Vec3 angles = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
        const FaceSide& side = shell_.sides[face][i];
        if (side.dihedral >= 0) angles[i] = side.weight * shell_.dihedrals[side.dihedral].rest_angle;
    }
    return angles;
}

void BendingTerm::find_natural_angles() {
    std::vector<Vec3> changes(shell_.n_faces());
    for (Index f = 0; f < shell_.n_faces(); ++f) changes[f] = grown(f).natural_angle_changes(rest_angles(f));
    natural_angles_.resize(face_groups());
    for (Index group = 0; group < face_groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Vec3 of_face = shared(changes, element_of(group, lane, shell_.n_faces()));
            for (int i = 0; i < 3; ++i) natural_angles_[group][i].set(lane, of_face[i]);
        }
}

// With directors, each side of an edge has a natural angle of its own, also at a free edge. A hinge has one
// angle per edge, so it takes the mean of both sides; at a free edge it has none.
Vec3 BendingTerm::shared(const std::vector<Vec3>& of_faces, Index face) const {
    Vec3 numbers = of_faces[face];
    for (int i = 0; i < 3; ++i) {
        const FaceSide& side = shell_.sides[face][i];
        if (side.rotation >= 0) continue;
        if (side.dihedral < 0) {
            numbers[i] = 0.0;
            continue;
        }
        const DihedralStencil& fold = shell_.dihedrals[side.dihedral];
        if (!fold.right_is_point) continue;
        numbers[i] =
            0.5 * (of_faces[fold.left.face][fold.left.corner] + of_faces[fold.right.face][fold.right.corner]);
    }
    return numbers;
}

Vec3 BendingTerm::natural_angle_changes(Index face) const {
    if (natural_angles_.empty()) return Vec3::Zero();
    return lane_of(natural_angles_[face / SimdDouble::width].data(), face % SimdDouble::width);
}

void BendingTerm::add_natural_angles_vjp(const std::vector<Vec3>& by_angles, Gradient& out) const {
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const GrownFace face = grown(f);
        const GrownFace::ByNatural by = face.natural_angle_changes_vjp(rest_angles(f), shared(by_angles, f));
        growth_.add_vjp(f, face.in_world(by.growth), face.in_world(by.curvature), out);
    }
}

void BendingTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    if (!growth_.any()) return;
    std::vector<Vec3> by_angles(shell_.n_faces());
    for (Index f = 0; f < shell_.n_faces(); ++f)
        by_angles[f] = {-stresses.number(f, 0), -stresses.number(f, 1), -stresses.number(f, 2)};
    add_natural_angles_vjp(by_angles, out);
}

Vec3 BendingTerm::scales_of(Index face) const {
    const std::array<Index, 3>& e = shell_.edges[face];
    return {curvature_scales_[e[0]], curvature_scales_[e[1]], curvature_scales_[e[2]]};
}

void BendingTerm::store_dihedrals(const double* q) {
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
             first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, element_block.last_dihedral);
            const DihedralAngle fold = dihedral_angles_at(shell_, first, last, q);
            const SimdDouble angle = fold.angle();
            SimdVec3 g[4];
            fold.gradient(g);
            for (int lane = 0; lane < last - first; ++lane) {
                angle_changes_[first + lane] = angle_change(shell_.dihedrals[first + lane], angle[lane]);
                double* const gradient = gradients_[first + lane].data();
                for (int k = 0; k < 4; ++k) {
                    gradient[3 * k] = g[k].x[lane];
                    gradient[3 * k + 1] = g[k].y[lane];
                    gradient[3 * k + 2] = g[k].z[lane];
                }
            }
        }
    });
}

/// Computes the strains delta of a SIMD vector of faces from a number per dihedral stencil and the rotations in q. It
/// is linear, so it serves rates as well.
void BendingTerm::edge_strains(Index group, const double* q, const std::vector<double>& changes,
                               SimdDouble delta[3]) const {
    const auto angle_change_of = [&](Index fold) { return changes[fold]; };
    const double* rotation = q + first_scalar_;
    const SidesOfGroup sides = sides_of(group);
    for (int i = 0; i < 3; ++i)
        delta[i] =
            simd_of([&](int lane) { return bending_strain((*sides[lane])[i], angle_change_of, rotation); });
}

double BendingTerm::energy(const double* q, const LoadParameters&) const {
    std::vector<double> changes(shell_.dihedrals.size());
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
             first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, element_block.last_dihedral);
            const SimdDouble angle = dihedral_angles_at(shell_, first, last, q).angle();
            for (Index h = first; h < last; ++h)
                changes[h] = angle_change(shell_.dihedrals[h], angle[h - first]);
        }
    });
    const auto angle_change_of = [&](Index fold) { return changes[fold]; };
    const double* rotation = q + first_scalar_;
    return element_blocks_.sum([&](const ElementBlock& element_block) {
        double total = 0.0;
        for (Index f = element_block.first; f < element_block.last; ++f) {
            const Vec3 natural = natural_angle_changes(f);
            double delta[3];
            for (int i = 0; i < 3; ++i)
                delta[i] = bending_strain(shell_.sides[f][i], angle_change_of, rotation) - natural[i];
            const Symmetric3& stiffness = stiffness_[f / SimdDouble::width];
            const int lane = f % SimdDouble::width;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) total += 0.5 * delta[i] * stiffness(i, j)[lane] * delta[j];
        }
        return total;
    });
}

void BendingTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    store_dihedrals(q);
    each_group([&](Index group) {
        SimdDouble delta[3];
        strain(group, q, delta);
        store_stress(group, delta);
    });
    add_forces(stress_, out);
}

/// Returns dE/dtheta of a dihedral angle: the sum of the stresses whose strains depend on it.
double BendingTerm::moment(const DihedralStencil& fold, const Strains& stress) const {
    double sum = 0.0;
    for (const DihedralStencil::Side& side : {fold.left, fold.right})
        if (side.face >= 0) sum += stress.number(side.face, side.corner);
    return fold.weight() * sum;
}

void BendingTerm::add_forces(const Strains& stresses, Residual& out) {
    // Faces that share a rotation share an edge and hence a node, so blocks of one colour do not share
    // rotations either.
    constexpr Index ahead = 24;  // prefetch distance [dihedral stencils]
    element_blocks_.scatter([&](const ElementBlock& element_block) {
        for (Index h = element_block.first_dihedral; h < element_block.last_dihedral; ++h) {
            fetch(shell_.dihedrals, h + ahead, 1);
            fetch(gradients_, h + ahead, 1);
            const double m = moment(shell_.dihedrals[h], stresses);
            for (int k = 0; k < 4; ++k)
                for (int c = 0; c < 3; ++c)
                    out.add(3 * shell_.dihedrals[h].nodes[k] + c, m * gradients_[h][3 * k + c]);
        }
        for (Index f = element_block.first; f < element_block.last; ++f)
            for (int i = 0; i < 3; ++i) {
                const FaceSide& side = shell_.sides[f][i];
                if (side.rotation >= 0)
                    out.add(first_scalar_ + side.rotation, side.sign * stresses.number(f, i));
            }
    });
}

void BendingTerm::assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                           bool extrapolated_stress, SystemMatrix& out) const {
    FaceLoop::over_groups(element_block, [&](Index group) { assemble_faces(group, out); });
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    for (Index first = element_block.first_dihedral; first < element_block.last_dihedral;
         first += SimdDouble::width)
        assemble_dihedrals(first, std::min(first + SimdDouble::width, element_block.last_dihedral), q, stress,
                           out);
}

void BendingTerm::assemble_faces(Index group, SystemMatrix& out) const {
    const Index next = SimdDouble::width * (group + 1);
    fetch(face_slots_, next, SimdDouble::width);
    fetch(shell_.sides, next, SimdDouble::width);
    fetch(shell_.stencils, next, SimdDouble::width);
    fetch(stiffness_, group + 1, 1);
    BendingFace face;
    const SidesOfGroup sides = sides_of(group);
    for (int i = 0; i < 3; ++i) {
        static constexpr std::array<double, 12> nothing = {};
        // For the right face of an edge, the first two nodes of the stencil are swapped, and so are its last
        // two.
        const double* gradient[SimdDouble::width];
        int swap[SimdDouble::width];
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const FaceSide& side = (*sides[lane])[i];
            gradient[lane] = (side.dihedral < 0 ? nothing : gradients_[side.dihedral]).data();
            swap[lane] = side.on_left ? 0 : 3;
        }
        face.sign[i] = simd_of([&](int lane) { return (*sides[lane])[i].sign; });
        const SimdDouble weight = simd_of([&](int lane) { return (*sides[lane])[i].weight; });
        face.corner[i][(i + 1) % 3] =
            weight * vectors_of([&](int lane) { return gradient[lane] + swap[lane]; });
        face.corner[i][(i + 2) % 3] =
            weight * vectors_of([&](int lane) { return gradient[lane] + 3 - swap[lane]; });
        face.corner[i][i] = weight * vectors_of([&](int lane) { return gradient[lane] + 6 + swap[lane]; });
        face.beyond[i] = weight * vectors_of([&](int lane) { return gradient[lane] + 9 - swap[lane]; });
    }
    SimdMat3 blocks[21];
    SimdVec3 stiff_corner[3][3], rows[3][6];
    const Symmetric3 stiffness = history_.scaled(stiffness_[group]);
    face.node_blocks(stiffness, blocks, stiff_corner);
    const bool directors = shell_.n_rotations() > 0;
    if (directors) face.rotation_rows(stiffness, stiff_corner, rows);

    const int lanes = std::min(SimdDouble::width, shell_.n_faces() - group * SimdDouble::width);
    for (int lane = 0; lane < lanes; ++lane) {
        const Index f = group * SimdDouble::width + lane;
        const Stencil& stencil = shell_.stencils[f];
        const FaceSlots& slots = face_slots_[f];
        scatter_blocks<6>(out, stencil.nodes, slots.nodes, blocks, lane);
        if (!directors) continue;
        for (int i = 0; i < 3; ++i) {
            if (stencil.rotations[i] < 0) continue;
            for (int k = 0; k < 6; ++k)
                if (stencil.nodes[k] >= 0)
                    out.add_rotation_row(slots.rotation_nodes[6 * i + k], out.column_length(stencil.nodes[k]),
                                         rows[i][k], lane);
            for (int j = 0; j <= i; ++j)
                if (stencil.rotations[j] >= 0)
                    out.add(slots.rotations[lower_index(i, j)],
                            face.sign[i][lane] * face.sign[j][lane] * stiffness(i, j)[lane]);
        }
    }
}

void BendingTerm::assemble_dihedrals(Index first, Index last, const double* q, const Strains& stress,
                                     SystemMatrix& out) const {
    const SimdDouble moments =
        simd_of([&](int lane) { return moment(shell_.dihedrals[std::min(first + lane, last - 1)], stress); });
    const DihedralHessian curvature(dihedral_angles_at(shell_, first, last, q), moments);
    for (Index h = first; h < last; ++h)
        scatter_blocks<4>(out, shell_.dihedrals[h].nodes, fold_slots_[h], curvature.block, h - first);
}

void BendingTerm::store_rates(const double* p) {
    element_blocks_.each([&](const ElementBlock& element_block) {
        for (Index h = element_block.first_dihedral; h < element_block.last_dihedral; ++h) {
            rates_[h] = 0.0;
            for (int k = 0; k < 4; ++k)
                for (int c = 0; c < 3; ++c)
                    rates_[h] += gradients_[h][3 * k + c] * p[3 * shell_.dihedrals[h].nodes[k] + c];
        }
    });
}

template <class Body>
void BendingTerm::each_face(const double* q, const double* lambda, const Body& body) {
    each_group([&](Index group) {
        SimdDouble strains[3], rates[3], stress_rates[3];
        strain(group, q, strains);
        history_.apply(group, strains);
        rate(group, lambda, rates);
        stiffness_[group].times(rates, stress_rates);
        for (Index f = group * SimdDouble::width;
             f < std::min((group + 1) * SimdDouble::width, shell_.n_faces()); ++f) {
            const int lane = f % SimdDouble::width;
            body(f, lane_of(strains, lane), lane_of(rates, lane), lane_of(stress_rates, lane));
        }
    });
}

// Gradient with respect to the parameters. With C = S C~ S and S the curvature scales of the edges, dC/ds_i s_i = e_i e_i^T
// C + C e_i e_i^T.
void BendingTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    store_rates(lambda);
    std::vector<Vec3> by_scale(shell_.n_faces());
    each_face(q, lambda, [&](Index f, const Vec3& d, const Vec3& rates, const Vec3& stress_rates) {
        const Vec3 scale = scales_of(f),
                   stress = lane_of(stress_.at(f / SimdDouble::width), f % SimdDouble::width);
        const Mat3 by_poisson_ratio = rest_face(f).bending_by_poisson_ratio(materials_[f]);
        materials_.add_vjp(f, 3, rates.dot(stress),
                           rates.cwiseProduct(scale).dot(by_poisson_ratio * scale.cwiseProduct(d)), out);
        by_scale[f] = (rates.cwiseProduct(stress) + d.cwiseProduct(stress_rates)).cwiseQuotient(scale);
    });
    if (growth_.any()) {
        const std::vector<ByRestFace> by_faces = by_rest_faces(q, lambda);
        std::vector<Vec3> by_angles(by_faces.size());
        for (Index f = 0; f < shell_.n_faces(); ++f) {
            growth_.add_vjp(f, by_faces[f].growth, Mat3::Zero(), out);
            by_angles[f] = by_faces[f].angles;
        }
        add_natural_angles_vjp(by_angles, out);
    }
    for (Index f = 0; f < shell_.n_faces(); ++f)
        for (int i = 0; i < 3; ++i) out.values[curvature_scale_.at(shell_.edges[f][i])] += by_scale[f][i];
}

std::vector<BendingTerm::ByRestFace> BendingTerm::by_rest_faces(const double* q, const double* lambda) {
    store_rates(lambda);
    std::vector<ByRestFace> found(shell_.n_faces());
    each_face(q, lambda, [&](Index f, const Vec3& d, const Vec3& rates, const Vec3& stress_rates) {
        const Vec3 scale = scales_of(f);
        const GrownFace face = grown(f);
        const GrownTriangle& triangle = face.triangle();
        const auto by_growth_of = [&](const GrownTriangle& of) {
            return of.bending_by_growth(materials_[f], scale.cwiseProduct(rates), scale.cwiseProduct(d));
        };
        found[f].growth = found[f].deformation = face.in_world(by_growth_of(triangle));
        if (growth_.any())
            found[f].deformation = face.in_world(triangle.from_natural(by_growth_of(triangle.natural())));
        found[f].angles = -history_.factor() * stress_rates;
    });
    return found;
}

// Bounds round-off. A dihedral angle is exact to about one unit of round-off of a radian, or to that of the
// positions divided by the heights of its faces. Its moments are forces at the corners, divided by the same
// heights.
void BendingTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const double height = shell_.smallest_height(f);
        const double angle = 1.0 + 0.25 * (shell_.largest_coordinate(f) + beyond) / height;
        for (int i = 0; i < 3; ++i) {
            const FaceSide& side = shell_.sides[f][i];
            double moment = 0.0;
            for (int j = 0; j < 3; ++j)
                moment += std::abs(stiffness_[f / SimdDouble::width](i, j)[f % SimdDouble::width]) * angle;
            if (side.rotation >= 0) out[first_scalar_ + side.rotation] += moment;
            for (const Index corner : shell_.corners[f])
                out.segment<3>(3 * corner).array() += moment / height;
        }
    }
}

std::size_t BendingTerm::bytes() const {
    return bytes_of(face_slots_) + bytes_of(fold_slots_) + materials_.bytes() + growth_.bytes() +
           bytes_of(stiffness_) + bytes_of(natural_angles_) + bytes_of_stresses() + bytes_of(angle_changes_) +
           bytes_of(rates_) + bytes_of(gradients_);
}

}  // namespace magshell
