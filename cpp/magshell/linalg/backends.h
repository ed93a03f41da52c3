// The other factorizations, each in its own file so that no library's header reaches further.
#pragma once

#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

/// CHOLMOD's supernodal L L^T. Throws InvalidInput where magshell was built without CHOLMOD.
std::unique_ptr<Factor> make_cholmod_factor(std::shared_ptr<const SparsePattern> pattern, Ordering ordering);

/// Eigen's simplicial L D L^T with Eigen's own AMD.
std::unique_ptr<Factor> make_eigen_factor(std::shared_ptr<const SparsePattern> pattern);

}  // namespace magshell
