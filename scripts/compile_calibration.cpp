// scripts/compile_seconds.py compares the time of each unit with that of this file: some Eigen and some loops, as in the core. It includes
// nothing of magshell, so it takes the same time in every release. Nothing calls it.
#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace magshell::calibration {

std::map<std::string, double> sums(const std::vector<std::pair<std::string, Eigen::VectorXd>>& given) {
    std::map<std::string, double> sums;
    for (const auto& [name, each] : given)
        sums[name] += (2.0 * each - each.cwiseAbs() + Eigen::VectorXd::Ones(each.size())).sum();
    return sums;
}

void sort_rows(std::vector<Eigen::Vector3d>& rows) {
    std::sort(rows.begin(), rows.end(),
              [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.norm() < b.norm(); });
}

}  // namespace magshell::calibration
