#include <stdexcept>
#include <string>

#include "structured/plan_store.hpp"

namespace palanquin::structured {
namespace {

[[noreturn]] void fail(int knot, const char* what, const std::string& found,
                       const std::string& expected) {
  throw std::invalid_argument("StageQp: knot " + std::to_string(knot) + ": " + what + " is " +
                              found + ", but must be " + expected);
}

std::string shape(int rows, int cols) {
  return std::to_string(rows) + " x " + std::to_string(cols);
}

void check_block(int knot, const char* name, const SparseBlock& block, int rows, int cols) {
  if (block.rows != rows || block.cols != cols)
    fail(knot, name, shape(block.rows, block.cols), shape(rows, cols));
  if (static_cast<int>(block.column_start.size()) != cols + 1 ||
      static_cast<int>(block.row_index.size()) != block.nnz() ||
      static_cast<int>(block.values.size()) != block.nnz())
    fail(knot, name, "cut short", "whole: start, row and value lists of one length");
  for (int j = 0; j < cols; ++j) {
    for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e) {
      const bool ascends =
          e == block.column_start[j] || block.row_index[e - 1] < block.row_index[e];
      if (block.row_index[e] < 0 || block.row_index[e] >= rows || !ascends)
        fail(knot, name, "not in order at column " + std::to_string(j),
             "a list of ascending rows per column");
    }
  }
}

void check_vector(int knot, const char* name, const Eigen::VectorXd& vector, int size) {
  if (vector.size() != size)
    fail(knot, name, std::to_string(vector.size()) + " long", std::to_string(size) + " long");
}

/// A block of optional rows: nothing at all is fine too.
int checked_rows(int knot, const char* name, const SparseBlock& block, int cols) {
  if (block.rows == 0 && block.nnz() == 0) return 0;
  check_block(knot, name, block, block.rows, cols);
  return block.rows;
}

void check_hessian(int knot, const SparseBlock& hessian, int nw) {
  check_block(knot, "hessian", hessian, nw, nw);
  for (int j = 0; j < nw; ++j)
    if (hessian.column_start[j] == hessian.column_start[j + 1] ||
        hessian.row_index[hessian.column_start[j]] != j)
      fail(knot, "hessian", "without (" + std::to_string(j) + ", " + std::to_string(j) + ")",
           "a lower triangle with the whole diagonal");
}

void check_dynamics(int knot, const QpStage& stage, int next_nx) {
  check_block(knot, "dynamics", stage.dynamics, next_nx, stage.nw());
  if (stage.dynamics.column_start[stage.nx + stage.nu] != stage.dynamics.nnz())
    fail(knot, "dynamics", "entered by a local", "empty in the locals' columns");
  check_block(knot, "implicit", stage.implicit, next_nx, next_nx);
  check_vector(knot, "offset", stage.offset, next_nx);
}

}  // namespace

void check_dimensions(const StageQp& qp, int k) {
  const QpStage& stage = qp.stages[k];
  if (k == 0) check_vector(0, "initial_state", qp.initial_state, stage.nx);
  if (stage.nx < 0 || stage.nu < 0 || stage.nl < 0) fail(k, "a dimension", "negative", "0 or more");
  check_hessian(k, stage.hessian, stage.nw());
  check_vector(k, "gradient", stage.gradient, stage.nw());
  checked_rows(k, "penalty_jacobian", stage.penalty_jacobian, stage.nw());
  check_vector(k, "equality_value", stage.equality_value,
               checked_rows(k, "equality_jacobian", stage.equality_jacobian, stage.nw()));
  if (k < qp.horizon()) check_dynamics(k, stage, qp.stages[k + 1].nx);
}

}  // namespace palanquin::structured
