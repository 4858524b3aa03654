#include "palanquin/core/transcription/knot_shape.hpp"

#include <algorithm>

#include "transcription/sizes.hpp"

namespace palanquin {

namespace {
using Term = GatherTerm;
}

// ---- columns ----------------------------------------------------------------------------------

ColumnMap::ColumnMap(const LoweredProblem& problem, const KnotSignature& signature,
                     std::vector<int> memory)
    : memory_(std::move(memory)) {
  const auto& blocks = problem.blocks();
  first_column_.assign(blocks.size(), -1);
  column_count_.assign(blocks.size(), 0);
  int column = 0;
  auto assign = [&](Role role) {
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (signature.role[b] != role) continue;
      first_column_[b] = column;
      column_count_[b] = signature.charted[b] ? blocks[b].chart_size : blocks[b].tangent_size;
      column += column_count_[b];
    }
  };
  assign(Role::State);
  assign(Role::Carried);
  column += static_cast<int>(memory_.size());
  nx = column;
  assign(Role::Input);
  nu = column - nx;
  assign(Role::Local);
  nl = column - nx - nu;

  start_.push_back(0);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (int i = 0; i < blocks[b].tangent_size; ++i) {
      if (first_column_[b] >= 0) {
        if (i < column_count_[b])
          entries_.push_back({first_column_[b] + i, -1});
        else  // a charted block's dependent entry
          for (int c = 0; c < column_count_[b]; ++c)
            entries_.push_back(
                {first_column_[b] + c, blocks[b].slope_offset + c * blocks[b].size + i});
      }
      start_.push_back(entries_.size());
    }
  }
  const int ndz = static_cast<int>(start_.size()) - 1;
  for (int j = 0; j < ndz; ++j)
    for (std::size_t e = start_[j]; e < start_[j + 1]; ++e)
      expansion_.entries.push_back({j, entries_[e].column, entries_[e].slope, -1});
  expansion_.separate_copies(ndz);
  entries_.push_back({-1, -1});  // so that begin() of an empty last column is a valid address
}

// ---- rows -------------------------------------------------------------------------------------

namespace {

/// Rows of the active groups; `wanted` chooses by hardness where that matters.
template <typename Wanted>
std::vector<int> active_rows(const std::vector<RowGroup>& groups, const std::vector<char>& active,
                             Wanted wanted) {
  std::vector<int> rows;
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (active[g] && wanted(g))
      for (int i = 0; i < groups[g].size; ++i) rows.push_back(groups[g].offset + i);
  return rows;
}

}  // namespace

std::vector<char> over_measured_states(const LoweredProblem& problem, const KnotSignature& first) {
  std::vector<char> on_states(size_of(problem.row_count(StageKind::Running, RowKind::Inequality)));
  std::vector<char> on_others(on_states.size());
  const Sparsity& pattern = problem.running_linear.result(9);
  for (std::size_t i = 0; i < problem.blocks().size(); ++i) {
    const BlockInfo& b = problem.blocks()[i];
    auto& seen = first.role[i] == Role::State ? on_states : on_others;
    for (int j = b.tangent_offset; j < b.tangent_offset + b.tangent_size; ++j)
      for (int n = pattern.column_start[size_of(j)]; n < pattern.column_start[size_of(j + 1)]; ++n)
        seen[size_of(pattern.row_index[size_of(n)])] = 1;
  }
  for (std::size_t i = 0; i < on_states.size(); ++i) on_states[i] = on_states[i] && !on_others[i];
  return on_states;
}

KnotRows::KnotRows(const LoweredProblem& problem, const KnotSignature& signature, bool is_linked)
    : stage(signature.stage) {
  const auto rows = [&](RowKind kind, auto wanted) {
    return active_rows(problem.rows(stage, kind), signature.active[static_cast<std::size_t>(kind)],
                       wanted);
  };
  const auto all = [](std::size_t) { return true; };
  const auto is_hard = [&](std::size_t g) { return signature.is_hard[g] != 0; };
  equality_rows = rows(RowKind::Equality, all);
  inequality_rows = rows(RowKind::Inequality, is_hard);
  if (signature.is_measured) {
    const std::vector<char> given = over_measured_states(problem, signature);
    const auto first = std::stable_partition(inequality_rows.begin(), inequality_rows.end(),
                                             [&](int row) { return !given[size_of(row)]; });
    measured_rows.assign(first, inequality_rows.end());
    inequality_rows.erase(first, inequality_rows.end());
  }
  penalty_rows = rows(RowKind::Inequality, [&](std::size_t g) { return !is_hard(g); });
  if (stage == StageKind::Running) (is_linked ? link_rows : own_links) = rows(RowKind::Link, all);
}

