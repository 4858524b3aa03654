#include "elimination/substitution.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palanquin {
namespace {

constexpr std::size_t kMostOthers = 4;  ///< of a row that gives a variable: more would fill H'
constexpr double kLeastPivot = 1e-3;    ///< of the largest entry of its row

bool has_entries(const SparseBlock& block, int column) {
  return column < block.cols && block.column_start[column] < block.column_start[column + 1];
}

/// y += column of `block` * scale
void add_column(const SparseBlock& block, int column, double scale, Eigen::VectorXd& y) {
  if (y.size() == 0) return;
  for (int e = block.column_start[column]; e < block.column_start[column + 1]; ++e)
    y[block.row_index[e]] += block.values[e] * scale;
}

}  // namespace

Substitution::Substitution(const QpStage& stage, const std::vector<char>& refused)
    : given_by_(index(stage.nw()), -1), nx_(stage.nx), nu_(stage.nu) {
  list_rows(stage.equality_jacobian);
  for (int i = 0; i < stage.equality_jacobian.rows; ++i)
    if (!refused[index(i)] && row_entries_[index(i)].size() <= 1 + kMostOthers) give(stage, i);
  if (given_.empty()) return;
  number_columns(stage);
  list_curvatures(stage.hessian);
  shape(stage, pattern_);
}

void Substitution::list_rows(const SparseBlock& block) {
  row_entries_.assign(index(block.rows), {});
  row_columns_.assign(index(block.rows), {});
  rows_over_.assign(given_by_.size(), 0);
  for (int j = 0; j < block.cols; ++j)
    for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e) {
      row_entries_[index(block.row_index[e])].push_back(e);
      row_columns_[index(block.row_index[e])].push_back(j);
      ++rows_over_[index(j)];
    }
}

/// The row gives the variable with the largest entry among those that only it is over: one that the
/// dynamics depend on only if the row is over nothing else, as theirs are the columns that cost; an
/// input only if the row is over no local, which the gain does not know.
void Substitution::give(const QpStage& stage, int row) {
  const std::vector<int>& entries = row_entries_[index(row)];
  const std::vector<int>& columns = row_columns_[index(row)];
  const std::vector<double>& values = stage.equality_jacobian.values;
  const auto size_of = [&](std::size_t n) { return std::abs(values[index(entries[n])]); };
  const int first_local = stage.nx + stage.nu;
  const bool has_local = !columns.empty() && columns.back() >= first_local;
  std::size_t best = entries.size();
  double largest = 0.0;
  for (std::size_t n = 0; n < entries.size(); ++n) {
    largest = std::max(largest, size_of(n));
    const bool may = columns[n] >= (has_local ? first_local : stage.nx) &&
                     rows_over_[index(columns[n])] == 1 &&
                     (entries.size() == 1 || !has_entries(stage.dynamics, columns[n]));
    if (may && (best == entries.size() || size_of(n) > size_of(best))) best = n;
  }
  if (best == entries.size() || !(size_of(best) > 0.0) || size_of(best) < kLeastPivot * largest)
    return;
  const int column = columns[best];
  given_by_[index(column)] = static_cast<int>(given_.size());
  given_.push_back({.row = row,
                    .column = column,
                    .pivot = entries[best],
                    .first = static_cast<int>(slope_entry_.size()),
                    .size = static_cast<int>(entries.size()) - 1});
  for (std::size_t n = 0; n < entries.size(); ++n) {
    if (n == best) continue;
    slope_entry_.push_back(entries[n]);
    slope_column_.push_back(columns[n]);
  }
}

void Substitution::number_columns(const QpStage& stage) {
  kept_columns_.clear();
  kept_rows_.clear();
  std::vector<int> place(index(stage.nw()), -1);
  kept_nu_ = 0;
  for (int j = 0; j < stage.nw(); ++j) {
    if (given_by_[index(j)] >= 0) continue;
    place[index(j)] = static_cast<int>(kept_columns_.size());
    kept_columns_.push_back(j);
    kept_nu_ += j >= stage.nx && j < stage.nx + stage.nu;
  }
  std::vector<char> goes(row_entries_.size(), 0);
  for (const Given& g : given_) goes[index(g.row)] = 1;
  for (std::size_t i = 0; i < goes.size(); ++i)
    if (!goes[i]) kept_rows_.push_back(static_cast<int>(i));

  start_.assign(1, 0);
  parts_.clear();
  for (int j = 0; j < stage.nw(); ++j) {
    if (const int n = given_by_[index(j)]; n >= 0) {
      const Given& g = given_[index(n)];
      for (int s = g.first; s < g.first + g.size; ++s)
        parts_.push_back({place[index(slope_column_[index(s)])], s});
    } else {
      parts_.push_back({place[index(j)], -1});
    }
    start_.push_back(static_cast<int>(parts_.size()));
  }
  parts_.push_back({-1, -1});  // so that begin() of an empty last column is a valid address
}

