// Tetrahedra: the elements of a solid, all with four or all with ten nodes. This class has everything that is compiled once
// for all materials: reference shapes, strains, viscosity, admissible steps, and derivatives that need only the response of
// the material at a point. terms/solid/tetrahedra_term.h adds the energy of a material, its forces and its Hessian.
//
//   E = sum over elements  sum_p V_p W(F_p)           W = w + U(v), v the volume measure of the material, such as J
//   with a mean volume:    sum_p V_p w(F_p) + V U(v^),   v^ = sum_p V_p v_p / V,   V = sum_p V_p
//
// A deformation I + H of the rest shape at a point, H = sum_k dX_k (x) g_k, changes
//
//   dF = - F H,   dL = - L H,   dV = V tr H          L the rate of F along lambda
//
// with V = V_p from here on, so that the power V P : L of the stresses has the derivative with respect to H
//
//   B = V ((P : L) I - F^T (dP/dF : L) - L^T P)      dW/dX_k = sum over points  B g_k
//
// With a mean volume, P and its rate contain U'(v^), and the change of v^ adds to B
//
//   V_p U'' R / V (v_p - v^) I,   R = sum_p V_p dv/dF : L
#pragma once

#include <functional>
#include <optional>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/st_venant_kirchhoff.h"
#include "magshell/strain/tetrahedron.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/solid/solid_materials.h"
#include "magshell/terms/solid/solid_term.h"

namespace magshell {

// ViscousStrain: strains and stresses of a solid's linear viscosity at a point, with the moduli of the
// reference configuration.
//
//   d = (E_00 E_11 E_22 2 E_12 2 E_02 2 E_01),   s_ii = 2 mu d_i + lam tr E,   s_ij = mu d_k
//
// so that s . d = S : E.
struct ViscousStrain {
    static constexpr int size = 6;

    static void at(const SimdMat3& f, SimdDouble d[size]) {
        Green::strain(f, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void rate(const SimdMat3& f, const SimdMat3& along, SimdDouble d[size]) {
        Green::rate(f, along, d);
        for (int i = 3; i < size; ++i) d[i] += d[i];
    }
    static void stress(const RestModuli& moduli, const SimdDouble d[size], SimdDouble s[size]) {
        const SimdDouble pressure = moduli.lambda * (d[0] + d[1] + d[2]);
        for (int i = 0; i < 3; ++i) s[i] = SimdDouble(2.0) * moduli.mu * d[i] + pressure;
        for (int i = 3; i < size; ++i) s[i] = moduli.mu * d[i];
    }
    /// Returns the derivatives of stress(d) . rate by the moduli.
    static RestModuli work_by_moduli(const SimdDouble d[size], const SimdDouble rate[size]) {
        RestModuli by{(d[0] + d[1] + d[2]) * (rate[0] + rate[1] + rate[2]), SimdDouble(0.0)};
        for (int i = 0; i < 3; ++i) by.mu += SimdDouble(2.0) * d[i] * rate[i];
        for (int i = 3; i < size; ++i) by.mu += d[i] * rate[i];
        return by;
    }
};

/// The response of a material at a point, for a rate L of F.
struct PointResponse {
    SimdMat3 piola, rate;      // P, dP/dF : L [Pa]
    SimdDouble volume_excess;  // U'' R / V (v - v^) [Pa], zero without a mean volume
};

template <class Element>
class Tetrahedra : public SolidTerm, public ElementEnergies, public RestShapeTerm {
  public:
    using ElementNodes = std::vector<std::array<Index, Element::nodes>>;

    Tetrahedra(const SolidTermInput& input, const ElementNodes& element_nodes);

    Index body() const override { return body_; }
    Index elements() const override { return solid_.n_elements(); }
    int strains_per_element() const override { return ViscousStrain::size * points; }
    /// Returns the smallest height of an element [m]: a displacement of that size changes strains by about one.
    double length_scale() const override { return height_; }

    double energy(const double* q, const LoadParameters&) const override;
    std::vector<double> element_energies(const double* q, const LoadParameters&) const override;
    /// Adds w sum_p V_p g_k . g_l with the weight w of the material.
    bool add_projective_stiffness(NodeMatrix& out) const override;
    double max_step_length(const double* q, const double* step) const override;
    std::string invalid_state_reason(const double* q) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    PointStates point_states(const double* q) const override;

    void vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) override;
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;

    // Green's strain E is quadratic in q, so d2E is the same at all states, and the Hessian of frozen stresses V S' does not
    // depend on q. The sum of V S : c is the power of the rates L = F^-T c, whose strain rate is c; L follows the rest shape.
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { frozen_.reset(); }
    bool has_stress_work_vjp() const override { return true; }
    void add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q, Gradient& out,
                             VectorXd* by_rest) override;

    void add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const override;
    Strains strains(const double* q) override;
    Strains strain_rates(const double* step) override;
    Strains stresses(const Strains& strains) const override;
    void add_forces(const Strains& stresses, Residual& out) override;

  protected:
    static constexpr int N = Element::nodes, points = Element::points;

    struct Rest {
        SimdVec3 gradients[points][3];
        SimdDouble volume[points];

