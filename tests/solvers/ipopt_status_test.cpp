#include "ipopt_status.hpp"

#include <gtest/gtest.h>

#include <IpReturnCodes.hpp>
#include <set>

namespace palanquin {
namespace {

constexpr int kCodes[] = {
    ::Ipopt::Solve_Succeeded,
    ::Ipopt::Solved_To_Acceptable_Level,
    ::Ipopt::Infeasible_Problem_Detected,
    ::Ipopt::Search_Direction_Becomes_Too_Small,
    ::Ipopt::Diverging_Iterates,
    ::Ipopt::User_Requested_Stop,
    ::Ipopt::Feasible_Point_Found,
    ::Ipopt::Maximum_Iterations_Exceeded,
    ::Ipopt::Restoration_Failed,
    ::Ipopt::Error_In_Step_Computation,
    ::Ipopt::Maximum_CpuTime_Exceeded,
    ::Ipopt::Maximum_WallTime_Exceeded,
    ::Ipopt::Not_Enough_Degrees_Of_Freedom,
    ::Ipopt::Invalid_Problem_Definition,
    ::Ipopt::Invalid_Option,
    ::Ipopt::Invalid_Number_Detected,
    ::Ipopt::Unrecoverable_Exception,
    ::Ipopt::NonIpopt_Exception_Thrown,
    ::Ipopt::Insufficient_Memory,
    ::Ipopt::Internal_Error,
};

TEST(IpoptStatus, SaysEveryCodeInWordsOfItsOwn) {
  std::set<std::string> messages;
  for (const int code : kCodes) {
    const std::string message = interpret_ipopt(code).second;
    EXPECT_EQ(message.find_first_of("0123456789"), std::string::npos) << message;
    EXPECT_GT(message.size(), 5u);
    messages.insert(message);
  }
  EXPECT_EQ(messages.size() + 1, std::size(kCodes));  // two kinds of time are one
}

TEST(IpoptStatus, OnlyWhatIsSolvedHasConverged) {
  for (const int code : kCodes) {
    const bool is_solved = code == ::Ipopt::Solve_Succeeded ||
                           code == ::Ipopt::Solved_To_Acceptable_Level ||
                           code == ::Ipopt::Feasible_Point_Found;
    EXPECT_EQ(interpret_ipopt(code).first == Status::Converged, is_solved) << code;
  }
  EXPECT_EQ(interpret_ipopt(::Ipopt::Diverging_Iterates).first, Status::QpFailed);
}

TEST(IpoptStatus, ShowsACodeOfALaterVersion) {
  EXPECT_NE(interpret_ipopt(-77).second.find("(-77)"), std::string::npos);
}

}  // namespace
}  // namespace palanquin
