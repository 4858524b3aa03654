#pragma once

#include <IpTNLP.hpp>
#include <vector>

#include "palanquin/core/diagnosis/violations.hpp"
#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/ipopt.hpp"

namespace palanquin {

/// The `nlp_*` functions of a lowered problem; results as listed in palanquin/lowering/__init__.py.
struct Ipopt::Functions {
  explicit Functions(const std::string& path);
  LoweredLibrary library;
  LoweredFunction running, running_hessian, terminal, terminal_hessian, link, link_hessian;
};

/// The whole-horizon nonlinear program that Ipopt sees, in ambient coordinates:
///
///   variables   z_k without the known x_0 and absent blocks; one t per penalised row
///   minimise    sum of stage costs + sum S(t)
///   subject to  d(z_k) - s x_{k+1} = 0, g = 0, c = 0, h <= 0 (hard rows), h - t = 0 (penalised)
///
/// where g and c hold what roles and charts say, and s is -1 where a quaternion of the guess lies
/// on the other side than its dynamics: q and -q are one orientation, and each keeps its side.
class Nlp : public ::Ipopt::TNLP {
 public:
  Nlp(const LoweredProblem& problem, const Ipopt::Functions& functions,
      const TranscriptionWorkspace& rows, bool penalize, MatrixView parameters, VectorView measured,
      MatrixView guess);

  /// The last iterate as a trajectory.
  const RowMatrix& trajectory() const { return trajectory_; }
  /// Of that iterate. The penalties' slopes stand for themselves.
  const RowMultipliers& multipliers() const { return multipliers_; }

 private:
  using Index = ::Ipopt::Index;
  using Number = ::Ipopt::Number;

  /// One knot: where its variables and rows are, and what the functions last gave.
  struct Knot {
    std::vector<Index> variable;                  // [nz], -1 where a constant
    Index dynamics_row = -1;                      // first of nx rows, running knots only
    std::vector<int> equality, inequality, link;  // active lowered rows
    std::vector<Index> slack;                     // per active inequality, -1: hard
    std::vector<Policy> policy;                   // per active inequality
    Index equality_row = 0, inequality_row = 0, link_row = 0;
    // values
    std::vector<double> next_state, g, h, c;
    std::vector<double> side;  // [nx] of the next state: s of the rows above
    double cost = 0.0;
    std::vector<double> dd, dcost, dg, dh, dc_previous, dc, hessian, link_hessian;
    std::vector<double> multiplier_d, multiplier_g, multiplier_h, multiplier_c;
  };

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess,
                    IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override;
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_l, Number* z_u,
                          Index m, bool init_lambda, Number* lambda) override;
  bool eval_f(Index n, const Number* x, bool new_x, Number& value) override;
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) override;
  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* g) override;
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nnz, Index* row, Index* col,
                  Number* values) override;
  bool eval_h(Index n, const Number* x, bool new_x, Number sigma, Index m, const Number* lambda,
              bool new_lambda, Index nnz, Index* row, Index* col, Number* values) override;
  void finalize_solution(::Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_l,
                         const Number* z_u, Index m, const Number* g, const Number* lambda,
                         Number value, const ::Ipopt::IpoptData* data,
                         ::Ipopt::IpoptCalculatedQuantities* quantities) override;

  void lay_out(const TranscriptionWorkspace& rows, bool penalize);
  void choose_sides();
  void refresh(const Number* x, bool new_x);
  void evaluate_knots();
  void scatter(const Number* x);
  /// Visits every Jacobian entry in a fixed order: emit(row, column, value).
  template <typename Emit>
  void visit_jacobian(Emit emit) const;
  template <typename Emit>
  void visit_hessian(Emit emit) const;
  void keep_multipliers(const Number* lambda);
  void evaluate_hessians(Number sigma, const Number* lambda);

  const LoweredProblem& problem_;
  const Ipopt::Functions& functions_;
  RowMatrix parameters_;
  Eigen::VectorXd measured_;
  RowMatrix guess_, trajectory_;
  RowMultipliers multipliers_;
  std::vector<Knot> knots_;
  std::vector<int> state_entries_;  // entries of z that are states
  std::vector<double> slack_values_;
  FunctionWorkspace workspace_;
  Index variables_ = 0, first_slack_ = 0, rows_ = 0;
  Number sigma_ = 1.0;
};

}  // namespace palanquin