        SimdDouble total() const {
            SimdDouble sum = volume[0];
            for (int p = 1; p < points; ++p) sum += volume[p];
            return sum;
        }
    };
    /// Computes the rates L of the points of a SIMD vector of elements from their F.
    using Rates = std::function<void(Index group, const SimdMat3 f[points], SimdMat3 out[points])>;

    /// Returns the energies [J] of a SIMD vector of elements.
    virtual SimdDouble energy_of(Index group, const double* q) const = 0;
    /// Computes the elastic responses for given F at the points; only P if `rates` is null.
    virtual void respond(Index group, const SimdMat3 f[points], const SimdMat3* rates,
                         PointResponse out[points]) const = 0;
    /// Adds the derivatives by parameters of the power sum_p V_p P_p : L_p.
    virtual void add_work_vjp(const double* q, const Rates& rates, Gradient& out) const = 0;
    virtual RestModuli rest_moduli(Index group) const = 0;
    /// Returns the weight [Pa] for add_projective_stiffness(), which bounds the stiffness.
    virtual SimdDouble projective_weight(Index group) const = 0;
    /// Returns a typical modulus [Pa], from which round-off is estimated.
    virtual double size_of_modulus(Index element) const = 0;

    /// Returns whether the volumetric energy is evaluated at the mean volume of an element. It is a question at run time, as an
    /// element with a mean and one without are nearly the same code, and each takes long to compile.
    bool mean() const { return points > 1 && has_mean_; }

    SimdMat3 gradient_of(Index group, int p, const SimdVec3 x[N]) const {
        SimdVec3 g[N];
        Element::gradients(rest_[group].gradients[p], p, g);
        return deformation_gradient<N>(x, g);
    }
    void gradients_of(Index group, const double* q, SimdMat3 f[points]) const {
        SimdVec3 x[N];
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) f[p] = gradient_of(group, p, x);
    }

    // Computes force_k += stress g_k; at the first point it begins with zero forces. g returns the gradients.
    void add_pull(Index group, int p, const SimdMat3& stress, SimdVec3 g[N], SimdVec3 force[N]) const {
        Element::gradients(rest_[group].gradients[p], p, g);
        SimdVec3 sum{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
        for (int k = 1; k < N; ++k) {
            const SimdVec3 pull = multiply(stress, g[k]);
            force[k] = p == 0 ? pull : force[k] + pull;
            sum += pull;
        }
        force[0] = p == 0 ? -sum : force[0] - sum;
    }

    // With a mean volume viscosity resists shear only: a bulk viscosity at every point would lock the element.
    RestModuli viscous(RestModuli moduli) const {
        if (mean()) moduli.lambda = SimdDouble(-2.0 / 3.0) * moduli.mu;
        return moduli;
    }
    // Computes the strain whose stress is viscous, (scale - 1) d - shift, at a point.
    void beyond_elastic(Index group, int p, const SimdMat3& f, SimdDouble d[6]) const {
        ViscousStrain::at(f, d);
        const SimdDouble* shift = this->history_.shift->at(group) + 6 * p;
        for (int i = 0; i < 6; ++i) d[i] = SimdDouble(this->history_.scale - 1.0) * d[i] - shift[i];
    }
    // Returns the derivatives by the moduli of the viscous power of a point with the rate `along` of F.
    RestModuli viscous_work_by_moduli(Index group, int p, const SimdMat3& f, const SimdMat3& along) const;

    // Adds the blocks of the Hessian while stresses are frozen.
    void assemble_frozen(const ElementBlock& element_block, SystemMatrix& out) const;

    std::size_t bytes_of_elements() const {
        return loop_.bytes() + bytes_of(rest_) + bytes_of(state_) + (frozen_ ? bytes_of(frozen_->groups) : 0);
    }

    const Solid& solid_;
    const Index body_;
    const ElementLoop<N> loop_;
    const ElementNodes& element_nodes_;
    std::vector<Rest> rest_;
    std::optional<Strains> frozen_;  // V S' while stresses are held at their rates
    std::vector<double> state_;      // positions of the last evaluated state

  private:
    // Returns the rates along a motion of the nodes, and the rates L = F^-T c of strains c.
    Rates along_motion(const double* motion) const;
    static Rates along_strains(const Strains& strains);
    // Computes F at q, the rates there, and the responses to them.
    void respond_to(const Rates& rates, Index group, const double* q, SimdMat3 f[points],
                    SimdMat3 along[points], PointResponse out[points]) const;
    // Returns the rates V S' of the second Piola-Kirchhoff stresses times volumes, S = F^-1 P.
    Strains stress_rates(const double* q, const Rates& rates) const;
    // Adds the derivatives of the power by rest positions.
    void add_work_rest_vjp(const double* q, const Rates& rates, VectorXd& out) const;
    // Returns B of the viscous part of the power at a point.
    SimdMat3 viscous_by_rest(Index group, int p, const SimdMat3& f, const SimdMat3& along) const;
    // Adds the gradient with respect to rest positions of a function with the derivative B = of_points(group, B) by a deformation
    // I + H of the rest shape at each point.
    void add_rest(VectorXd& out,
                  const std::function<void(Index group, SimdMat3 by_deformation[points])>& of_points) const;

    const bool has_mean_;
    const double height_;
};

extern template class Tetrahedra<LinearTetrahedron>;
extern template class Tetrahedra<QuadraticTetrahedron>;

}  // namespace magshell
