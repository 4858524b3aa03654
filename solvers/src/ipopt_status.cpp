#include "ipopt_status.hpp"

#include <IpReturnCodes.hpp>

namespace palanquin {

std::pair<Status, std::string> interpret_ipopt(int code) {
  switch (code) {
    case ::Ipopt::Solve_Succeeded:
      return {Status::Converged, "optimal"};
    case ::Ipopt::Solved_To_Acceptable_Level:
      return {Status::Converged, "solved to Ipopt's acceptable level"};
    case ::Ipopt::Feasible_Point_Found:
      return {Status::Converged, "as many equations as unknowns: a feasible point was found"};
    case ::Ipopt::Infeasible_Problem_Detected:
      return {Status::Infeasible, "converged to a point of local infeasibility"};
    case ::Ipopt::Restoration_Failed:
      return {Status::Infeasible, "the restoration of feasibility failed"};
    case ::Ipopt::Search_Direction_Becomes_Too_Small:
      return {Status::Stalled, "the search direction became too small"};
    case ::Ipopt::Maximum_Iterations_Exceeded:
      return {Status::NotSolved, "maximum number of iterations exceeded"};
    case ::Ipopt::Maximum_CpuTime_Exceeded:
    case ::Ipopt::Maximum_WallTime_Exceeded:
      return {Status::TimeLimit, "maximum time exceeded"};
    case ::Ipopt::User_Requested_Stop:
      return {Status::NotSolved, "stopped on request"};
    case ::Ipopt::Diverging_Iterates:
      return {Status::QpFailed, "the iterates diverge: the cost may be unbounded below"};
    case ::Ipopt::Error_In_Step_Computation:
      return {Status::QpFailed, "no step could be computed: the linear system is singular"};
    case ::Ipopt::Not_Enough_Degrees_Of_Freedom:
      return {Status::QpFailed, "there are more equations than unknowns"};
    case ::Ipopt::Invalid_Number_Detected:
      return {Status::NonFinite, "a function is not finite"};
    case ::Ipopt::Invalid_Problem_Definition:
      return {Status::QpFailed, "Ipopt finds the problem's sizes or bounds inconsistent"};
    case ::Ipopt::Invalid_Option:
      return {Status::QpFailed, "Ipopt does not take one of its options"};
    case ::Ipopt::Insufficient_Memory:
      return {Status::QpFailed, "there was not enough memory"};
    case ::Ipopt::Unrecoverable_Exception:
      return {Status::QpFailed, "Ipopt met an error that it cannot recover from"};
    case ::Ipopt::NonIpopt_Exception_Thrown:
      return {Status::QpFailed, "an evaluation threw an exception"};
    case ::Ipopt::Internal_Error:
      return {Status::QpFailed, "Ipopt met an internal error"};
    default:
      return {Status::QpFailed,
              "Ipopt stopped for a reason unknown to us (" + std::to_string(code) + ")"};
  }
}

}  // namespace palanquin
