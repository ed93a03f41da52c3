#include "magshell/terms/magnetic/sheet_triangles.h"

namespace magshell {

void SheetTriangles::add_to(OwnField::Faces& out) const {
    // Nodes of a six-node face: corners, then the middles of the edges 0-1, 1-2, 2-0.
    static constexpr int quarters[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    for (Index f = 0; f < n_faces(); ++f) {
        if (surface_) {
            out.nodes.push_back(surface_->corners[f]);
            out.rest.push_back(surface_->rest_corners(f));
        } else {
            const std::array<Index, 6>& nodes = shell_->own_nodes[f];
            const std::array<Vec3, 6>& rest = shell_->rest[f];
            for (const auto& [a, b, c] : quarters) {
                out.nodes.push_back({nodes[a], nodes[b], nodes[c]});
                out.rest.push_back({rest[a], rest[b], rest[c]});
            }
        }
    }
    out.rotates.resize(out.nodes.size(), law_ == MagnetizationLaw::rotates);
}

OwnField::Faces triangles_of(const std::vector<SheetTriangles>& sheets) {
    OwnField::Faces faces;
    for (const SheetTriangles& sheet : sheets) sheet.add_to(faces);
    return faces;
}

}  // namespace magshell
