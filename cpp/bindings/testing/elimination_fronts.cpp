// Binds the elimination tree of a matrix, from which the benchmarks compute how far a factorization can be divided among cores.
#include <optional>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/ordering/ordering.h"

namespace magshell::bindings {
namespace {

// Returns the fronts in the order of their elimination: pivots, below, parent and task, each (n,).
py::dict elimination_fronts(Index size, const IndexArray& column_starts, const IndexArray& rows,
                            const std::optional<Array>& points) {
    const SparsePattern pattern{size, to_indices(column_starts, "column_starts"), to_indices(rows, "rows")};
    FactorOptions options;
    if (points) {
        const Rows3 places = to_rows3(*points);
        for (Eigen::Index k = 0; k < places.rows(); ++k) options.points.push_back(places.row(k).transpose());
    }
    const AssemblyPlan plan = assembly_plan(pattern, ordered_assembly_tree(pattern, options));
    const py::ssize_t count = plan.front_count();
    IndexArray pivots(count), below(count), parent(count), task(count);
    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& shape = plan.fronts[s].shape;
        pivots.mutable_at(s) = shape.pivots;
        below.mutable_at(s) = shape.below;
        parent.mutable_at(s) = shape.parent;
        task.mutable_at(s) = -1;
    }
    for (std::size_t k = 0; k < plan.subtrees.size(); ++k)
        for (Index s = plan.subtrees[k].begin; s < plan.subtrees[k].end; ++s)
            task.mutable_at(s) = static_cast<Index>(k);
    py::dict found;
    found["pivots"] = pivots;
    found["below"] = below;
    found["parent"] = parent;
    found["task"] = task;
    return found;
}

}  // namespace

void register_elimination_fronts(py::module_& module) {
    module.def(
        "elimination_fronts", &elimination_fronts, py::arg("size"), py::arg("column_starts"), py::arg("rows"),
        py::arg("points") = py::none(),
        "The fronts of a pattern, given as to analyze(), in the order of elimination: {'pivots', 'below', "
        "'parent' (-1: none), 'task' (the subtree that one thread takes; -1: above all subtrees)}.");
}

}  // namespace magshell::bindings
