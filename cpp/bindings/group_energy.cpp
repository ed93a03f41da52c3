#include <pybind11/eigen.h>

#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "bindings/call_python.h"
#include "bindings/scene_input.h"

namespace magshell::bindings {
namespace {

/// An energy whose values and derivatives come from two Python functions: sample(positions (3 k n,), values (m,), order) returns a
/// tuple of the first order + 1 of energies (n,), gradients (3 k n,) and Hessians (9 k^2 n,); rate_by_values(positions, values,
/// rates (3 k n,)) returns (m,).
class PythonGroupEnergy final : public GroupEnergy {
  public:
    PythonGroupEnergy(py::function sample, py::function rate_by_values)
        : sample_(std::move(sample)), rate_by_values_(std::move(rate_by_values)) {}
    ~PythonGroupEnergy() override {  // the last owner may be C++ code that has released the GIL
        const py::gil_scoped_acquire gil;
        sample_ = py::function();
        rate_by_values_ = py::function();
    }

    GroupSamples sample(const VectorXd& positions, const VectorXd& values, int order) const override {
        const py::gil_scoped_acquire gil;
        const py::tuple found = call_python(sample_, positions, values, order);
        GroupSamples samples;
        VectorXd* parts[] = {&samples.energies, &samples.gradients, &samples.hessians};
        for (int k = 0; k <= order; ++k) *parts[k] = found[k].cast<VectorXd>();
        return samples;
    }

    VectorXd rate_by_values(const VectorXd& positions, const VectorXd& values,
                            const VectorXd& rates) const override {
        const py::gil_scoped_acquire gil;
        return call_python(rate_by_values_, positions, values, rates).cast<VectorXd>();
    }

  private:
    py::function sample_, rate_by_values_;
};

}  // namespace

std::vector<GroupEnergyInput> group_energies_of(const py::list& given) {
    std::vector<GroupEnergyInput> energies;
    for (const py::handle each : given) {
        GroupEnergyInput& energy = energies.emplace_back();
        energy.owner = each["owner"].cast<std::string>();
        energy.name = each["name"].cast<std::string>();
        energy.vertices = each["vertices"].cast<std::vector<Index>>();
        energy.group_size = each["group_size"].cast<Index>();
        for (const py::handle value : each["values"]) {
            const auto [name, rows, width] = value.cast<std::tuple<std::string, Index, Index>>();
            energy.values.push_back({name, rows, width});
        }
        energy.is_load = each["is_load"].cast<bool>();
        energy.energy = each["energy"].cast<std::shared_ptr<GroupEnergy>>();
    }
    return energies;
}

void register_group_energy(py::module_& module) {
    py::class_<GroupEnergy, std::shared_ptr<GroupEnergy>>(module, "GroupEnergy");
    py::class_<PythonGroupEnergy, GroupEnergy, std::shared_ptr<PythonGroupEnergy>>(module,
                                                                                   "PythonGroupEnergy")
        .def(py::init<py::function, py::function>(), py::arg("sample"), py::arg("rate_by_values"));
}

}  // namespace magshell::bindings
