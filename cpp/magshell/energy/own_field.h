// OwnField: the magnetostatic energy of magnetized sheets in the field that they make themselves, mutual and self parts.
//
// With a magnetization M~ that is constant on each face and carried along by the deformation (F M~), the sources lie on the edges:
//
//   tangential  charge Q_e = sum over faces f at e of h_f l~_e (M~_f . nu~_fe),  nu~ the outward conormal at rest; a constant of the motion
//               a face whose magnetization rotates without stretching, R M~, has U^-1 M~ instead of M~ (energy/unstretched_vector.h)
//   normal      current I_e = I_left - I_right along e,  I_f = h_f (M~_f . n~_f) A~_f / A_f; and charges +-A~_f (M~_f . n~_f) on the two
//               sides of f, which only charges Q_e feel
//
// Both are uniform along the current edge (a, b) and through the thickness. They are sampled at Gauss points
// p = (1 - s) a + s b + zeta h n, two along the edge and two through the thickness:
//
//   E = mu_0/(4 pi) [ 1/2 sum (q_i q_j - c_i . c_j) / |p_i - p_j|  +  sum q_i V(p_i) ],    c = I_e w (b - a)
//
// V is the potential of the charged sides, at three points per side. Pairs of points of one edge are left out, and so are the sides of the
// faces at an edge. Pairs of edges nearer than 1.5 edge lengths are sampled at 4 x 4 points; near sides are replaced by two layers of
// dipoles, whose potential is the solid angle. Between near and far the two values are blended with a smooth weight of the distance, so
// that the energy is a function of the state with continuous second derivatives.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "magshell/core/dual.h"
#include "magshell/core/types.h"

namespace magshell {

class OwnField {
  public:
    /// The faces of all sheets: their nodes, their corners at rest [m], and whether their tangential magnetization rotates without stretching.
    struct Faces {
        std::vector<std::array<Index, 3>> nodes;
        std::vector<std::array<Vec3, 3>> rest;
        std::vector<bool> rotates;
    };
    /// The gradient by the values of each face.
    struct FaceGradient {
        std::vector<Vec3> magnetization;  // [J m/A]
        std::vector<double> thickness;    // [J/m]
    };
    /// Trees of the source points, and the pairs of boxes whose sums they replace.
    struct Trees;
    /// Pairs that are near: for each target edge its source edges, and the pairs (edge, face) with charged sides. Trees if the sums are
    /// not direct.
    struct Neighbours {
        std::vector<std::vector<Index>> edges;
        std::vector<std::array<Index, 2>> sides;
        std::shared_ptr<const Trees> trees;
    };

    /// Throws InvalidInput if more than two faces meet at an edge.
    explicit OwnField(Faces faces);

    /// Sets the remanent magnetization [A/m] and the thickness [m] of each face.
    void set(const std::vector<Vec3>& magnetization, const std::vector<double>& thickness);
    /// Sets the accuracy of sums over more than most_direct points; 0: they are direct.
    void set_accuracy(double accuracy) { accuracy_ = accuracy; }
    double accuracy() const { return accuracy_; }
    static constexpr Index most_direct =
        16000;  // trees take less time beyond; see benchmarks/own_field_costs.py
    /// Returns the number of source points: four per edge with a source, six per face with a normal magnetization if there are charges.
    Index n_points() const { return 4 * active_edges_ + (has_charges_ ? 6 * active_faces_ : 0); }

    /// Returns the edges with a source and the faces at them: the same energy and gradient, without derivatives by the values of faces.
    OwnField of_sources() const;

    /// Finds the near pairs of sources at positions q of all nodes.
    Neighbours neighbours(const double* q) const { return neighbours(q, Targets::sources); }
    /// Returns the energy [J] and sets its gradient [N] by the position of each of nodes().
    double gradient(const double* q, const Neighbours& near, std::vector<Vec3>& by_position) const;
    /// Adds the product of the Hessian at q with the direction p to out; both have three numbers per node of the scene.
    void add_hessian_product(const double* q, const Neighbours& near, const double* p, double* out) const;
    /// Returns the derivatives of the rate of the energy along lambda by the values of each face.
    FaceGradient vjp(const double* q, const double* lambda) const;
    /// Returns the flux density [T] at points outside of the sheets.
    std::vector<Vec3> flux_density(const double* q, const std::vector<Vec3>& points) const;

    /// Returns the nodes of the scene that the sheets have.
    const std::vector<Index>& nodes() const { return nodes_; }
    /// Returns true if there is any source.
    bool acts() const { return active_edges_ > 0; }
    std::size_t bytes() const;

