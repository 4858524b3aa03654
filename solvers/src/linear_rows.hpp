#pragma once

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// Whether `w` satisfies the initial state, dynamics, equality, link and hard rows of `qp` to
/// `tolerance`; not if a residual is NaN. `buffer` is scratch that only ever grows.
bool satisfies_rows(const StageQp& qp, const std::vector<Eigen::VectorXd>& w, double tolerance,
                    Eigen::VectorXd& buffer);

}  // namespace palanquin
