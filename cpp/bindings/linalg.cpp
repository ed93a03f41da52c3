// Binds factorizations of sparse symmetric matrices, thread counts, and the description of this build.
#include <pybind11/functional.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <optional>
#include <shared_mutex>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/operator_part.h"
#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/linalg/build_info.h"
#include "magshell/linalg/factor.h"
#include "magshell/linalg/krylov/eigenvalue_count.h"
#include "magshell/linalg/low_rank_factor.h"
#include "magshell/linalg/pattern_checks.h"
#include "magshell/linalg/residual.h"

namespace magshell::bindings {
namespace {

template <class Choice>
Choice chosen(const std::string& name, const char* what,
              const std::vector<std::pair<std::string, Choice>>& choices) {
    std::string known;
    for (const auto& [each, choice] : choices) {
        if (each == name) return choice;
        known += (known.empty() ? "\"" : ", \"") + each + "\"";
    }
    throw InvalidInput(std::string(what) + " must be one of " + known + ", got \"" + name + "\"");
}

const std::vector<std::pair<std::string, Backend>> backends{
    {"supernodal", Backend::supernodal}, {"cholmod", Backend::cholmod}, {"eigen", Backend::eigen}};
const std::vector<std::pair<std::string, Ordering>> orderings{{"best", Ordering::best},
                                                              {"dissection", Ordering::dissection},
                                                              {"amd", Ordering::amd},
                                                              {"metis", Ordering::metis}};

// A factor that several Python threads may use: solves run at the same time, a factorization waits for them.
class SharedFactor {
  public:
    SharedFactor(Index size, const IndexArray& column_starts, const IndexArray& rows,
                 const std::string& backend, const std::string& ordering,
                 const std::optional<Array>& points) {
        auto pattern = std::make_shared<const SparsePattern>(
            SparsePattern{size, to_indices(column_starts, "column_starts"), to_indices(rows, "rows")});
        FactorOptions options{chosen(backend, "backend", backends), chosen(ordering, "ordering", orderings)};
        if (points) {
            if (points->ndim() != 2 || points->shape(1) != 3)
                throw InvalidInput("points must have shape (n, 3), one for each unknown");
            const Rows3 places = to_rows3(*points);
            for (Eigen::Index k = 0; k < places.rows(); ++k)
                options.points.push_back(places.row(k).transpose());
        }
        entries_ = static_cast<py::ssize_t>(pattern->rows.size());
        const py::gil_scoped_release release;
        factor_ = analyze(std::move(pattern), options);
    }

    FactorReport factorize(const Array& values, const Eigen::MatrixXd& columns, const VectorXd& stiffness,
                           const WeightedOperators& operators, bool counted) {
        check_values(values);
        for (const auto& [weight, each] : operators)
            if (!each || each->size() != factor_->size())
                throw InvalidInput("operators must be of vectors of shape (" +
                                   std::to_string(factor_->size()) + ",)");
        const py::gil_scoped_release release;
        const std::unique_lock lock(mutex_);
        if (columns.cols() > 0 && (columns.rows() != factor_->size() || columns.cols() != stiffness.size()))
            throw InvalidInput("columns must have shape (n, k), with a stiffness each, (k,)");
        if (columns.cols() > 0 && !bordered_) {
            if (operated_) throw InvalidInput("columns must be there from the first factorization on");
            std::unique_ptr<LowRankFactor> bordered = std::make_unique<LowRankFactor>(std::move(factor_));
            bordered_ = bordered.get();
            factor_ = std::move(bordered);
        }
        if (bordered_) bordered_->set_low_rank(columns, stiffness);
        if (!operators.empty() && !operated_) {
            std::unique_ptr<OperatorFactor> operated = std::make_unique<OperatorFactor>(std::move(factor_));
            operated_ = operated.get();
            factor_ = std::move(operated);
        }
        if (operated_) {
            const OperatorFactor::Operator sum =
                operators.empty() ? OperatorFactor::Operator() : sum_of(operators);
            operated_->set_operator(sum, sum);
            operated_->set_count_deferred(!counted);
        }
        std::copy_n(values.data(), values.size(), factor_->values().begin());
        return factor_->factorize();
    }

