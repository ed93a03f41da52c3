// The triangles on which membrane strain is measured: the faces of the shell, except for each cap (an obtuse triangle) and the face across its
// long edge, which are cut along their other diagonal.
//
// Why: if a shell bends with curvature k along the long edge (length b) of a cap of height H, the tip leaves that edge by k b^2 / 8. The
// cap then tilts by k b^2 / (8 H) and seems to stretch by half the square of this angle, many times more than the shell does. Its membrane stiffness
// would lock the bending around it: a strip of caps with H = 0.01 b would bend 9 % less, and less still if it is thinner. The other
// diagonal gives the same strain on triangles that hardly tilt. Bending strains need no correction, as directors do not tilt with the face.
#pragma once

#include "magshell/body/shell.h"

namespace magshell {

class MembraneFaces {
  public:
    /// Edges with a rest angle, and hinges (edges much softer in bending than their neighbours), stay as they are. curvature_scale: per
    /// edge of the caller.
    MembraneFaces(const Shell& shell, const Nodes& nodes, const VectorXd& curvature_scale);
    MembraneFaces(const MembraneFaces&) = delete;
    MembraneFaces& operator=(const MembraneFaces&) = delete;

    bool is_unchanged() const { return corners_.empty(); }  // whether all triangles are the shell's faces
    const std::vector<std::array<Index, 3>>& corners() const {
        return is_unchanged() ? shell_.corners : corners_;
    }
    std::array<Vec3, 3> rest_corners(Index face) const;

    /// A fraction of a triangle that has the material of a face.
    struct FacePart {
        Index face;
        double part;
    };
    std::array<FacePart, 2> parts(Index face) const {
        return is_unchanged() ? single_part(face) : parts_[face];
    }

    std::size_t bytes() const {
        return corners_.capacity() * sizeof(corners_[0]) + parts_.capacity() * sizeof(parts_[0]);
    }

  private:
    static std::array<FacePart, 2> single_part(Index face) {
        return {FacePart{face, 1.0}, FacePart{face, 0.0}};
    }
    void exchange(const DihedralStencil& dihedral);

    const Shell& shell_;
    const Nodes& nodes_;
    std::vector<std::array<Index, 3>> corners_;  // nodes
    std::vector<std::array<FacePart, 2>> parts_;
};

}  // namespace magshell
