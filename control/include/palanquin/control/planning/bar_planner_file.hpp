#pragma once

#include <memory>
#include <string>
#include <vector>

#include "palanquin/control/planning/bar_planner.hpp"

namespace palanquin::planning {

// A planner of robots on bars in a folder: the file "planner", and its problems in folders of their
// own, as `palanquin.Lowered.save` writes them. The file's lines state
//
//   bar_planner VERSION                                      before all others
//   kind centralized|distributed INTERVAL                    s; of the distributed ones besides:
//   exchange DUAL_TERMS EXCHANGES                            0 or 1, a sample
//   link SENDER RECEIVER DELAY LOSS BIAS BIAS_FROM SEED      LinkSettings
//   leash circle|square LENGTH                               m
//   robot MASS                                               kg
//   bar FIRST SECOND ROWS                                    its robots, from 0 on
//   setting NAME VALUE                                       of the SQPs
//   problem FOLDER HORIZON                                   one, or one a robot; of it:
//   parameter NAME VALUE...                                  [N + 1, size], where not the default

/// Writes the file; `problems` are the folders in it of the planner's problems, in their order.
/// Throws std::runtime_error when it cannot be written.
void save_bar_planner(const BarPlanner& planner, const std::vector<std::string>& problems,
                      const std::string& folder);

/// The same planner again, before its first plan. Throws std::runtime_error that names the line and
/// the rule for a folder or a file that is not as it should be.
std::unique_ptr<BarPlanner> load_bar_planner(const std::string& folder);

}  // namespace palanquin::planning
