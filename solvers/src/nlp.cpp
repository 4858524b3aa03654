#include "nlp.hpp"

#include <algorithm>
#include <limits>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

namespace {
constexpr double kInfinity = 1e20;  // Ipopt's own value for "no bound"
}

Ipopt::Functions::Functions(const std::string& path)
    : library(path),
      running(library, "nlp_running"),
      running_hessian(library, "nlp_running_hessian"),
      terminal(library, "nlp_terminal"),
      terminal_hessian(library, "nlp_terminal_hessian"),
      link(library, "nlp_link"),
      link_hessian(library, "nlp_link_hessian") {}

Nlp::Nlp(const LoweredProblem& problem, const Ipopt::Functions& functions,
         const TranscriptionWorkspace& rows, bool penalize, MatrixView parameters,
         VectorView measured, MatrixView guess)
    : problem_(problem),
      functions_(functions),
      parameters_(parameters),
      measured_(measured),
      guess_(guess),
      trajectory_(guess) {
  for (const LoweredFunction* f :
       {&functions_.running, &functions_.running_hessian, &functions_.terminal,
        &functions_.terminal_hessian, &functions_.link, &functions_.link_hessian})
    f->prepare(workspace_);
  for (const BlockInfo& b : problem_.states())
    for (int i = 0; i < b.size; ++i) state_entries_.push_back(b.offset + i);
  lay_out(rows, penalize);
  evaluate_knots();
  choose_sides();
}

/// Numbers variables and rows.
void Nlp::lay_out(const TranscriptionWorkspace& rows, bool penalize) {
  const int horizon = rows.horizon();
  knots_.resize(static_cast<std::size_t>(horizon + 1));
  for (int k = 0; k <= horizon; ++k) {
    Knot& knot = knots_[static_cast<std::size_t>(k)];
    knot.variable.assign(static_cast<std::size_t>(problem_.nz()), -1);
    const std::vector<Role>& role = rows.shape(k).signature.role;
    for (std::size_t b = 0; b < role.size(); ++b) {
      const BlockInfo& block = problem_.blocks()[b];
      const bool exists =
          block.is_state ? k > 0 || role[b] == Role::Input : role[b] != Role::Absent;
      for (int i = 0; exists && i < block.size; ++i)
        knot.variable[static_cast<std::size_t>(block.offset + i)] = variables_++;
    }
  }
  first_slack_ = variables_;
  for (int k = 0; k <= horizon; ++k) {
    Knot& knot = knots_[static_cast<std::size_t>(k)];
    const KnotSignature& signature = rows.shape(k).signature;
    const bool running = k < horizon;
    auto active = [&](RowKind kind) {
      std::vector<int> result;
      const auto& groups = problem_.rows(signature.stage, kind);
      for (std::size_t g = 0; g < groups.size(); ++g)
        for (int i = 0; signature.active[static_cast<std::size_t>(kind)][g] && i < groups[g].size;
             ++i)
          result.push_back(groups[g].offset + i);
      return result;
    };
    knot.equality = active(RowKind::Equality);
    knot.inequality = active(RowKind::Inequality);
    const auto policy_of = [&](int row) {
      const auto& groups = problem_.rows(signature.stage, RowKind::Inequality);
      const auto group = std::find_if(groups.begin(), groups.end(),
                                      [&](const RowGroup& g) { return row < g.offset + g.size; });
      return rows.inputs().policies().get(problem_, group->family);
    };
    const auto is_soft = [&](int row) {
      return penalize && policy_of(row).kind != PolicyKind::Hard;
    };
    if (k == 0) {
      const std::vector<char> given = over_measured_states(problem_, signature);
      std::erase_if(knot.inequality,
                    [&](int row) { return given[static_cast<std::size_t>(row)] && !is_soft(row); });
    }
    if (running) knot.link = active(RowKind::Link);
    for (int row : knot.inequality) {
      knot.policy.push_back(policy_of(row));
      knot.slack.push_back(is_soft(row) ? variables_++ : -1);
    }
    if (running) {
      knot.dynamics_row = rows_;
      rows_ += problem_.nx();
    }
    knot.equality_row = rows_;
    rows_ += static_cast<Index>(knot.equality.size());
    knot.link_row = rows_;
    rows_ += static_cast<Index>(knot.link.size());
    knot.inequality_row = rows_;
    rows_ += static_cast<Index>(knot.inequality.size());

    const LoweredFunction& f = running ? functions_.running : functions_.terminal;
    const LoweredFunction& h = running ? functions_.running_hessian : functions_.terminal_hessian;
    const int first = running ? 1 : 0;
    auto size = [](std::vector<double>& v, int n) { v.assign(static_cast<std::size_t>(n), 0.0); };
    if (running) {
      size(knot.next_state, problem_.nx());
      knot.side.assign(static_cast<std::size_t>(problem_.nx()), 1.0);
      size(knot.dd, f.result(4).nnz());
      size(knot.multiplier_d, problem_.nx());
    }
    size(knot.g, f.result(first + 1).nnz());
    size(knot.h, f.result(first + 2).nnz());
    const int jacobians = running ? 5 : 3;
    size(knot.dcost, f.result(jacobians).nnz());
    size(knot.dg, f.result(jacobians + 1).nnz());
    size(knot.dh, f.result(jacobians + 2).nnz());
    size(knot.hessian, h.result(0).nnz());
    size(knot.multiplier_g, static_cast<int>(knot.g.size()));
    size(knot.multiplier_h, static_cast<int>(knot.h.size()));
    size(knot.c, functions_.link.result(0).nnz());
    size(knot.dc_previous, functions_.link.result(1).nnz());
    size(knot.dc, functions_.link.result(2).nnz());
    size(knot.link_hessian, functions_.link_hessian.result(0).nnz());
    size(knot.multiplier_c, static_cast<int>(knot.c.size()));
  }
  slack_values_.assign(static_cast<std::size_t>(variables_ - first_slack_), 0.0);
}

