// PressureTerm: pressures that follow the faces on which they act. One term holds the pressures of all bodies
// of a scene, because the nonsymmetric parts of two bodies may cancel along their common border.
// energy/face_pressure.h
//
// The energy is minus the work of the forces along the straight path from the reference shape. Wherever the
// pressure has a potential, this is minus p times the change of the volume in front of the faces, whatever
// closes the surface.
#pragma once

#include <tuple>
#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/energy/face_pressure.h"
#include "magshell/terms/term.h"

namespace magshell {

/// The faces on which one load acts, in the caller's numbering of vertices.
struct PressureInput {
    std::string owner;         // name under which its pressures are registered
    Index rows = 1;            // number of pressures
    int nodes_per_face = 3;    // 3, or 6 for quadratic triangles
    std::vector<Index> nodes;  // of all faces, one after another
    std::vector<Index> row;    // pressure of each face's parts (1 or 4 per face); negative: no pressure
};

class PressureTerm final : public Term {
  public:
    PressureTerm(const std::vector<PressureInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
                 Registry& registry);

    std::string_view name() const override { return "pressure"; }
    Capabilities capabilities() const override { return {.has_unsymmetric_tangent = true}; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_nonsymmetric_tangent(const double* q, const LoadParameters& load_parameters,
                                  NonsymmetricTangent& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override;

  private:
    template <int N>
    struct Face {
        using Kernel = FacePressure<N>;

        std::array<Index, N> nodes;
        std::array<Index, Kernel::parts> places;  // index among the pressures of all loads; negative: none
        PairSlots<N> slices;
        std::array<Index, N*(N + 1) / 2> pairs;  // pairs of nodes, at lower_index

        typename Kernel::Corners at(const double* q) const;
        /// Returns the coefficients times the pressures of the face's parts.
        typename Kernel::Coefficients coefficients(const std::vector<double>& pressures) const;
    };
    /// The pressures of one load.
    struct Load {
        ParameterSlice slice;
        Index first;
    };

    template <int N>
    void add_face(const PressureInput& input, std::size_t face, Index first, const Nodes& nodes,
                  const SystemMatrix& matrix);
    void number_pairs();
    template <class Function>
    void each_face(const Function& function) const {
        std::apply([&](const auto&... kind) { (each_of(kind, function), ...); }, faces_);
    }
    template <class Faces, class Function>
    static void each_of(const Faces& faces, const Function& function) {
        for (const auto& face : faces) function(face);
    }

    const Nodes& nodes_;
    ParameterSlice factor_;
    std::vector<Load> loads_;
    std::vector<double> pressures_;  // [Pa], of all loads
    std::tuple<std::vector<Face<3>>, std::vector<Face<6>>> faces_;
    std::vector<std::array<Index, 2>> pairs_;  // pairs of nodes of one face, each once
};

}  // namespace magshell
