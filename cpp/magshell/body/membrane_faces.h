// The triangles on which stretch is measured: the sheet's own, but for a cap and the face across its long
// edge, which are cut along their other diagonal.
//
// Where a sheet bends with curvature k along the long edge (length b) of a cap of height H, the tip leaves
// that edge by k b^2 / 8. The cap tilts by k b^2 / 8 H and seems to stretch by half the square of that, many
// times what the sheet does. Its resistance would lock the bending of all around: a strip of caps with H =
// 0.01 b bends 9 % less, and more the thinner it is. The lengths along the other diagonal tell the same
// stretch on triangles that hardly tilt. Bending needs no such care, as directors do not tilt with the face.
#pragma once

#include "magshell/body/sheet.h"

namespace magshell {

class MembraneFaces {
  public:
    /// Edges that are a fold at rest, or that bend more easily than those beside them, stay as they are.
    /// curvature_scale: of each of the caller's edges.
    MembraneFaces(const Sheet& sheet, const Nodes& nodes, const VectorXd& curvature_scale);
    MembraneFaces(const MembraneFaces&) = delete;
    MembraneFaces& operator=(const MembraneFaces&) = delete;

    bool own() const { return corners_.empty(); }  // whether all are the sheet's
    const std::vector<std::array<Index, 3>>& corners() const { return own() ? sheet_.corners : corners_; }
    std::array<Vec3, 3> rest_corners(Index face) const;

    /// What a triangle is made of: so much of it has the material of that face.
    struct Share {
        Index face;
        double part;
    };
    std::array<Share, 2> shares(Index face) const { return own() ? whole(face) : shares_[face]; }

    std::size_t bytes() const {
        return corners_.capacity() * sizeof(corners_[0]) + shares_.capacity() * sizeof(shares_[0]);
    }

  private:
    static std::array<Share, 2> whole(Index face) { return {Share{face, 1.0}, Share{face, 0.0}}; }
    void exchange(const FoldStencil& fold);

    const Sheet& sheet_;
    const Nodes& nodes_;
    std::vector<std::array<Index, 3>> corners_;  // our vertices
    std::vector<std::array<Share, 2>> shares_;
};

}  // namespace magshell