/// Which of q and -q every quaternion's dynamics lead to: that on the side of the guess.
void Nlp::choose_sides() {
  for (std::size_t k = 0; k + 1 < knots_.size(); ++k) {
    const RowMatrix& z = trajectory_;
    const double* d = knots_[k].next_state.data();
    double* side = knots_[k].side.data();
    for (const BlockInfo& b : problem_.states()) {
      const auto guessed = z.row(static_cast<Eigen::Index>(k) + 1).segment(b.offset, b.size);
      const Eigen::Map<const Eigen::RowVectorXd> value(d, b.size);
      if (b.is_quaternion && guessed.dot(value) < 0.0) std::fill_n(side, b.size, -1.0);
      d += b.size;
      side += b.size;
    }
  }
}

// ---- evaluation -------------------------------------------------------------------------------

void Nlp::scatter(const Number* x) {
  for (std::size_t k = 0; k < knots_.size(); ++k)
    for (int i = 0; i < problem_.nz(); ++i)
      if (const Index v = knots_[k].variable[static_cast<std::size_t>(i)]; v >= 0)
        trajectory_(static_cast<Eigen::Index>(k), i) = x[v];
  std::copy(x + first_slack_, x + variables_, slack_values_.begin());
}

void Nlp::refresh(const Number* x, bool new_x) {
  if (!new_x) return;
  scatter(x);
  evaluate_knots();
}

/// Values and Jacobians along the trajectory.
void Nlp::evaluate_knots() {
  FunctionWorkspace& w = workspace_;
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    Knot& knot = knots_[k];
    const auto row = static_cast<Eigen::Index>(k);
    const bool running = knot.dynamics_row >= 0;
    w.arguments[0] = trajectory_.row(row).data();
    w.arguments[1] = parameters_.row(row).data();
    std::size_t r = 0;
    if (running) w.results[r++] = knot.next_state.data();
    w.results[r++] = &knot.cost;
    w.results[r++] = knot.g.data();
    w.results[r++] = knot.h.data();
    if (running) w.results[r++] = knot.dd.data();
    w.results[r++] = knot.dcost.data();
    w.results[r++] = knot.dg.data();
    w.results[r++] = knot.dh.data();
    (running ? functions_.running : functions_.terminal)(w);
    if (knot.link.empty()) continue;
    w.arguments[0] = k > 0 ? trajectory_.row(row - 1).data() : measured_.data();
    w.arguments[1] = trajectory_.row(row).data();
    w.arguments[2] = parameters_.row(row).data();
    w.results[0] = knot.c.data();
    w.results[1] = knot.dc_previous.data();
    w.results[2] = knot.dc.data();
    functions_.link(w);
  }
}