// ---- shapes -----------------------------------------------------------------------------------

namespace {

/// Terms of (matrix T) with `rows` of the lowered matrix kept, placed from row `first` on.
void add_terms(const Sparsity& pattern, const ColumnMap& columns, const std::vector<int>& rows,
               int first, std::vector<Term>& terms) {
  std::vector<int> place(static_cast<std::size_t>(pattern.rows), -1);
  for (std::size_t i = 0; i < rows.size(); ++i)
    place[static_cast<std::size_t>(rows[i])] = first + static_cast<int>(i);
  for (int j = 0; j < pattern.cols; ++j)
    for (int n = pattern.column_start[j]; n < pattern.column_start[j + 1]; ++n) {
      const int row = place[static_cast<std::size_t>(pattern.row_index[n])];
      if (row < 0) continue;
      for (const auto* e = columns.begin(j); e != columns.end(j); ++e)
        terms.push_back({row, e->column, n, e->slope, -1});
    }
}

std::vector<int> all_rows(int count) {
  std::vector<int> rows(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) rows[static_cast<std::size_t>(i)] = i;
  return rows;
}

void build_rows(const Sparsity& pattern, const ColumnMap& columns, const std::vector<int>& rows,
                int stride, SparseBlock& block, Gather& gather) {
  std::vector<Term> terms;
  add_terms(pattern, columns, rows, 0, terms);
  assemble(std::move(terms), static_cast<int>(rows.size()), columns.nw(), block, gather);
  gather.separate_copies(block.nnz(), stride);
}

/// T'HT for a lower triangle H, as a lower triangle with its whole diagonal, or with every entry
/// when it is to be `dense`.
void build_hessian(const Sparsity& pattern, const ColumnMap& columns, bool dense, int stride,
                   SparseBlock& block, Gather& gather) {
  std::vector<Term> terms;
  add_congruence_terms(pattern, columns, terms);
  for (int c = 0; c < columns.nw(); ++c)
    for (int r = c; r < (dense ? columns.nw() : c + 1); ++r)
      terms.push_back({r, c, Term::kStructural, -1, -1});
  assemble(std::move(terms), columns.nw(), columns.nw(), block, gather);
  gather.separate_copies(block.nnz(), stride);
}

void build_gradient(int ndz, const ColumnMap& columns, int stride, Gather& gather) {
  for (int j = 0; j < ndz; ++j)
    for (const auto* e = columns.begin(j); e != columns.end(j); ++e)
      gather.entries.push_back({e->column, j, e->slope, -1});
  gather.separate_copies(columns.nw(), stride);
}

/// Coordinates of the knot `before` that the link rows of `knot` look at, as columns of its map
/// without memory.
std::vector<int> looked_back_at(const LoweredProblem& problem, const KnotSignature& before,
                                const KnotSignature& knot) {
  const ColumnMap columns(problem, before);
  std::vector<Term> terms;
  add_terms(problem.link_linear.result(1), columns, KnotRows(problem, knot, true).link_rows, 0,
            terms);
  std::vector<int> memory;
  memory.reserve(terms.size());
  for (const Term& t : terms) memory.push_back(t.column);
  std::sort(memory.begin(), memory.end());
  memory.erase(std::unique(memory.begin(), memory.end()), memory.end());
  return memory;
}

/// Equality rows with the own links behind them: what three lowered Jacobians say of one matrix.
/// Each is gathered with the others' terms as structure only.
void build_equalities(const LoweredProblem& problem, const Sparsity& equality,
                      const KnotSignature* previous, int stride, KnotShape& shape) {
  const ColumnMap& columns = shape.columns;
  const int own = static_cast<int>(shape.equality_rows.size());
  const int rows = own + static_cast<int>(shape.own_links.size());
  std::array<std::vector<Term>, 3> parts;
  add_terms(equality, columns, shape.equality_rows, 0, parts[0]);
  add_terms(problem.link_linear.result(2), columns, shape.own_links, own, parts[1]);
  if (!columns.memory().empty()) {
    add_terms(problem.link_linear.result(1), ColumnMap(problem, *previous), shape.own_links, own,
              parts[2]);
    const auto& memory = columns.memory();
    for (Term& t : parts[2])
      t.column = columns.first_memory() +
                 static_cast<int>(std::lower_bound(memory.begin(), memory.end(), t.column) -
                                  memory.begin());
  }
  const std::array<Gather*, 3> recipes{&shape.equality, &shape.own_link, &shape.remembered_link};
  for (std::size_t part = 0; part < parts.size(); ++part) {
    std::vector<Term> terms;
    for (std::size_t other = 0; other < parts.size(); ++other)
      for (Term t : parts[other]) {
        if (other != part) t.source = Term::kStructural;
        terms.push_back(t);
      }
    assemble(std::move(terms), rows, columns.nw(), shape.pattern.equality_jacobian, *recipes[part]);
  }
  shape.equality.separate_copies(shape.pattern.equality_jacobian.nnz(), stride);
}

/// Rows of the next state: the lowered dynamics, then a copy for every carried block and for what
/// the next knot remembers.
void build_dynamics(const LoweredProblem& problem, const ColumnMap& columns, const ColumnMap& next,
                    int stride, KnotShape& shape) {
  std::vector<Term> terms;
  add_terms(problem.running_linear.result(4), columns, all_rows(problem.ndx()), 0, terms);
  // A local meets no dynamics at this knot (a swing foot's lever arm has no force), whatever the
  // lowered pattern allows at others: linearising checks that these entries are zero.
  std::erase_if(terms, [&](const Term& t) {
    const bool is_local = t.column >= columns.nx + columns.nu;
    if (is_local) shape.local_dynamics.push_back(t.source);
    return is_local;
  });
  const int blocks = static_cast<int>(problem.blocks().size());
  for (int b = 0; b < blocks; ++b)
    if (next.first_column(b) >= problem.ndx() && next.first_column(b) < next.nx)
      for (int i = 0; i < next.column_count(b); ++i)
        terms.push_back(
            {next.first_column(b) + i, columns.first_column(b) + i, Term::kConstant, -1, -1});
  int remembered = next.first_memory();
  for (int column : next.memory())
    terms.push_back({remembered++, columns.with_memory(column), Term::kConstant, -1, -1});
  assemble(std::move(terms), next.nx, columns.nw(), shape.pattern.dynamics, shape.dynamics);
  shape.dynamics.separate_copies(shape.pattern.dynamics.nnz(), stride);

  const Sparsity& implicit = problem.running_linear.result(5);
  terms.clear();
  for (int j = 0; j < implicit.cols; ++j)
    for (int n = implicit.column_start[j]; n < implicit.column_start[j + 1]; ++n)
      terms.push_back({implicit.row_index[n], j, n, -1, -1});
  assemble(std::move(terms), next.nx, next.nx, shape.pattern.implicit, shape.implicit);
  shape.implicit.separate_copies(shape.pattern.implicit.nnz(), stride);
  shape.pattern.offset = Eigen::VectorXd::Zero(next.nx);
}

void size_values(QpStage& stage) {
  stage.gradient = Eigen::VectorXd::Zero(stage.nw());
  stage.penalty_value = Eigen::VectorXd::Zero(stage.penalty_jacobian.rows);
  stage.penalty_policy.assign(static_cast<std::size_t>(stage.penalty_jacobian.rows), Policy{});
  stage.equality_value = Eigen::VectorXd::Zero(stage.equality_jacobian.rows);
  stage.inequality_value = Eigen::VectorXd::Zero(stage.inequality_jacobian.rows);
  stage.link_value = Eigen::VectorXd::Zero(stage.link_jacobian.rows);
}

void list_blocks(const LoweredProblem& problem, KnotShape& shape) {
  const auto& blocks = problem.blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const KnotShape::Entries entries{blocks[b].offset, blocks[b].size};
    const Role role = shape.signature.role[b];
    if (role == Role::Fixed || role == Role::Carried) shape.held.push_back(entries);
    if (role == Role::Absent) shape.absent.push_back(entries);
    if (!shape.signature.charted[b]) continue;
    if (role == Role::Carried)
      shape.held_slopes.push_back({blocks[b].slope_offset, blocks[b].size * blocks[b].chart_size});
    else
      shape.charted.push_back(entries);
  }
}

}  // namespace

