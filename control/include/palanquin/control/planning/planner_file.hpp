#pragma once

#include <map>
#include <memory>
#include <string>

#include "palanquin/control/planning/team_planner.hpp"

namespace palanquin::planning {

// A planner in a folder: the problem as `palanquin.Lowered.save` writes it, and beside it the file
// "planner", lines of words of which the first says what the line states:
//
//   planner VERSION                                          before all others
//   horizon N
//   rules hips|raibert rigid|ground RESTART_AFTER CANDIDATES THREADS
//   observers ROBOTS[4] PAYLOAD[4]                           ObserverGains; none if missing
//   payload MASS HEIGHT                                      kg, m
//   feet_below hips|load                                     FeetBelow
//   robot NAME MASS STANDING_HEIGHT YAW                      kg, m, rad; of it, on the next lines:
//   grasp ATTACH[3] HAND[3]                                  m
//   hips LF[3] RF[3] LH[3] RH[3]                             m
//   gait NAME PERIOD DUTY[4] OFFSET[4]                       s, cycles
//   trend ..., terrain ...                                   see terrain_file.hpp
//   ditch A B C D                                            m
//   setting NAME VALUE                                       of the SQP
//   policy FAMILY KIND STIFFNESS SMOOTHING
//   parameter NAME VALUE...                                  [N + 1, size]; those that plans do not
//                                                            write, where not the default

/// Writes the file; policies are those of its solvers, by family of inequalities. Throws
/// std::runtime_error when it cannot be written.
void save_planner(const TeamPlanner& planner, const std::map<std::string, Policy>& policies,
                  const std::string& folder);

/// The same planner again, before its first plan. Throws std::runtime_error that names the line and
/// the rule for a folder or a file that is not as it should be.
std::unique_ptr<TeamPlanner> load_planner(const std::string& folder);

}  // namespace palanquin::planning