  private:
    struct Edge {
        std::array<Index, 2> nodes;     // local nodes a, b
        std::array<Index, 2> faces;     // -1: none
        std::array<double, 2> turns;    // +-1: the face runs the edge from a to b or back
        std::array<double, 2> normals;  // sign of each face's normal in that of the edge
        double length = 0.0;            // at rest [m]
    };
    struct Face {
        std::array<Index, 3> nodes;     // local
        double area = 0.0, size = 0.0;  // at rest: [m2], longest edge [m]
        Vec3 normal;                    // at rest
        std::array<Vec3, 3>
            conormals;  // at rest, outward, times the length of the edge opposite each corner [m]
        std::array<Index, 3> edges;  // opposite each corner; -1: left out
        bool rotates = false;
        std::array<Vec3, 2> basis;                        // of the plane at rest
        std::array<double, 4> inverse;                    // of the edges at rest in the basis; by rows
        std::array<std::array<double, 2>, 3> in_plane{};  // the conormals in the basis
    };
    template <class T>
    struct EdgeAdjoint {
        Triple<T> a, b, normal;
        T charge{}, current{}, thickness{};

        EdgeAdjoint& operator+=(const EdgeAdjoint& other);
        EdgeAdjoint& operator-=(const EdgeAdjoint& other);
        void scale(const T& factor);
    };
    template <class T>
    struct FaceAdjoint {
        Triple<T> corners[3], normal;
        T current{}, charge{}, thickness{};

        FaceAdjoint& operator+=(const FaceAdjoint& other);
        void scale(const T& factor);
    };
    template <class T>
    struct Geometry;
    template <class T>
    struct Evaluation {
        T energy{};
        std::vector<Triple<T>> by_position;  // of local nodes
        std::vector<EdgeAdjoint<T>> edges;
        std::vector<FaceAdjoint<T>> faces;
    };

    OwnField() = default;

    /// Where sums are evaluated: at the sources, or at all edges and faces, for derivatives by values that are zero now.
    enum class Targets { sources, all };

    Index target_edges(Targets at) const {
        return at == Targets::all ? static_cast<Index>(edges_.size()) : active_edges_;
    }
    Index target_faces(Targets at) const {
        return at == Targets::all ? static_cast<Index>(faces_.size()) : active_faces_;
    }
    /// Returns h M~ in the basis of the plane [A].
    std::array<double, 2> tangential(std::size_t f) const {
        const Vec3 m = thickness_[f] * magnetization_[f];
        return {m.dot(faces_[f].basis[0]), m.dot(faces_[f].basis[1])};
    }
    bool has_sides(Targets at) const { return at == Targets::all || (has_charges_ && active_faces_ > 0); }
    Neighbours neighbours(const double* q, Targets targets) const;
    std::shared_ptr<const Trees> trees(const std::vector<Triple<double>>& x, Targets targets) const;
    template <class T>
    std::vector<Triple<T>> positions(const double* q, const double* rate) const;
    template <class T>
    Evaluation<T> evaluate(const std::vector<Triple<T>>& x, const Neighbours& near, Targets targets) const;
    template <class T>
    void add_edge_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                        Evaluation<T>& out) const;
    template <class T>
    void add_sides(const Geometry<T>& at, const Neighbours& near, Targets targets, Evaluation<T>& out) const;
    template <class T>
    void add_near_side(const Geometry<T>& at, Index e, Index f, EdgeAdjoint<T>& of_edge,
                       FaceAdjoint<T>& of_face) const;
    template <class T>
    void collect(const Geometry<T>& at, Evaluation<T>& out) const;

    std::vector<Index> nodes_;  // local -> node of the scene
    std::vector<Edge> edges_;
    std::vector<Face> faces_;
    std::vector<Index> edge_order_, face_order_;  // those with a source first
    Index active_edges_ = 0;                      // number of edges with a source
    Index active_faces_ = 0;                      // number of faces with a normal magnetization
    std::vector<double> edge_charges_;            // Q_e [A m] of faces whose magnetization stretches
    std::vector<bool> has_charge_;                // of edges
    std::vector<double> edge_thickness_;          // [m]
    std::vector<double> thickness_;               // of faces [m]
    std::vector<double> rest_currents_;           // h_f (M~_f . n~_f) [A]
    std::vector<Vec3> magnetization_;
    std::vector<double> side_charges_;  // A~_f (M~_f . n~_f) [A m]
    bool has_charges_ = false;
    double accuracy_ = 0.0;  // [-]
};

}  // namespace magshell
