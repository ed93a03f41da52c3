#include "magshell/scene/principal_strains.h"

#include <cmath>

#include "magshell/scene/creased_edges.h"
#include "magshell/scene/shell_loops.h"
#include "magshell/scene/shell_stresses.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/membrane_term.h"

namespace magshell {
namespace {

using shell_loops::angle_changes;
using shell_loops::over_blocks;

/// A symmetric 2 x 2 tensor in each lane.
struct Tensor2 {
    SimdDouble xx, xy, yy;

    void principal(SimdDouble& larger, SimdDouble& smaller) const {
        const SimdDouble middle = SimdDouble(0.5) * (xx + yy), half = SimdDouble(0.5) * (xx - yy);
        const SimdDouble radius = sqrt(half * half + xy * xy);
        larger = middle + radius;
        smaller = middle - radius;
    }
};

/// A face at rest in axes of its own: x0 at the origin, x1 = (along, 0), x2 = (across, height).
struct FlatFace {
    SimdDouble along, across, height;

    explicit FlatFace(const SimdVec3 rest[3]) {
        const SimdVec3 d1 = rest[1] - rest[0], d2 = rest[2] - rest[0];
        along = sqrt(squared_norm(d1));
        across = dot(d1, d2) / along;
        height = sqrt(squared_norm(cross(d1, d2))) / along;
    }

    /// Returns Green's strain from the change of the inner products of its two edges at x0.
    Tensor2 green(const SimdVec3 rest[3], const SimdVec3 x[3]) const {
        const SimdVec3 d1 = rest[1] - rest[0], d2 = rest[2] - rest[0], e1 = x[1] - x[0], e2 = x[2] - x[0];
        const SimdDouble c11 = squared_norm(e1) - squared_norm(d1), c12 = dot(e1, e2) - dot(d1, d2),
                         c22 = squared_norm(e2) - squared_norm(d2);
        const SimdDouble slant = across / along, half(0.5);
        return {half * c11 / (along * along), half * (c12 - slant * c11) / (along * height),
                half * (c22 - SimdDouble(2.0) * slant * c12 + slant * slant * c11) / (height * height)};
    }

    /// Returns the curvature from the bending strains of the edges. Edge i is opposite corner i: t~ = (y, -x) for an edge (x, y).
    Tensor2 curvature(const SimdDouble delta[3]) const {
        const SimdDouble x[3] = {across - along, -across, along}, y[3] = {height, -height, SimdDouble(0.0)};
        const SimdDouble inverse_area = SimdDouble(2.0) / (along * height);
        Tensor2 sum{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
        for (int i = 0; i < 3; ++i) {
            const SimdDouble weight = delta[i] * inverse_area / sqrt(x[i] * x[i] + y[i] * y[i]);
            sum.xx += weight * y[i] * y[i];
            sum.xy -= weight * x[i] * y[i];
            sum.yy += weight * x[i] * x[i];
        }
        return sum;
    }
};

// Computes the rows of one shell, whose first face has row first_row.
void add_shell(const Model& model, Index body, const VectorXd& q, const VectorXd& thickness, Index first_row,
               PrincipalStrains& out) {
    const Shell& shell = *model.bodies().shells()[body];
    const MembraneFaces& membrane = *model.terms().membrane_faces[body];
    const Index first_scalar = model.nodes().first_scalar();
    const MembraneTerm& stretching =
        dynamic_cast<const MembraneTerm&>(model.terms().elastic_term(body, "membrane"));
    const BendingTerm& bending =
        dynamic_cast<const BendingTerm&>(model.terms().elastic_term(body, "bending"));
    const std::vector<double> changes = angle_changes(shell, q.data());
    const auto change_of = [&](Index dihedral) { return changes[dihedral]; };
    const CreasedEdges creases(model, shell, bending, q);
    const double* rotations = q.data() + first_scalar;
    over_blocks(shell.n_faces(), [&](Index from, Index to) {
        for (Index first = from; first < to; first += SimdDouble::width) {
            SimdVec3 own_rest[3], rest[3], x[3];
            SimdDouble delta[3], half_thickness;
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const Index f = std::min(first + lane, to - 1);
                const std::array<Vec3, 3> corners = stretching.grows() ? stretching.grown(f).corners()
                                                                       : membrane.rest_corners(f),
                                          own = bending.grows() ? bending.grown(f).corners()
                                                                : shell.rest_corners(f);
                Vec3 bends = -bending.natural_angle_changes(f);
                for (int k = 0; k < 3; ++k)
                    bends[k] += bending_strain(shell.sides[f][k], change_of, rotations);
                bends = creases.strains_of_sheet(f, bends);
                for (int k = 0; k < 3; ++k) {
                    set_lane(own_rest[k], lane, own[k]);
                    set_lane(rest[k], lane, corners[k]);
                    set_lane(x[k], lane, q.data() + 3 * membrane.corners()[f][k]);
                    delta[k].set(lane, bends[k]);
                }
                half_thickness.set(lane, 0.5 * thickness[first_row + shell.faces.user[f]]);
            }
            SimdDouble values[4];
            FlatFace(rest).green(rest, x).principal(values[0], values[1]);
            FlatFace(own_rest).curvature(delta).principal(values[2], values[3]);
            for (int lane = 0; lane < std::min(SimdDouble::width, to - first); ++lane) {
                const Index row = first_row + shell.faces.user[first + lane];
                for (int k = 0; k < 4; ++k)
                    out(row, k) = k < 2 ? values[k][lane] : half_thickness[lane] * values[k][lane];
            }
        }
    });
}

}  // namespace

PrincipalStrains principal_strains(const Model& model, const VectorXd& q, const VectorXd& thickness) {
    PrincipalStrains out(thickness.size(), 4);
    Index first_row = 0;
    for (Index body = 0; body < static_cast<Index>(model.bodies().shells().size()); ++body) {
        add_shell(model, body, q, thickness, first_row, out);
        first_row += model.bodies().shells()[body]->n_faces();
    }
    for (Index shell = 0; shell < static_cast<Index>(model.bodies().six_node_shells().size()); ++shell)
        for (const auto& [green, curvature] : six_node_strains(model, shell, q)) {
            const Eigen::Vector2d stretched = principal_in_plane(green), bent = principal_in_plane(curvature);
            for (Index k = 0; k < 2; ++k) {
                out(first_row, k) = stretched[k];
                out(first_row, 2 + k) = 0.5 * thickness[first_row] * bent[k];
            }
            ++first_row;
        }
    return out;
}

LargestStrains largest_of(const PrincipalStrains& strains) {
    LargestStrains found;
    const auto take = [](double value, Index face, double& largest, Index& at) {
        if (std::isnan(largest) || value <= largest) return;  // NaN counts as the largest
        largest = value;
        at = face;
    };
    for (Index f = 0; f < strains.rows(); ++f) {
        for (int k = 0; k < 2; ++k) {
            take(std::abs(strains(f, k)), f, found.membrane, found.membrane_face);
            take(std::abs(strains(f, 2 + k)), f, found.bending, found.bending_face);
        }
    }
    return found;
}

}  // namespace magshell
