// SpringTerm: linear springs and dashpots between points of bodies, or between them and points of the ground.
//
//   E = 1/2 k (s - r)^2,     force k (s - r) + c s'                                                    [J], [N]
//
// along the spring, with a stiffness k [N/m] (of a foundation: [N/m3] times the area that the spring stands for), a length at rest r [m]
// and a damping c [N s/m]. t = sum_j w_j x_j - g is the vector along the spring, between weighted sums of node positions or from the ground
// point g. s is its length |t|, rounded at zero, or its component e . t along a fixed direction e, where r = 0: a foundation (Winkler) has
// three such springs at each vertex, or one along its direction.
//
// The load factor does not scale them.
#pragma once

#include <optional>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/terms/damped_term.h"
#include "magshell/terms/load/spring_input.h"

namespace magshell {

class SpringTerm final : public DampedTerm, public StressRateTerm {
  public:
    SpringTerm(const std::vector<SpringsInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "springs"; }
    Capabilities capabilities() const override {
        return {.has_psd_projection = has_lengths_, .has_own_viscosity = is_damped_};
    }
    bool set_values(const Values& values) override;
    bool add_projective_stiffness(NodeMatrix& out) const override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void set_psd_projection(bool project_psd) override { psd_projection_ = project_psd; }
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override;

    Index elements() const override { return static_cast<Index>(springs_.size()); }
    int strains_per_element() const override { return 1; }
    Strains strains(const double* q) override;
    Strains strain_rates(const double* p) override;
    Strains stresses(const Strains& strains) const override;
    void add_forces(const Strains& stresses, Residual& out) override;
    void strains_vjp(const Strains& stresses, Gradient& out) const override;

    void freeze_stress_rates(const double* p) override {
        frozen_ = p ? strain_rates(p) : Strains(elements(), 1);
    }
    void release_stresses() override { frozen_.reset(); }
    bool has_stress_work_vjp() const override { return true; }
    void add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q, Gradient& out,
                             VectorXd* by_rest) override;

    Strains rates(const double* q, const double* v) const override;
    void rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q, VectorXd& by_v,
                   Gradient& out) const override;
    void add_cancelling_stage_forces(double beyond, VectorXd& out) const override;

  private:
    struct Parameter {
        ParameterSlice slice;
        Index row = -1;  // -1: the spring has no such parameter
        bool exists() const { return row >= 0; }
        Index at() const { return slice.at(row); }
    };
    struct Spring {
        std::vector<Index> nodes;
        std::vector<double> weights;
        std::vector<SystemMatrix::Slot> pairs;  // at lower_index(row - 1, column)
        Vec3 direction;
        bool has_direction;
        double share, softening, reach;  // [1 or m2], [m], [m] largest coordinate at rest
        Parameter stiffness_of, rest_length_of, damping_of, ground_of, share_of, direction_of;
        double stiffness = 0.0, rest_length = 0.0, damping = 0.0;  // stiffness and damping include the share
        Vec3 ground;

        /// Returns the weighted sum of vectors of the nodes.
        Vec3 weighted(const double* rows) const;
        /// Returns the vector t along the spring.
        Vec3 along(const double* q) const { return weighted(q) - ground; }
    };
    /// The vector t along a spring, and the elongation with its first and second derivatives with respect to t.
    struct Local {
        Vec3 along = Vec3::Zero();
        double value = 0.0;
        Vec3 slope = Vec3::Zero();
        Mat3 curvature = Mat3::Zero();
    };
    static Local local(const Spring& spring, const Vec3& along);
    /// Returns the viscous stress of a stage over the damping, and its derivative with respect to s.
    double viscous_strain(std::size_t k) const {
        return history_.shift
                   ? history_.scale * now_[k].value - history_.shift->number(static_cast<Index>(k), 0)
                   : 0.0;
    }
    double viscous_scale() const { return history_.shift ? history_.scale : 0.0; }
    /// Returns the force [N] and stiffness [N/m] along the spring at the last evaluated state.
    double force(std::size_t k) const;
    double stiffness(std::size_t k) const {
        return frozen_ ? 0.0 : springs_[k].stiffness + viscous_scale() * springs_[k].damping;
    }
    /// Returns s - r, or the rate of s that is held.
    double stretch(std::size_t k) const {
        return frozen_ ? frozen_->number(static_cast<Index>(k), 0) : now_[k].value - springs_[k].rest_length;
    }
    Mat3 hessian(std::size_t k, bool project_psd) const;
    static void scatter(const Spring& spring, const Vec3& force, Residual& out);
    static void add_to(const Spring& spring, const Vec3& vector, VectorXd& out);
    static void add_cancelling(const Spring& spring, double stiffness, double beyond, VectorXd& out);

    std::vector<Spring> springs_;
    std::vector<Local> now_;         // at the last evaluated state
    std::optional<Strains> frozen_;  // rates of s while forces are held at their rates
    bool has_lengths_ = false, is_damped_ = false, psd_projection_ = false;
};

}  // namespace magshell