bool Nlp::eval_f(Index, const Number* x, bool new_x, Number& value) {
  refresh(x, new_x);
  value = 0.0;
  for (const Knot& knot : knots_) {
    value += knot.cost;
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] >= 0) value += evaluate_penalty(knot.policy[i], x[knot.slack[i]]).value;
  }
  return std::isfinite(value);
}

bool Nlp::eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) {
  refresh(x, new_x);
  std::fill(gradient, gradient + n, 0.0);
  for (const Knot& knot : knots_) {
    for (std::size_t i = 0; i < knot.dcost.size(); ++i)
      if (knot.variable[i] >= 0) gradient[knot.variable[i]] += knot.dcost[i];
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] >= 0)
        gradient[knot.slack[i]] = evaluate_penalty(knot.policy[i], x[knot.slack[i]]).slope;
  }
  return true;
}

bool Nlp::eval_g(Index, const Number* x, bool new_x, Index, Number* g) {
  refresh(x, new_x);
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    const Knot& knot = knots_[k];
    if (knot.dynamics_row >= 0)
      for (std::size_t i = 0; i < state_entries_.size(); ++i)
        g[knot.dynamics_row + static_cast<Index>(i)] =
            knot.next_state[i] -
            knot.side[i] * trajectory_(static_cast<Eigen::Index>(k) + 1, state_entries_[i]);
    for (std::size_t i = 0; i < knot.equality.size(); ++i)
      g[knot.equality_row + static_cast<Index>(i)] =
          knot.g[static_cast<std::size_t>(knot.equality[i])];
    for (std::size_t i = 0; i < knot.link.size(); ++i)
      g[knot.link_row + static_cast<Index>(i)] = knot.c[static_cast<std::size_t>(knot.link[i])];
    for (std::size_t i = 0; i < knot.inequality.size(); ++i)
      g[knot.inequality_row + static_cast<Index>(i)] =
          knot.h[static_cast<std::size_t>(knot.inequality[i])] -
          (knot.slack[i] >= 0 ? x[knot.slack[i]] : 0.0);
  }
  return true;
}

// ---- derivatives ------------------------------------------------------------------------------

template <typename Emit>
void Nlp::visit_jacobian(Emit emit) const {
  // Entries of a lowered Jacobian whose row is active and whose column is a variable.
  auto visit = [&](const Sparsity& pattern, const std::vector<double>& values,
                   const std::vector<Index>& variable, const std::vector<int>& active,
                   Index first) {
    std::vector<Index> place(static_cast<std::size_t>(pattern.rows), -1);
    for (std::size_t i = 0; i < active.size(); ++i)
      place[static_cast<std::size_t>(active[i])] = first + static_cast<Index>(i);
    for (int j = 0; j < pattern.cols; ++j)
      for (int n = pattern.column_start[j]; n < pattern.column_start[j + 1]; ++n) {
        const Index row = place[static_cast<std::size_t>(pattern.row_index[n])];
        const Index column = variable[static_cast<std::size_t>(j)];
        if (row >= 0 && column >= 0) emit(row, column, values[static_cast<std::size_t>(n)]);
      }
  };
  std::vector<int> all(static_cast<std::size_t>(problem_.nx()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    const Knot& knot = knots_[k];
    const bool running = knot.dynamics_row >= 0;
    const LoweredFunction& f = running ? functions_.running : functions_.terminal;
    const int first = running ? 5 : 3;
    if (running) {
      visit(f.result(4), knot.dd, knot.variable, all, knot.dynamics_row);
      for (std::size_t i = 0; i < state_entries_.size(); ++i)
        emit(knot.dynamics_row + static_cast<Index>(i),
             knots_[k + 1].variable[static_cast<std::size_t>(state_entries_[i])], -knot.side[i]);
    }
    visit(f.result(first + 1), knot.dg, knot.variable, knot.equality, knot.equality_row);
    visit(f.result(first + 2), knot.dh, knot.variable, knot.inequality, knot.inequality_row);
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] >= 0)
        emit(knot.inequality_row + static_cast<Index>(i), knot.slack[i], -1.0);
    if (knot.link.empty()) continue;
    if (k > 0)
      visit(functions_.link.result(1), knot.dc_previous, knots_[k - 1].variable, knot.link,
            knot.link_row);
    visit(functions_.link.result(2), knot.dc, knot.variable, knot.link, knot.link_row);
  }
}