/// The columns of H that belong to what is given, out of its lower triangle.
void Substitution::list_curvatures(const SparseBlock& hessian) {
  std::vector<std::vector<int>> rows(given_.size()), entries(given_.size());
  const auto add = [&](int column, int row, int entry) {
    if (given_by_[index(column)] < 0) return;
    rows[index(given_by_[index(column)])].push_back(row);
    entries[index(given_by_[index(column)])].push_back(entry);
  };
  for (int j = 0; j < hessian.cols; ++j)
    for (int e = hessian.column_start[j]; e < hessian.column_start[j + 1]; ++e) {
      add(j, hessian.row_index[e], e);
      if (hessian.row_index[e] != j) add(hessian.row_index[e], j, e);
    }
  for (std::size_t n = 0; n < given_.size(); ++n) {
    given_[n].first_curvature = static_cast<int>(curvature_row_.size());
    given_[n].curvatures = static_cast<int>(rows[n].size());
    curvature_row_.insert(curvature_row_.end(), rows[n].begin(), rows[n].end());
    curvature_entry_.insert(curvature_entry_.end(), entries[n].begin(), entries[n].end());
  }
}

Substitution::Values Substitution::make_values() const {
  Values values;
  values.slopes.assign(std::max<std::size_t>(1, slope_entry_.size()), 0.0);
  values.shift.setZero(static_cast<Eigen::Index>(given_by_.size()));
  return values;
}

bool Substitution::holds(const QpStage& stage, std::vector<char>& refused) const {
  const std::vector<double>& values = stage.equality_jacobian.values;
  bool all = true;
  for (const Given& g : given_) {
    const double pivot = std::abs(values[index(g.pivot)]);
    double largest = pivot;
    for (int s = g.first; s < g.first + g.size; ++s)
      largest = std::max(largest, std::abs(values[index(slope_entry_[index(s)])]));
    if (!(pivot < kLeastPivot * largest) && pivot != 0.0) continue;  // NaN passes, and is found
    refused[index(g.row)] = 1;
    all = false;
  }
  return all;
}

void Substitution::shape(const QpStage& stage, QpStage& reduced) {
  reduced.nx = stage.nx;
  reduced.nu = kept_nu_;
  reduced.nl = static_cast<int>(kept_columns_.size()) - stage.nx - kept_nu_;
  reduced.pattern = -1;
  shape_rows(stage.dynamics, reduced.dynamics, dynamics_);
  reduced.implicit = stage.implicit;
  shape_rows(stage.penalty_jacobian, reduced.penalty_jacobian, penalty_);
  shape_rows(stage.inequality_jacobian, reduced.inequality_jacobian, inequality_);

  const int nw = reduced.nw();
  std::vector<GatherTerm> terms;
  add_congruence_terms(stage.hessian, *this, terms);
  for (int c = 0; c < nw; ++c) terms.push_back({c, c, GatherTerm::kStructural, -1, -1});
  assemble(std::move(terms), nw, nw, reduced.hessian, hessian_);
  hessian_.separate_copies(reduced.hessian.nnz());

  gradient_ = {};
  for (int j = 0; j < stage.nw(); ++j)
    for (const Part* p = begin(j); p != end(j); ++p)
      gradient_.entries.push_back({p->column, j, p->slope, -1});
  gradient_.separate_copies(nw);

  // Rows that go have no columns in common with those that stay, but for variables that stay.
  const SparseBlock& block = stage.equality_jacobian;
  std::vector<int> place(index(block.rows), -1);
  for (std::size_t i = 0; i < kept_rows_.size(); ++i)
    place[index(kept_rows_[i])] = static_cast<int>(i);
  terms = {};
  for (int j = 0; j < block.cols; ++j)
    for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e)
      if (place[index(block.row_index[e])] >= 0)
        terms.push_back({place[index(block.row_index[e])], begin(j)->column, e, -1, -1});
  assemble(std::move(terms), static_cast<int>(kept_rows_.size()), nw, reduced.equality_jacobian,
           equality_);
  equality_.separate_copies(reduced.equality_jacobian.nnz());
  reduced.equality_value.setZero(static_cast<Eigen::Index>(kept_rows_.size()));
  reduced.gradient.setZero(nw);
}

/// The rows of block T.
void Substitution::shape_rows(const SparseBlock& block, SparseBlock& reduced,
                              Gather& gather) const {
  std::vector<GatherTerm> terms;
  for (int j = 0; j < block.cols; ++j)
    for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e)
      for (const Part* p = begin(j); p != end(j); ++p)
        terms.push_back({block.row_index[e], p->column, e, p->slope, -1});
  assemble(std::move(terms), block.rows, static_cast<int>(kept_columns_.size()), reduced, gather);
  gather.separate_copies(reduced.nnz());
}

