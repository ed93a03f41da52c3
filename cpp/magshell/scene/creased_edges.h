// CreasedEdges: the bending strains of the faces beside creases, without the folds.
//
// A fold is no bending of the sheet, but the dihedral angle of a creased edge contains it. In place of this angle the strain
// delta_i of the edge is the one for which the sheet's moment there is that of the crease,
//
//     sum_j C_ij delta_j = k L (theta - theta_r),                                                                [N m]
//
// with the bending stiffness C of the face, not scaled down as in the energy, and the law of terms/shell/crease_term.h.
#pragma once

#include <Eigen/LU>
#include <map>
#include <utility>

#include "magshell/scene/model.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/crease_term.h"

namespace magshell {

class CreasedEdges {
  public:
    CreasedEdges(const Model& model, const Shell& shell, const BendingTerm& bending, const VectorXd& q)
        : shell_(shell), bending_(bending) {
        for (const std::unique_ptr<Term>& term : model.terms().energies)
            if (const auto* creases = dynamic_cast<const CreaseTerm*>(term.get()))
                for (const auto& [start, end, moment] : creases->moments(q.data()))
                    moments_[key(start, end)] = moment;
    }

    /// Returns the bending strains [rad] of a face, given those of all its dihedral angles.
    Vec3 strains_of_sheet(Index face, const Vec3& delta) const {
        return moments_.empty() ? delta : sheet(face, delta).strains;
    }

    /// Returns the moments [N m] that belong to these strains, given those of the energy.
    Vec3 moments(Index face, const Vec3& delta, const Vec3& of_energy) const {
        if (moments_.empty()) return of_energy;
        const Sheet found = sheet(face, delta);
        return found.is_creased ? Vec3(found.stiffness * found.strains) : of_energy;
    }

  private:
    struct Sheet {
        bool is_creased;
        Vec3 strains;
        Mat3 stiffness;
    };

    Sheet sheet(Index face, const Vec3& delta) const {
        std::array<const double*, 3> moments{};
        for (int i = 0; i < 3; ++i) {
            const Index dihedral = shell_.sides[face][i].dihedral;
            if (dihedral < 0) continue;
            const std::array<Index, 4>& nodes = shell_.dihedrals[dihedral].nodes;
            const auto found = moments_.find(key(nodes[0], nodes[1]));
            if (found != moments_.end()) moments[i] = &found->second;
        }
        if (!moments[0] && !moments[1] && !moments[2]) return {false, delta, Mat3::Zero()};
        Vec3 scale = bending_.scales_of(face);
        for (int i = 0; i < 3; ++i)
            if (moments[i]) scale[i] = 1.0;
        const Mat3 stiffness = scale.asDiagonal() * bending_.unscaled_stiffness(face) * scale.asDiagonal();
        // Rows of a moment are divided by their size, as those of a given strain have another unit.
        Mat3 rows = Mat3::Identity();
        Vec3 right = delta;
        for (int i = 0; i < 3; ++i) {
            if (!moments[i]) continue;
            rows.row(i) = stiffness.row(i) / stiffness(i, i);
            right[i] = *moments[i] / stiffness(i, i);
        }
        return {true, rows.partialPivLu().solve(right), stiffness};
    }

    static std::pair<Index, Index> key(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

    const Shell& shell_;
    const BendingTerm& bending_;
    std::map<std::pair<Index, Index>, double> moments_;  // by the ends of the edge [N m]
};

}  // namespace magshell