template <typename Emit>
void Nlp::visit_hessian(Emit emit) const {
  auto lower = [&](Index a, Index b, double value) {
    if (a >= 0 && b >= 0) emit(std::max(a, b), std::min(a, b), value);
  };
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    const Knot& knot = knots_[k];
    const bool running = knot.dynamics_row >= 0;
    const Sparsity& pattern =
        (running ? functions_.running_hessian : functions_.terminal_hessian).result(0);
    for (int j = 0; j < pattern.cols; ++j)
      for (int n = pattern.column_start[j]; n < pattern.column_start[j + 1]; ++n)
        lower(knot.variable[static_cast<std::size_t>(pattern.row_index[n])],
              knot.variable[static_cast<std::size_t>(j)],
              knot.hessian[static_cast<std::size_t>(n)]);
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] >= 0) {
        const double t = slack_values_[static_cast<std::size_t>(knot.slack[i] - first_slack_)];
        emit(knot.slack[i], knot.slack[i], sigma_ * evaluate_penalty(knot.policy[i], t).curvature);
      }
    if (knot.link.empty()) continue;
    const Sparsity& link = functions_.link_hessian.result(0);
    auto variable = [&](int i) -> Index {
      if (i >= problem_.nz()) return knot.variable[static_cast<std::size_t>(i - problem_.nz())];
      return k > 0 ? knots_[k - 1].variable[static_cast<std::size_t>(i)] : -1;
    };
    for (int j = 0; j < link.cols; ++j)
      for (int n = link.column_start[j]; n < link.column_start[j + 1]; ++n)
        lower(variable(link.row_index[n]), variable(j),
              knot.link_hessian[static_cast<std::size_t>(n)]);
  }
}

bool Nlp::eval_jac_g(Index, const Number* x, bool new_x, Index, Index, Index* row, Index* col,
                     Number* values) {
  Index n = 0;
  if (values == nullptr) {
    visit_jacobian([&](Index r, Index c, double) { row[n] = r, col[n++] = c; });
    return true;
  }
  refresh(x, new_x);
  visit_jacobian([&](Index, Index, double value) { values[n++] = value; });
  return true;
}

void Nlp::evaluate_hessians(Number sigma, const Number* lambda) {
  FunctionWorkspace& w = workspace_;
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    Knot& knot = knots_[k];
    const auto row = static_cast<Eigen::Index>(k);
    auto spread = [&](const std::vector<int>& rows, Index first, std::vector<double>& target) {
      for (std::size_t i = 0; i < rows.size(); ++i)
        target[static_cast<std::size_t>(rows[i])] = lambda[first + static_cast<Index>(i)];
    };
    spread(knot.equality, knot.equality_row, knot.multiplier_g);
    spread(knot.inequality, knot.inequality_row, knot.multiplier_h);
    spread(knot.link, knot.link_row, knot.multiplier_c);
    const bool running = knot.dynamics_row >= 0;
    std::size_t a = 0;
    w.arguments[a++] = trajectory_.row(row).data();
    w.arguments[a++] = parameters_.row(row).data();
    w.arguments[a++] = &sigma;
    if (running) w.arguments[a++] = lambda + knot.dynamics_row;
    w.arguments[a++] = knot.multiplier_g.data();
    w.arguments[a++] = knot.multiplier_h.data();
    w.results[0] = knot.hessian.data();
    (running ? functions_.running_hessian : functions_.terminal_hessian)(w);
    if (knot.link.empty()) continue;
    w.arguments[0] = k > 0 ? trajectory_.row(row - 1).data() : measured_.data();
    w.arguments[1] = trajectory_.row(row).data();
    w.arguments[2] = parameters_.row(row).data();
    w.arguments[3] = knot.multiplier_c.data();
    w.results[0] = knot.link_hessian.data();
    functions_.link_hessian(w);
  }
}

