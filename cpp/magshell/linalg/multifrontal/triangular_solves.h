// Forward and backward substitution through the fronts of a supernodal L D L^T.
#pragma once

#include <vector>

#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/pivot_block.h"
#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {

/// A finished factorization, as the substitutions need it.
struct FactorView {
    const AssemblyPlan& plan;
    double* panels;
    Pivots pivots;
    const Index* pivot_order;  // within each front
};

/// Replaces x by (L D L^T)^-1 x for one vector in elimination order.
void substitute_one(const FactorView& factor, double* x);

/// Does the same for eight vectors side by side: x holds eight doubles per unknown, 64-byte aligned.
void substitute_eight(const FactorView& factor, double* x);

}  // namespace magshell