void Substitution::write(const QpStage& stage, Values& values, QpStage& reduced) const {
  const std::vector<double>& c = stage.equality_jacobian.values;
  values.is_shifted = false;
  for (const Given& g : given_) {
    const double scale = -1.0 / c[index(g.pivot)];
    for (int s = g.first; s < g.first + g.size; ++s)
      values.slopes[index(s)] = scale * c[index(slope_entry_[index(s)])];
    values.shift[g.column] = scale * stage.equality_value[g.row];
    values.is_shifted = values.is_shifted || values.shift[g.column] != 0.0;
  }
  const auto gather = [&values](const Gather& recipe, const SparseBlock& from, SparseBlock& to) {
    if (from.nnz() > 0) recipe.write(from.values.data(), values.slopes.data(), to.values.data());
  };
  gather(dynamics_, stage.dynamics, reduced.dynamics);
  gather(hessian_, stage.hessian, reduced.hessian);
  gather(penalty_, stage.penalty_jacobian, reduced.penalty_jacobian);
  gather(inequality_, stage.inequality_jacobian, reduced.inequality_jacobian);
  gather(equality_, stage.equality_jacobian, reduced.equality_jacobian);
  reduced.implicit.values = stage.implicit.values;
  reduced.offset = stage.offset;
  reduced.penalty_value = stage.penalty_value;
  reduced.penalty_policy = stage.penalty_policy;
  reduced.inequality_value = stage.inequality_value;
  values.gradient = stage.gradient;
  values.equality_values = stage.equality_value;
  if (values.is_shifted) shift(stage, values, reduced);
  gradient_.write(values.gradient.data(), values.slopes.data(), reduced.gradient.data());
  restrict_multipliers(values.equality_values, reduced.equality_value);
}

void Substitution::shift(const QpStage& stage, Values& values, QpStage& reduced) const {
  values.penalty_shift.setZero(stage.penalty_value.size());
  for (const Given& g : given_) {
    const double t = values.shift[g.column];
    for (int n = g.first_curvature; n < g.first_curvature + g.curvatures; ++n)
      values.gradient[curvature_row_[index(n)]] +=
          stage.hessian.values[index(curvature_entry_[index(n)])] * t;
    add_column(stage.penalty_jacobian, g.column, t, values.penalty_shift);
    add_column(stage.dynamics, g.column, t, reduced.offset);
    add_column(stage.inequality_jacobian, g.column, t, reduced.inequality_value);
  }
  reduced.penalty_value += values.penalty_shift;
}

void Substitution::restrict_variables(const Eigen::VectorXd& w, Eigen::VectorXd& reduced) const {
  for (std::size_t c = 0; c < kept_columns_.size(); ++c)
    reduced[static_cast<Eigen::Index>(c)] = w[kept_columns_[c]];
}

void Substitution::extend_variables(const Values& values, const Eigen::VectorXd& reduced,
                                    Eigen::VectorXd& w) const {
  for (std::size_t c = 0; c < kept_columns_.size(); ++c)
    w[kept_columns_[c]] = reduced[static_cast<Eigen::Index>(c)];
  for (const Given& g : given_) {
    double sum = values.shift[g.column];
    for (int s = g.first; s < g.first + g.size; ++s)
      sum += values.slopes[index(s)] * w[slope_column_[index(s)]];
    w[g.column] = sum;
  }
}

void Substitution::restrict_multipliers(const Eigen::VectorXd& mu, Eigen::VectorXd& reduced) const {
  for (std::size_t i = 0; i < kept_rows_.size(); ++i)
    reduced[static_cast<Eigen::Index>(i)] = mu[kept_rows_[i]];
}

void Substitution::extend_multipliers(const Eigen::VectorXd& reduced, Eigen::VectorXd& mu) const {
  mu.setZero();
  for (std::size_t i = 0; i < kept_rows_.size(); ++i)
    mu[kept_rows_[i]] = reduced[static_cast<Eigen::Index>(i)];
}

void Substitution::find_multipliers(const QpStage& stage,
                                    const Eigen::Ref<const Eigen::VectorXd>& gradient,
                                    Eigen::VectorXd& mu) const {
  for (const Given& g : given_)
    mu[g.row] -= gradient[g.column] / stage.equality_jacobian.values[index(g.pivot)];
}

void Substitution::extend_gain(const Values& values, const Eigen::MatrixXd& reduced,
                               Eigen::Ref<Eigen::MatrixXd> gain) const {
  gain.setZero();
  for (int c = 0; c < kept_nu_; ++c) gain.row(kept_columns_[index(nx_ + c)] - nx_) = reduced.row(c);
  for (const Given& g : given_) {
    if (g.column >= nx_ + nu_) continue;
    for (int s = g.first; s < g.first + g.size; ++s) {
      const int column = slope_column_[index(s)];
      if (column < nx_)
        gain(g.column - nx_, column) += values.slopes[index(s)];
      else if (column < nx_ + nu_)
        gain.row(g.column - nx_) += values.slopes[index(s)] * gain.row(column - nx_);
    }
  }
}

}  // namespace palanquin