const KnotShape& ShapeTable::find(const KnotSignature* previous, const KnotSignature* knot,
                                  const KnotSignature* next) {
  // The knot before matters to rows over two knots alone.
  const std::vector<char>& links = knot->active[static_cast<std::size_t>(RowKind::Link)];
  if (std::find(links.begin(), links.end(), 1) == links.end()) previous = nullptr;
  std::unique_ptr<KnotShape>& shape = shapes_[{previous, knot, next}];
  if (shape == nullptr) {
    shape = make(previous, *knot, next);
    shape->pattern.pattern = new_pattern();
  }
  return *shape;
}

ColumnMap ShapeTable::columns(const KnotSignature* previous, const KnotSignature& knot) const {
  const bool remembers = previous != nullptr && links_ == LinkRows::Folded;
  return {*problem_, knot,
          remembers ? looked_back_at(*problem_, *previous, knot) : std::vector<int>{}};
}

std::unique_ptr<KnotShape> ShapeTable::make(const KnotSignature* previous,
                                            const KnotSignature& knot,
                                            const KnotSignature* next) const {
  auto shape = std::make_unique<KnotShape>();
  const bool is_linked = previous != nullptr && links_ == LinkRows::Linked;
  static_cast<KnotRows&>(*shape) = KnotRows(*problem_, knot, is_linked);
  shape->signature = knot;
  shape->columns = this->columns(previous, knot);
  list_blocks(*problem_, *shape);
  const ColumnMap& columns = shape->columns;
  QpStage& stage = shape->pattern;
  stage.nx = columns.nx;
  stage.nu = columns.nu;
  stage.nl = columns.nl;

  const bool running = knot.stage == StageKind::Running;
  const LoweredFunction& linear = running ? problem_->running_linear : problem_->terminal_linear;
  const int first = running ? 6 : 3;  // gradient, Hessian, equality and inequality Jacobians
  // Values of running knots lie in lanes beside each other.
  const int stride = problem_->knot_derivatives[running ? 0 : 1].lanes();
  build_gradient(problem_->ndz(), columns, stride, shape->gradient);
  const bool dense = exact_ != nullptr;
  build_hessian(linear.result(first + 1), columns, dense, stride, stage.hessian, shape->hessian);
  if (exact_ != nullptr)
    build_hessian((running ? exact_->running : exact_->terminal).result(0), columns, dense, 1,
                  stage.hessian, shape->exact_hessian);

  build_rows(linear.result(first + 3), columns, shape->penalty_rows, stride, stage.penalty_jacobian,
             shape->penalty);
  build_rows(linear.result(first + 3), columns, shape->inequality_rows, stride,
             stage.inequality_jacobian, shape->inequality);
  build_equalities(*problem_, linear.result(first + 2), previous, stride, *shape);
  if (!shape->link_rows.empty()) {
    const std::vector<int>& rows = shape->link_rows;
    const ColumnMap before(*problem_, *previous);
    build_rows(problem_->link_linear.result(1), before, rows, 1, stage.link_previous,
               shape->link_previous);
    build_rows(problem_->link_linear.result(2), columns, rows, 1, stage.link_jacobian, shape->link);
  }
  if (next != nullptr)
    build_dynamics(*problem_, columns, this->columns(&knot, *next), stride, *shape);
  size_values(stage);
  return shape;
}

}  // namespace palanquin
