// Follows a path of equilibria by pseudo-arclength continuation in the load parameters, through limit points, and locates its
// critical points [Riks; Crisfield 9].
//
// A point of the path is a state q and a path parameter lambda, which is 0 at the initial load parameters and 1 at the final ones. The arc
// length s is measured by
//
//   ds^2 = |dx|^2 / extent^2 + psi^2 dlambda^2          |.|: root mean square of the displacement over the area of the bodies
//
// with psi chosen so that both terms are equal at the start. A step goes along the tangent (predictor); mixed Newton steps perpendicular to
// the tangent then lead back to the path (corrector).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "magshell/solve/newton/newton.h"
#include "magshell/solve/statics.h"

namespace magshell {

struct PathPoint {
    VectorXd state;
    double parameter = 0.0;
    Model::AngleBranches angle_branches;
    Index unstable_directions = 0;      // as count_unstable_directions
    double field_sampling_error = 0.0;  // [-] as Term::field_sampling_error
};

/// limit: the path turns round. bifurcation: another path crosses. flutter: a pair of complex eigenvalues changes the sign of its real part.
enum class CriticalKind { limit, bifurcation, flutter };

struct CriticalPoint {
    PathPoint point;
    CriticalKind kind;
    VectorXd mode;      // of all dofs, largest displacement 1
    Index after_point;  // index of the last path point before it
    double psi;         // weight of the path parameter in the arc length
};

struct PathOptions {
    NewtonOptions newton;
    double first_step = 0.05;  // [-] change of the path parameter in the first step
    double max_step = 0.02;    // [-] largest arc length: about the rms displacement over the extent
    int max_points = 1000;
    double min_parameter = -1e300, max_parameter = 1.0;  // [-] the path ends at either
    bool locate_critical = true;                // whether to compute the critical points between path points
    std::vector<WatchedObstacle> watched = {};  // those that move
    std::optional<CriticalPoint> branch_at =
        {};                    // a bifurcation where the path begins, on the branch that crosses there
    double branch_side = 1.0;  // +-1: the direction along its mode
};

struct PathResult {
    Outcome outcome = Outcome::failed;
    std::vector<PathPoint> points;
    std::vector<CriticalPoint> critical;
    std::string reason;  // why the path ended
    int iterations = 0, factorizations = 0, failed_factorizations = 0;
};

/// Called with every accepted point; the path ends there if it returns true.
using Until = std::function<bool(const PathPoint&)>;

/// Follows the path from an equilibrium `start` at the load parameters `from` towards `to`. `varying`: parameters that vary with them;
/// their values are appended to both.
PathResult follow_path(Model& model, const VectorXd& start, const Model::AngleBranches& angle_branches,
                       const LoadParameters& from, const LoadParameters& to, const PathOptions& options,
                       const Until& until, const StaticsWatch& watch = {},
                       const TimeVaryingParameters& varying = {});

}  // namespace magshell
