// What Projective Dynamics has in the place of a sheet's bending stiffness: J^T C J at rest with slopes of folds along their
// normals alone, taken for all three directions. Edge rotations have no place in it.
#include "magshell/assembly/folds.h"
#include "magshell/term/bending_term.h"

namespace magshell {

std::vector<std::array<double, 4>> BendingTerm::slopes_at_rest() const {
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = sheet_.n_folds();
    std::vector<std::array<double, 4>> slopes(n);
    for (Index first = 0; first < n; first += Pack::width) {
        const Index last = std::min<Index>(first + Pack::width, n);
        Pack3 g[4];
        folds_at(sheet_, first, last, q.data()).gradient(g);
        for (int lane = 0; lane < last - first; ++lane) {
            std::array<Vec3, 4> gradient;
            for (int k = 0; k < 4; ++k) gradient[k] = Vec3(g[k].x[lane], g[k].y[lane], g[k].z[lane]);
            const Vec3 normal = (gradient[2].normalized() + gradient[3].normalized()).normalized();
            for (int k = 0; k < 4; ++k) slopes[first + lane][k] = gradient[k].dot(normal);
        }
    }
    return slopes;
}

bool BendingTerm::add_surrogate(NodeMatrix& out) const {
    const std::vector<std::array<double, 4>> slopes = slopes_at_rest();
    struct Entry {
        Index node;
        double slope;
        int side;
    };
    for (Index f = 0; f < sheet_.n_faces(); ++f) {
        const Symmetric3& stiffness = stiffness_[f / Pack::width];
        const int lane = f % Pack::width;
        std::vector<Entry> entries;
        for (int i = 0; i < 3; ++i) {
            const FaceSide& side = sheet_.sides[f][i];
            for (int k = 0; k < 4 && side.fold >= 0; ++k)
                entries.push_back({sheet_.folds[side.fold].nodes[k],
                                   static_cast<double>(side.weight) * slopes[side.fold][k], i});
        }
        for (std::size_t a = 0; a < entries.size(); ++a)
            for (std::size_t b = 0; b <= a; ++b) {
                const double value =
                    stiffness(entries[a].side, entries[b].side)[lane] * entries[a].slope * entries[b].slope;
                if (a == b)
                    out.add_diagonal(entries[a].node, value);
                else
                    out.add_pair(entries[a].node, entries[b].node, value);
            }
    }
    return true;
}

}  // namespace magshell
