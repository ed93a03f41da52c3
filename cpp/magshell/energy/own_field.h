// OwnField: the magnetostatic energy of magnetized sheets and solids in the field that they make themselves, mutual and self parts.
//
// Sheets. With a magnetization M~ that is constant on each face and carried along by the deformation (F M~), the sources lie
// on the edges:
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
//
// Solids. With M~ constant on each tetrahedron (F M~ / J), the sources are charges on its faces, which the deformation does not change:
//
//   Q_t = a~_t . (M~_1 - M~_2)      a~_t: area vector at rest, out of the tetrahedron 1 into 2
//
// A tetrahedron whose magnetization rotates without stretching, R M~ / J, has U^-1 M~ instead of M~ (energy/unstretched_vector.h),
// with its mean deformation gradient F = R U = sum_t xbar_t a~_t^T / V~, a sum over its triangles of centers xbar_t.
//
// A charge is uniform on its triangle: four points, 16 where triangles or edges are near, and the closed form of its energy with itself.
//
// Rigid bodies with a magnetic moment are point dipoles in the field of all elements and of each other.
//
// An element is an edge of a sheet or a triangle of a solid: what carries charges and currents.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "magshell/core/dual.h"
#include "magshell/core/types.h"

namespace magshell {

/// Returns the parts of three lengths in the derivative of the longest: equal ones where several are the longest.
std::array<double, 3> parts_of_longest(const std::array<double, 3>& lengths);

class OwnField {
  public:
    /// The faces of all sheets: their nodes, their corners at rest [m], and whether their tangential magnetization rotates without
    /// stretching.
    struct Faces {
        std::vector<std::array<Index, 3>> nodes;
        std::vector<std::array<Vec3, 3>> rest;
        std::vector<bool> rotates;
    };
    /// The triangles of all solids: their nodes, their corners at rest [m], counterclockwise seen from outside of the first of the two
    /// tetrahedra at them; -1: none.
    struct Triangles {
        std::vector<std::array<Index, 3>> nodes;
        std::vector<std::array<Vec3, 3>> rest;
        std::vector<std::array<Index, 2>> tetrahedra;
        std::vector<bool>
            rotates;  // of each tetrahedron, whether its magnetization rotates without stretching
    };
    /// A rigid body with a moment: all of its nodes, first the corners x_k of its tetrahedron. The dipole m = sum moment_k x_k is at
    /// sum position_k x_k.
    struct RigidNodes {
        std::vector<Index> nodes;
    };
    struct DipoleWeights {
        std::array<double, 4> position{}, moment{};
    };
    /// The gradient with respect to a triangle of a solid at rest, with its charge while the magnetizations that stretch stay.
    struct TriangleGradient {
        double charge, length;     // [J/(A m)]; by the longest side [N]
        Vec3 area = Vec3::Zero();  // through magnetizations that rotate, by the area vector [N/m]
        double volume = 0.0;       // through these, by the volume between the triangle and the origin [N/m2]
    };
    /// The gradient with respect to the shape at rest: the corners of each face [N], and the triangles.
    struct RestGradient {
        std::vector<std::array<Vec3, 3>> corners;
        std::vector<TriangleGradient> triangles;
    };
    /// The gradient with respect to the values of each face and of each tetrahedron, and to the weights of each dipole.
    struct FaceGradient {
        std::vector<Vec3> magnetization;  // [J m/A]
        std::vector<double> thickness;    // [J/m]
        std::vector<Vec3> of_tetrahedra;  // by the magnetization [J m/A]
        std::vector<DipoleWeights> of_dipoles;
        RestGradient rest;
        std::vector<Vec3> by_position;  // the product of the Hessian with lambda, of each of nodes() [N]
    };
    /// Trees of the source points, and the pairs of boxes whose sums they replace.
    struct Trees;
    /// Pairs that are near: a target element and a source element before it, each pair once, and an element and a face with charged sides.
    /// Trees if the sums are not direct.
    struct Neighbours {
        std::vector<std::array<Index, 2>> elements, sides;
        // so many of them come first that have the fine points; the others have the medium ones
        Index elements_with_fine = 0, sides_with_fine = 0;
        std::shared_ptr<const Trees> trees;
        bool is_rough = false;  // for products that need not be exact. plain-words: ok, of products
    };

    /// Throws InvalidInput if more than two faces meet at an edge.
    OwnField(Faces faces, const Triangles& triangles, const std::vector<RigidNodes>& rigid);

