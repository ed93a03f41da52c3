// The gradient of the bending energy by rest positions. These functions have a file of their own for the reason that
// bending_projective.cpp gives.
#include <utility>

#include "magshell/assembly/dihedral_angles.h"
#include "magshell/energy/rest_corners.h"
#include "magshell/terms/shell/bending_term.h"

namespace magshell {

void BendingTerm::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) {
    const std::vector<ByRestFace> by_faces = by_rest_faces(q, lambda);
    std::vector<Vec3> by_angles(by_faces.size());
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const RestShape shape(shell_.rest_corners(f));
        add_by_rest_corners(shape, by_faces[f].deformation, shell_.corners[f], out);
        if (growth_.any())
            add_by_rest_plane(shape, by_faces[f].growth, growth_.growth(f), shell_.corners[f], out);
        by_angles[f] = by_faces[f].angles;
    }
    add_rest_angles_vjp(std::move(by_angles), out);
}

void BendingTerm::add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const {
    std::vector<Vec3> by_angles(shell_.n_faces());
    for (Index f = 0; f < shell_.n_faces(); ++f)
        by_angles[f] = {-stresses.number(f, 0), -stresses.number(f, 1), -stresses.number(f, 2)};
    add_rest_angles_vjp(std::move(by_angles), out);
}

// A side has the angle weight theta~ of its dihedral angle at rest, changed by growth and natural curvature.
void BendingTerm::add_rest_angles_vjp(std::vector<Vec3> by_angles, VectorXd& out) const {
    if (growth_.any()) {
        std::vector<Vec3> by_grown(by_angles.size());
        for (Index f = 0; f < shell_.n_faces(); ++f) by_grown[f] = shared(by_angles, f);
        for (Index f = 0; f < shell_.n_faces(); ++f) {
            const RestShape shape(shell_.rest_corners(f));
            const GrownFace face = grown(f);
            const Vec3 angles = rest_angles(f);
            const GrownFace::ByRest by = face.natural_angle_changes_by_rest(angles, by_grown[f]);
            const GrownFace::ByNatural by_natural = face.natural_angle_changes_vjp(angles, by_grown[f]);
            add_by_rest_corners(shape, face.in_world(by.deformation), shell_.corners[f], out);
            add_by_rest_plane(shape, face.in_world(by_natural.growth), growth_.growth(f), shell_.corners[f],
                              out);
            add_by_rest_plane(shape, face.in_world(by_natural.curvature), growth_.curvature(f),
                              shell_.corners[f], out);
            by_angles[f] += by.angles;
        }
    }
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = shell_.n_dihedrals();
    for (Index first = 0; first < n; first += SimdDouble::width) {
        const Index last = std::min<Index>(first + SimdDouble::width, n);
        SimdVec3 g[4];
        dihedral_angles_at(shell_, first, last, q.data()).gradient(g);
        for (int lane = 0; lane < last - first; ++lane) {
            const DihedralStencil& fold = shell_.dihedrals[first + lane];
            double by_angle = 0.0;
            for (const DihedralStencil::Side& side : {fold.left, fold.right})
                if (side.face >= 0) by_angle += by_angles[side.face][side.corner];
            for (int k = 0; k < 4; ++k)
                out.segment<3>(3 * fold.nodes[k]) +=
                    fold.weight() * by_angle * Vec3(g[k].x[lane], g[k].y[lane], g[k].z[lane]);
        }
    }
}

}  // namespace magshell