    py::array solve(const Array& rhs) const {
        if (rhs.ndim() < 1 || rhs.ndim() > 2) {
            throw InvalidInput("the right-hand side must have shape (n,) or (n, k), got " +
                               std::to_string(rhs.ndim()) + " axes");
        }
        const py::ssize_t columns = rhs.ndim() == 2 ? rhs.shape(1) : 1;
        using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::MatrixXd solution = Eigen::Map<const RowMajor>(rhs.data(), rhs.shape(0), columns);
        {
            const py::gil_scoped_release release;
            const std::shared_lock lock(mutex_);
            factor_->solve(solution);
        }
        Array result(std::vector<py::ssize_t>(rhs.shape(), rhs.shape() + rhs.ndim()));
        Eigen::Map<RowMajor>(result.mutable_data(), rhs.shape(0), columns) = solution;
        return result;
    }

    VectorXd solve_approximately(VectorXd rhs, double tolerance) const {
        if (rhs.size() != factor_->size())
            throw InvalidInput("the right-hand side must have shape (" + std::to_string(factor_->size()) +
                               ",), got " + std::to_string(rhs.size()));
        const py::gil_scoped_release release;
        const std::shared_lock lock(mutex_);
        factor_->solve_approximately(rhs, tolerance);
        return rhs;
    }

    VectorXd residual(const Array& values, const VectorXd& x, const VectorXd& rhs) const {
        check_values(values);
        if (x.size() != factor_->size() || rhs.size() != factor_->size())
            throw InvalidInput("the solution and the right-hand side must have shape (" +
                               std::to_string(factor_->size()) + ",), got " + std::to_string(x.size()) +
                               " and " + std::to_string(rhs.size()));
        const py::gil_scoped_release release;
        return magshell::residual(*factor_->pattern(), values.data(), x, rhs);
    }

    const Factor& factor() const { return *factor_; }

  private:
    void check_values(const Array& values) const {
        if (values.ndim() == 1 && values.size() == entries_) return;
        throw InvalidInput("values must have one axis and an entry for each of the " +
                           std::to_string(entries_) + " rows of the pattern, got " +
                           std::to_string(values.size()));
    }