    /// Sets the remanent magnetization [A/m] and the thickness [m] of each face, and the magnetization of each tetrahedron.
    void set(const std::vector<Vec3>& magnetization, const std::vector<double>& thickness,
             const std::vector<Vec3>& of_tetrahedra);
    /// Sets the dipole of each rigid body.
    void set(const std::vector<DipoleWeights>& dipoles);
    /// Sets the accuracy of sums over more than most_direct points; 0: they are direct.
    void set_accuracy(double accuracy) { accuracy_ = accuracy; }
    double accuracy() const { return accuracy_; }
    // Trees take less time beyond so many points; see benchmarks/own_field_costs.py.
    static constexpr Index most_direct = 8000, most_direct_rough = 2000;
    /// Returns the number of source points: four per element with a source, six per face with a normal magnetization if there are
    /// charges.
    Index n_points() const { return 4 * active_elements_ + (has_charges_ ? 6 * active_faces_ : 0); }

    /// Returns the elements with a source and the faces at them: the same energy and gradient, without derivatives with respect to the
    /// values of faces.
    OwnField of_sources() const;

    /// Finds the near pairs of sources at positions q of all nodes.
    Neighbours neighbours(const double* q) const { return neighbours(q, Targets::sources); }
    /// Returns whether products with the Hessian that need not be exact take less time.
    bool has_rough_products() const {  // plain-words: ok
        return n_points() > most_direct_rough && accuracy_ > 0.0;
    }
    /// Returns the nearest of these pairs and trees of a low accuracy, for products with the Hessian that need not be exact.
    Neighbours rough(const double* q, const Neighbours& near) const;  // plain-words: ok, of products
    /// Returns the energy [J] and sets its gradient [N] by the position of each of nodes().
    double gradient(const double* q, const Neighbours& near, std::vector<Vec3>& by_position) const;
    /// Adds the product of the Hessian at q with the direction p to out; both have three numbers per node of the scene.
    void add_hessian_product(const double* q, const Neighbours& near, const double* p, double* out) const;
    /// Returns the derivatives of the rate of the energy along lambda by the values of each face.
    FaceGradient vjp(const double* q, const double* lambda) const;
    /// The force [N] and the couple [N m] on each dipole, and its position [m].
    struct DipoleActions {
        std::vector<Vec3> positions, forces, couples;
    };
    DipoleActions on_dipoles(const double* q) const;
    /// The actions on each body by elements of others that are near: as the energy has them and better ones, and the sum of the sizes of the
    /// latter on its elements.
    struct GapActions {
        std::vector<Vec3> taken, finer;
        std::vector<double> sizes;
    };
    /// The forces [N] and the couples [N m] about the center of each body [m], and the distance of the nearest points [m]. Of its own elements
    /// that are near now but not at rest: the sums of the sizes of their forces [N], and the distance.
    struct GapForces {
        GapActions forces, couples;
        std::vector<Vec3> centers;
        std::vector<double> nearest;
        std::vector<double> taken_within, finer_within, nearest_within;
    };
    /// rest: positions of the nodes at rest, as q.
    GapForces gap_forces(const double* q, const double* rest, const Neighbours& near,
                         const std::vector<Index>& body_of_face,
                         const std::vector<Index>& body_of_tetrahedron, Index n_bodies) const;
    /// Returns the flux density [T] at points outside of the bodies.
    std::vector<Vec3> flux_density(const double* q, const std::vector<Vec3>& points) const;

    /// Returns the nodes of the scene that the bodies have.
    const std::vector<Index>& nodes() const { return nodes_; }
    /// Returns true if there is any source.
    bool acts() const { return active_elements_ > 0 || !dipoles_.empty(); }
    std::size_t bytes() const;

  private:
    struct Element {
        std::array<Index, 3> nodes;     // local; of an edge a, b, and -1
        std::array<Index, 2> bodies;    // the faces at an edge, the tetrahedra at a triangle; -1: none
        std::array<double, 2> turns;    // +-1: the face runs the edge from a to b or back
        std::array<double, 2> normals;  // sign of each face's normal in that of the edge
        double length = 0.0;            // at rest, of a triangle its longest side [m]
        Vec3 area = Vec3::Zero();       // of a triangle at rest [m2]

        bool is_edge() const { return nodes[2] < 0; }
        int n_nodes() const { return is_edge() ? 2 : 3; }
    };
    /// A source point of an element: its position as the weights of the nodes and the fraction of the thickness, and its weight.
    struct SamplePoint {
        double weights[3];
        double zeta, weight;
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
    /// A tetrahedron whose magnetization rotates without stretching, with its triangles.
    struct Tetrahedron {
        struct Side {
            Index element;
            Vec3 area;  // outward at rest [m2]
        };
        Index number = 0;
        std::vector<Side> sides{};
        double volume = 0.0;          // at rest [m3]
        Vec3 magnetization{0, 0, 0};  // [A/m]
    };
    struct Dipole {
        std::array<Index, 4> nodes;  // local
        DipoleWeights weights;
    };
    template <class T>
    struct DipoleAdjoint {
        Triple<T> position, moment;
    };
    template <class T>
    struct ElementAdjoint {
        Triple<T> nodes[3], normal;
        T charge{}, current{}, thickness{}, length{};

