// CHOLMOD's settings object and a view of a pattern, for the files that call CHOLMOD. Included by linalg/*.cpp
// only.
#pragma once

#include <cholmod.h>

#include "magshell/linalg/factor.h"

namespace magshell {

class CholmodCommon {
  public:
    CholmodCommon() {
        cholmod_start(&common_);
        common_.print = 0;  // failures are reported by their status, not on standard output
    }
    ~CholmodCommon() { cholmod_finish(&common_); }
    CholmodCommon(const CholmodCommon&) = delete;
    CholmodCommon& operator=(const CholmodCommon&) = delete;
    operator cholmod_common*() { return &common_; }
    cholmod_common* operator->() { return &common_; }
    int status() const { return common_.status; }

  private:
    cholmod_common common_;
};

/// Returns the lower triangle as CHOLMOD's type without copying; without values if `values` is null.
inline cholmod_sparse cholmod_view(const SparsePattern& pattern, const double* values) {
    cholmod_sparse view{};
    view.nrow = view.ncol = static_cast<std::size_t>(pattern.size);
    view.nzmax = pattern.rows.size();
    view.p = const_cast<Index*>(pattern.column_starts.data());
    view.i = const_cast<Index*>(pattern.rows.data());
    view.x = const_cast<double*>(values);
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = values ? CHOLMOD_REAL : CHOLMOD_PATTERN;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = view.packed = 1;
    return view;
}

}  // namespace magshell