bool Nlp::eval_h(Index, const Number* x, bool new_x, Number sigma, Index, const Number* lambda,
                 bool, Index, Index* row, Index* col, Number* values) {
  Index n = 0;
  if (values == nullptr) {
    visit_hessian([&](Index r, Index c, double) { row[n] = r, col[n++] = c; });
    return true;
  }
  refresh(x, new_x);
  sigma_ = sigma;
  evaluate_hessians(sigma, lambda);
  visit_hessian([&](Index, Index, double value) { values[n++] = value; });
  return true;
}

// ---- layout for Ipopt -------------------------------------------------------------------------

bool Nlp::get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) {
  n = variables_;
  m = rows_;
  nnz_jac = nnz_hess = 0;
  visit_jacobian([&](Index, Index, double) { ++nnz_jac; });
  visit_hessian([&](Index, Index, double) { ++nnz_hess; });
  style = C_STYLE;
  return true;
}

bool Nlp::get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) {
  std::fill(x_l, x_l + n, -kInfinity);
  std::fill(x_u, x_u + n, kInfinity);
  std::fill(g_l, g_l + m, 0.0);
  std::fill(g_u, g_u + m, 0.0);
  for (const Knot& knot : knots_)
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] < 0) g_l[knot.inequality_row + static_cast<Index>(i)] = -kInfinity;
  return true;
}

bool Nlp::get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) {
  for (std::size_t k = 0; k < knots_.size(); ++k)
    for (int i = 0; i < problem_.nz(); ++i)
      if (const Index v = knots_[k].variable[static_cast<std::size_t>(i)]; v >= 0)
        x[v] = guess_(static_cast<Eigen::Index>(k), i);
  // A slack starts at its row's value.
  std::fill(x + first_slack_, x + variables_, 0.0);
  refresh(x, true);
  for (const Knot& knot : knots_)
    for (std::size_t i = 0; i < knot.slack.size(); ++i)
      if (knot.slack[i] >= 0)
        x[knot.slack[i]] = knot.h[static_cast<std::size_t>(knot.inequality[i])];
  return true;
}

void Nlp::finalize_solution(::Ipopt::SolverReturn, Index, const Number* x, const Number*,
                            const Number*, Index, const Number*, const Number* lambda, Number,
                            const ::Ipopt::IpoptData*, ::Ipopt::IpoptCalculatedQuantities*) {
  scatter(x);
  keep_multipliers(lambda);
}

/// Rows of the dynamics in the tangent space: d - s x+ changes by T(s x+) e with e = d (-) x+.
void Nlp::keep_multipliers(const Number* lambda) {
  multipliers_ = {};
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    const Knot& knot = knots_[k];
    const auto of = [&](Index first, std::size_t size) {
      return Eigen::Map<const Eigen::VectorXd>(lambda + first, static_cast<Eigen::Index>(size));
    };
    multipliers_.equality.emplace_back(of(knot.equality_row, knot.equality.size()));
    multipliers_.link.emplace_back(of(knot.link_row, knot.link.size()));
    std::vector<double> hard, penalised;
    for (std::size_t i = 0; i < knot.inequality.size(); ++i)
      (knot.policy[i].kind == PolicyKind::Hard ? hard : penalised)
          .push_back(lambda[knot.inequality_row + static_cast<Index>(i)]);
    const auto vector = [](const std::vector<double>& v) {
      return Eigen::VectorXd::Map(v.data(), static_cast<Eigen::Index>(v.size()));
    };
    multipliers_.inequality.emplace_back(vector(hard));
    multipliers_.penalty.emplace_back(vector(penalised));
    if (knot.dynamics_row < 0) continue;
    Eigen::VectorXd& dynamics = multipliers_.dynamics.emplace_back(problem_.ndx());
    const Number* ambient = lambda + knot.dynamics_row;
    const double* side = knot.side.data();
    double* tangent = dynamics.data();
    for (const BlockInfo& b : problem_.states()) {
      if (b.is_quaternion) {
        const auto next = trajectory_.row(static_cast<Eigen::Index>(k) + 1);
        const Vector4 q = *side * next.segment(b.offset, 4).transpose();
        for (int i = 0; i < 3; ++i)
          tangent[i] =
              0.5 * Vector4::Map(ambient).dot(quaternion_multiply(q, Vector4::Unit(i + 1)));
      } else {
        std::copy_n(ambient, b.size, tangent);
      }
      ambient += b.size;
      side += b.size;
      tangent += b.tangent_size;
    }
  }
}

}  // namespace palanquin