        ElementAdjoint& operator+=(const ElementAdjoint& other);
    };
    template <class T>
    struct FaceAdjoint {
        Triple<T> corners[3], normal;
        T current{}, charge{}, thickness{}, size{};
    };
    template <class T>
    struct Geometry;
    template <class T>
    struct Evaluation {
        T energy{};
        std::vector<Triple<T>> by_position;  // of local nodes
        std::vector<ElementAdjoint<T>> elements;
        std::vector<FaceAdjoint<T>> faces;
        std::vector<DipoleAdjoint<T>> dipoles;
    };

    OwnField() = default;

    /// Where sums are evaluated: at the sources, or at all elements and faces, for derivatives with respect to values that are zero now.
    enum class Targets { sources, all };

    /// Collects the tetrahedra whose magnetization rotates, with their triangles.
    void collect_rotating(const Triangles& triangles);
    Index target_elements(Targets at) const {
        return at == Targets::all ? static_cast<Index>(elements_.size()) : active_elements_;
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
    std::shared_ptr<const Trees> trees(const std::vector<Triple<double>>& x, Targets targets,
                                       double accuracy) const;
    template <class T>
    std::vector<Triple<T>> positions(const double* q, const double* rate) const;
    template <class T>
    Evaluation<T> evaluate(const std::vector<Triple<T>>& x, const Neighbours& near, Targets targets) const;
    template <class T>
    void add_element_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                           Evaluation<T>& out) const;
    template <class T>
    void add_near_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                        Evaluation<T>& out) const;
    template <class T>
    void add_sides(const Geometry<T>& at, const Neighbours& near, Targets targets, Evaluation<T>& out) const;
    template <class T>
    void add_near_sides(const Geometry<T>& at, const Neighbours& near, Targets targets,
                        std::vector<T>& potentials, Evaluation<T>& out) const;
    bool is_edge_of(Index element, Index face) const {
        const Element& e = elements_[element];
        return e.is_edge() && (e.bodies[0] == face || e.bodies[1] == face);
    }
    /// Returns true if all nodes of an element belong to the rigid body of a dipole.
    bool is_part_of(Index element, Index dipole) const {
        for (int k = 0; k < elements_[element].n_nodes(); ++k)
            if (rigid_of_node_[elements_[element].nodes[k]] != dipole) return false;
        return true;
    }
    template <class T>
    void add_dipole(const Geometry<T>& at, std::size_t number, Targets targets, Evaluation<T>& out) const;
    template <class T>
    void add_dipole_pair(const Geometry<T>& at, std::size_t first, std::size_t second,
                         Evaluation<T>& out) const;
    template <class T>
    void add_dipoles(const Geometry<T>& at, Targets targets, Evaluation<T>& out) const;
    template <class T>
    void add_self(const Geometry<T>& at, Index element, ElementAdjoint<T>& out) const;
    /// Returns the derivatives by the corners of a face at rest. by_current: that by h_f (M~_f . n~_f) A~_f, over A_f.
    std::array<Vec3, 3> by_corners(const Geometry<Dual>& at, Index face, const Evaluation<Dual>& found,
                                   double by_current) const;
    std::vector<TriangleGradient> by_triangles(const Geometry<Dual>& at, const Evaluation<Dual>& found) const;
    /// Adds the derivatives by the charges of tetrahedra whose magnetization rotates to those by the nodes of elements.
    template <class T>
    void collect_charges(const Geometry<T>& at, Evaluation<T>& out) const;
    template <class T>
    void collect(const Geometry<T>& at, Evaluation<T>& out) const;

    std::vector<Index> nodes_;       // local -> node of the scene
    std::vector<Element> elements_;  // edges, then triangles
    Index n_tetrahedra_ = 0;
    std::vector<Tetrahedron> rotating_;  // those whose magnetization rotates without stretching
    std::vector<Dipole> dipoles_;
    std::vector<Index> rigid_of_node_;  // the dipole whose rigid body a local node belongs to; -1: none
    std::vector<Face> faces_;
    std::vector<Index> element_order_, face_order_;  // those with a source first
    Index active_elements_ = 0;                      // number of those with a source
    Index active_faces_ = 0;                         // number of faces with a normal magnetization
    std::vector<double> charges_;            // Q [A m] of faces and tetrahedra whose magnetization stretches
    std::vector<bool> has_charge_;           // of elements
    std::vector<double> element_thickness_;  // of elements [m]
    std::vector<double> thickness_;          // of faces [m]
    std::vector<double> rest_currents_;      // h_f (M~_f . n~_f) [A]
    std::vector<Vec3> magnetization_;
    std::vector<double> side_charges_;  // A~_f (M~_f . n~_f) [A m]
    bool has_charges_ = false;
    double accuracy_ = 0.0;  // [-]
};

}  // namespace magshell
