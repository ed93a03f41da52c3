// Gives the bending stiffness of Projective Dynamics: the constant matrix J^T C J at rest, where J keeps of each
// dihedral angle's gradient only the slope along the hinge's normal, applied to all three directions alike.
// These functions have a file of their own because a further call of dihedral_angles_at in bending_term.cpp stops the
// compiler from inlining it in the energy, which costs time and changes the last bit of results.
#include "magshell/assembly/dihedral_angles.h"
#include "magshell/terms/shell/bending_term.h"

namespace magshell {

std::vector<std::array<double, 4>> BendingTerm::slopes_at_rest() const {
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = shell_.n_dihedrals();
    std::vector<std::array<double, 4>> slopes(n);
    for (Index first = 0; first < n; first += SimdDouble::width) {
        const Index last = std::min<Index>(first + SimdDouble::width, n);
        SimdVec3 g[4];
        dihedral_angles_at(shell_, first, last, q.data()).gradient(g);
        for (int lane = 0; lane < last - first; ++lane) {
            std::array<Vec3, 4> gradient;
            for (int k = 0; k < 4; ++k) gradient[k] = Vec3(g[k].x[lane], g[k].y[lane], g[k].z[lane]);
            const Vec3 normal = (gradient[2].normalized() + gradient[3].normalized()).normalized();
            for (int k = 0; k < 4; ++k) slopes[first + lane][k] = gradient[k].dot(normal);
        }
    }
    return slopes;
}

bool BendingTerm::add_projective_stiffness(NodeMatrix& out) const {
    const std::vector<std::array<double, 4>> slopes = slopes_at_rest();
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const Symmetric3& stiffness = stiffness_[f / SimdDouble::width];
        NodeRows rows(3);
        for (int i = 0; i < 3; ++i) {
            const FaceSide& side = shell_.sides[f][i];
            for (int k = 0; k < 4 && side.dihedral >= 0; ++k)
                rows.add(i, shell_.dihedrals[side.dihedral].nodes[k],
                         static_cast<double>(side.weight) * slopes[side.dihedral][k]);
            if (side.rotation < 0) continue;
            rows.add(i, out.point(side.rotation), side.sign);
            out.add_adjacent_face(side.rotation, shell_.corners[f]);
        }
        rows.add_to(out, [&](int r, int s) { return stiffness(r, s)[f % SimdDouble::width]; });
    }
    return true;
}

}  // namespace magshell
