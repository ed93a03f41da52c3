// GroupEnergyTerm: the term of an energy of groups of nodes that the caller computes, with its derivatives.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/core/types.h"
#include "magshell/terms/term.h"

namespace magshell {

// GroupEnergy: an energy of groups of nodes that the caller computes, with its derivatives.
//
//   E = sum over groups of W(x_1, ..., x_k; values)                        [J]
//
// All groups have the same number k of nodes. The core asks for all groups at once, because one call of the caller's function is slow.

/// The energies of n groups of k nodes, and derivatives with respect to the positions of their nodes as far as they were asked for.
struct GroupSamples {
    VectorXd energies;   // (n) [J]
    VectorXd gradients;  // (n, 3k), one group after another [N]
    VectorXd hessians;   // (n, 3k, 3k) [N/m]
};

class GroupEnergy {
  public:
    virtual ~GroupEnergy() = default;

    /// Evaluates all groups. positions: (n, 3k) [m]. values: all of the caller's, in the order of registration. order: of the highest
    /// derivative, 0 to 2. Numbers that are not finite are passed on.
    virtual GroupSamples sample(const VectorXd& positions, const VectorXd& values, int order) const = 0;

    /// Returns d(rates . gradient)/d(value) of all values; rates: (n, 3k).
    virtual VectorXd rate_by_values(const VectorXd& positions, const VectorXd& values,
                                    const VectorXd& rates) const = 0;
};

struct GroupEnergyInput {
    struct Value {
        std::string name;
        Index rows, width;
    };
    std::string owner;            // name under which its values are registered
    std::string name;             // of the energy in results
    std::vector<Index> vertices;  // of the caller, one group after another
    Index group_size = 1;
    std::vector<Value> values;
    bool is_load = true;  // whether the load factor scales it
    std::shared_ptr<const GroupEnergy> energy;
};

class GroupEnergyTerm final : public Term {
  public:
    GroupEnergyTerm(const GroupEnergyInput& input, const Nodes& nodes, const SystemMatrix& matrix,
                    Registry& registry);

    std::string_view name() const override { return name_; }
    bool set_values(const Values& values) override;
    Capabilities capabilities() const override {
        return {.has_infeasible_states = true, .has_psd_projection = true};
    }
    std::string invalid_state_reason(const double* q) const override;
    bool depends_on_loads() const override { return is_load_; }
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void set_psd_projection(bool project_psd) override { psd_projection_ = project_psd; }
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override;

  private:
    Index groups() const { return static_cast<Index>(nodes_.size()) / group_size_; }
    Index width() const { return 3 * group_size_; }  // unknowns of a group
    double factor(const LoadParameters& load_parameters) const {
        return is_load_ ? load_parameters[factor_.first] : 1.0;
    }
    /// Returns the vectors of q at the nodes of all groups, (n, 3k).
    VectorXd gather(const double* q) const;
    /// Returns the caller's vertices of a group, for messages.
    std::string describe(Index group) const;
    void scatter(Index group, const Eigen::MatrixXd& hessian, SystemMatrix& out) const;

    const Nodes& all_nodes_;
    const std::string name_;
    const Index group_size_;
    const bool is_load_;
    const std::shared_ptr<const GroupEnergy> energy_;
    std::vector<Index> nodes_;               // one group after another
    std::vector<SystemMatrix::Slot> slots_;  // of each group, at lower_index(row - 1, column)
    ParameterSlice factor_;
    std::vector<ParameterSlice> slices_;
    VectorXd values_;
    bool psd_projection_ = false;
};

}  // namespace magshell
