#include "palanquin/core/stage_qp_check.hpp"

#include <stdexcept>
#include <string>

namespace palanquin {
namespace {

/// Checks the arrays of one knot, whose name goes into the message.
class KnotCheck {
 public:
  explicit KnotCheck(int knot) : knot_(knot) {}

  void block(const char* field, const SparseBlock& block, Eigen::Index rows, int cols) const {
    if (block.rows != rows) fail(field, "rows", block.rows, rows);
    // A block without rows may have been left without columns.
    if (block.cols != cols && rows > 0) fail(field, "columns", block.cols, cols);
    if (static_cast<int>(block.column_start.size()) != block.cols + 1)
      fail(field, "column starts", static_cast<long>(block.column_start.size()), block.cols + 1);
    const long nnz = block.nnz();
    if (static_cast<long>(block.row_index.size()) != nnz)
      fail(field, "row indices", static_cast<long>(block.row_index.size()), nnz);
    if (static_cast<long>(block.values.size()) != nnz)
      fail(field, "values", static_cast<long>(block.values.size()), nnz);
  }
  void size(const char* field, Eigen::Index actual, Eigen::Index expected) const {
    if (actual != expected) fail(field, "entries", actual, expected);
  }

 private:
  [[noreturn]] void fail(const char* field, const char* what, long actual, long expected) const {
    throw std::invalid_argument("stage QP, knot " + std::to_string(knot_) + ": " + field + " has " +
                                std::to_string(actual) + " " + what + ", but must have " +
                                std::to_string(expected));
  }

  int knot_;
};

}  // namespace

void require_consistent(const StageQp& qp) {
  if (qp.stages.empty()) throw std::invalid_argument("stage QP has no knots, but must have one");
  KnotCheck(0).size("initial_state", qp.initial_state.size(), qp.stages[0].nx);
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const KnotCheck check(k);
    const int nw = stage.nw();
    const int next_nx = k < qp.horizon() ? qp.stages[k + 1].nx : 0;
    check.block("dynamics", stage.dynamics, next_nx, nw);
    check.block("implicit", stage.implicit, next_nx, next_nx);
    check.size("offset", stage.offset.size(), next_nx);
    check.block("hessian", stage.hessian, nw, nw);
    check.size("gradient", stage.gradient.size(), nw);
    const Eigen::Index np = stage.penalty_value.size();
    check.block("penalty_jacobian", stage.penalty_jacobian, np, nw);
    check.size("penalty_policy", static_cast<Eigen::Index>(stage.penalty_policy.size()), np);
    check.block("equality_jacobian", stage.equality_jacobian, stage.equality_value.size(), nw);
    check.block("inequality_jacobian", stage.inequality_jacobian, stage.inequality_value.size(),
                nw);
    check.block("link_jacobian", stage.link_jacobian, stage.link_value.size(), nw);
    if (k > 0)
      check.block("link_previous", stage.link_previous, stage.link_value.size(),
                  qp.stages[k - 1].nw());
    else
      check.size("link_value", stage.link_value.size(), 0);
  }
}

}  // namespace palanquin
