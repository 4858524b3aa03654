#pragma once

#include <map>

#include "palanquin/control/planning/layered_planner.hpp"
#include "palanquin/control/planning/link.hpp"

namespace palanquin::planning {

/// The planner of one robot (23). Of its neighbours it knows what they sent, and their gait.
class LocalPlanner {
 public:
  /// Keeps a reference to the team. The problem has blocks robot<i>.* of the robot alone and
  /// bar<b>.lambda of its bars; throws std::invalid_argument that names what it lacks.
  LocalPlanner(const BarTeam& team, int robot, bool dual_terms, std::shared_ptr<LinearMpc> mpc);

  /// Before the first sample: how the robot stands, with multipliers held as given [rows of all
  /// bars], as a message.
  const Message& greet(const BarSample& sample, const RowMatrix& inputs,
                       const Eigen::VectorXd& multipliers);

  /// One QP at sample `step`, with u_{t-1} of all robots [N, 12 M], what the neighbours sent as
  /// seen now, and biases of the multipliers that it agrees on. Returns whether it has a solution;
  /// without one its message is the last one, aged.
  bool solve(int step, const BarSample& sample, double dt, const RowMatrix& inputs,
             const std::map<int, Message>& heard, const std::map<int, double>& biases);

  int robot() const { return robot_; }
  const std::vector<int>& neighbours() const { return neighbours_; }
  const std::vector<int>& bars() const { return bars_; }
  const LinearMpc& mpc() const { return *mpc_; }
  const Message& message() const { return message_; }  ///< of the last solve
  Status status() const { return status_; }
  double solve_ms() const { return solve_ms_; }

 private:
  struct Heard {
    int rotation, feet, contact, op, op_input, plan, plan_input, dual;
  };
  struct Multipliers {
    int block, op, agreed, rows;
  };
  void hear(int neighbour, const Message& message, const Flags& contacts);
  void agree(int step, const std::map<int, Message>& heard, const std::map<int, double>& biases);
  void read_solution(int step, const BarSample& sample);

  const BarTeam& team_;
  int robot_;
  bool dual_terms_;
  std::shared_ptr<LinearMpc> mpc_;
  std::vector<int> neighbours_, bars_;
  BarRobotSlots own_;
  int op_, op_input_;
  std::map<int, Heard> heard_;
  std::map<int, Multipliers> multipliers_;
  Message last_;  ///< the last solution
  Message message_;
  Status status_ = Status::NotSolved;
  double solve_ms_ = 0.0;
};

}  // namespace palanquin::planning