    py::ssize_t entries_;
    std::unique_ptr<Factor> factor_;
    LowRankFactor* bordered_ = nullptr;   // factor_ or a part of it, once it has a low-rank part
    OperatorFactor* operated_ = nullptr;  // factor_, once it has operators
    mutable std::shared_mutex mutex_;
};

std::string describe(const FactorReport& report) {
    std::string text =
        "<FactorReport: " + (report.succeeded ? std::string("succeeded") : "failed, " + report.reason);
    text += ", " + std::to_string(report.negative_pivots) + " negative pivots";
    if (report.perturbed_pivots > 0) text += ", " + std::to_string(report.perturbed_pivots) + " replaced";
    return text + ">";
}

}  // namespace

void register_linalg(py::module_& module) {
    py::class_<FactorReport>(module, "FactorReport", "How a factorization went.")
        .def_readonly("succeeded", &FactorReport::succeeded)
        .def_readonly("reason", &FactorReport::reason, "why not, and what it means; empty on success")
        .def_readonly("negative_pivots", &FactorReport::negative_pivots, "the number of negative eigenvalues")
        .def_readonly("perturbed_pivots", &FactorReport::perturbed_pivots,
                      "pivots that were zero to rounding and were replaced; solve() then refines")
        .def_readonly("pivot_growth", &FactorReport::pivot_growth,
                      "max l_ik^2 |d_k| over the largest entry: about 1 or less when definite; 10^p costs "
                      "about p digits")
        .def("__repr__", &describe);

    py::class_<OperatorPart, std::shared_ptr<OperatorPart>>(
        module, "OperatorPart",
        "The part of a Hessian of the free unknowns that is known by its products only: that of the own "
        "field.")
        .def("product", &OperatorPart::product, py::arg("x"), py::call_guard<py::gil_scoped_release>(),
             "The product with a vector of the free unknowns (n,).");

    py::class_<SharedFactor>(
        module, "Factor", "An analysed sparse symmetric pattern; factorize() it with values, then solve().")
        .def(
            "factorize", &SharedFactor::factorize, py::arg("values"),
            py::arg("columns") = Eigen::MatrixXd(0, 0), py::arg("stiffness") = VectorXd(0),
            py::arg("operators") = WeightedOperators(), py::arg("counted") = true,
            "Factorizes the matrix with these values (nnz,), in the order of the pattern's rows, and with "
            "columns u (n, k) of stiffnesses s (k,) beside it: plus the sum of s u u^T; and with operators "
            "[(weight, OperatorPart)]: solves are iterative then, and equal negative eigenvalues count "
            "once. counted: whether the report counts the negative eigenvalues of the whole; otherwise those "
            "without the operators.")
        .def("solve", &SharedFactor::solve, py::arg("rhs"),
             "The solution for the right-hand side (n,) or (n, k).")
        .def(
            "solve_approximately", &SharedFactor::solve_approximately, py::arg("rhs"), py::arg("tolerance"),
            "The solution for the right-hand side (n,). An iterative solve leaves a residual of at most this "
            "part of it.")
        .def("residual", &SharedFactor::residual, py::arg("values"), py::arg("solution"), py::arg("rhs"),
             "rhs (n,) minus the matrix with these values (nnz,) times a solution (n,), added up in as many "
             "digits as the "
             "machine has.")
        .def_property_readonly("name", [](const SharedFactor& f) { return f.factor().name(); })
        .def_property_readonly("size", [](const SharedFactor& f) { return f.factor().size(); })
        .def_property_readonly(
            "nonzeros", [](const SharedFactor& f) { return f.factor().nonzeros(); },
            "entries of L, its diagonal included")
        .def_property_readonly(
            "flops", [](const SharedFactor& f) { return f.factor().flops(); },
            "additions and multiplications of one factorization")
        .def_property_readonly("bytes", [](const SharedFactor& f) { return f.factor().bytes(); });

    module.def(
        "analyze",
        [](Index size, const IndexArray& column_starts, const IndexArray& rows, const std::string& backend,
           const std::string& ordering, const std::optional<Array>& points) {
            return std::make_unique<SharedFactor>(size, column_starts, rows, backend, ordering, points);
        },
        py::arg("size"), py::arg("column_starts"), py::arg("rows"), py::arg("backend") = "supernodal",
        py::arg("ordering") = "best", py::arg("points") = py::none(),
        "Orders and analyses the lower triangle of a symmetric pattern, given by columns: sorted rows, "
        "diagonal present. points (n, 3): where the unknowns are, which makes for better orderings.");

    using Image = std::function<VectorXd(const VectorXd&)>;
    module.def(
        "directions_below",
        [](const Image& solve, const Image& product, const VectorXd& diagonal, double bound) {
            const EigenvalueCount count = count_below([&](VectorXd& x) { x = solve(x); }, diagonal, product,
                                                      bound, /*with_directions=*/true);
            return py::make_tuple(count.settled, count.directions);
        },
        py::arg("solve"), py::arg("product"), py::arg("diagonal"), py::arg("bound"),
        "Looks for eigenvalues of A^-1 H below a bound, for a positive definite A (n, n) that is known by "
        "solves and its diagonal (n,), and a symmetric H that is known by products. Returns whether none was "
        "missed, with an estimated probability of 1e-3, and approximate eigenvectors (n, k), one for equal "
        "eigenvalues.");

    module.def("factor_backends", [] {
        std::vector<std::string> built;
        for (const auto& [name, backend] : backends) {
            if (is_built(backend)) built.push_back(name);
        }
        return built;
    });
    module.def("factor_orderings", [] {
        std::vector<std::string> built;
        for (const auto& [name, ordering] : orderings) {
            if (is_built(ordering)) built.push_back(name);
        }
        return built;
    });
    module.def("build_info", &linalg_build_info);
    module.def("num_threads", &num_threads);
    module.def("set_num_threads", &set_num_threads, py::arg("count"));
}

}  // namespace magshell::bindings
