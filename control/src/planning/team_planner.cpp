#include "palanquin/control/planning/team_planner.hpp"

#include <chrono>
#include <cmath>
#include <stdexcept>

namespace palanquin::planning {

namespace {
double now_ms() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double, std::milli>(Clock::now().time_since_epoch()).count();
}

const PlannerSettings& checked(const PlannerSettings& settings) {
  if (settings.restart_after < 1)
    throw std::invalid_argument("planner.restart_after is " +
                                std::to_string(settings.restart_after) + "; it must be at least 1");
  return settings;
}

RowMatrix checked(RowMatrix parameters, const LoweredProblem& problem) {
  if (parameters.rows() < 2 || parameters.cols() != problem.np())
    throw std::invalid_argument("planner: parameters are [" + std::to_string(parameters.rows()) +
                                ", " + std::to_string(parameters.cols()) + "]; [N + 1, " +
                                std::to_string(problem.np()) + "] are needed");
  return parameters;
}

/// Room for events of a solve: it tells of them without allocation.
constexpr std::size_t kEvents = 64;
}  // namespace

TeamPlanner::TeamPlanner(std::shared_ptr<const LoweredProblem> problem, Team team,
                         std::shared_ptr<const Terrain> terrain, const PlannerSettings& settings,
                         RowMatrix parameters, std::vector<std::shared_ptr<Sqp>> solvers)
    : problem_(std::move(problem)),
      team_(std::move(team)),
      terrain_(std::move(terrain)),
      settings_(checked(settings)),
      slots_(*problem_, team_, *terrain_),
      parameters_(checked(std::move(parameters), *problem_)),
      candidates_(std::make_unique<Candidates>(std::move(solvers), settings.threads)),
      ground_(terrain_, Ditches()),
      motion_(team_, *terrain_, settings.references, horizon(), spacing()),
      warm_start_(*problem_, team_, slots_, horizon(), candidates_->size() - 1),
      clocks_(static_cast<std::size_t>(team_.robots()), GaitClock(team_.carriers.front().gait)),
      observer_(team_.robots(), settings_.observers),
      expected_(RowMatrix::Zero(horizon() + 1, 6 * team_.bodies())),
      wrenches_(expected_),
      planned_(RowMatrix::Zero(team_.bodies(), kState)),
      planned_next_(planned_),
      stance_(team_.feet()),
      spacing_(horizon() + 1),
      measured_(neutral_trajectory(*problem_, 1).row(0)),
      predicted_(measured_),
      times_(static_cast<std::size_t>(horizon()) + 1),
      stances_(times_.size(), std::vector<Stances>(static_cast<std::size_t>(team_.robots()))),
      too_fast_(static_cast<std::size_t>(team_.robots())),
      guesses_(static_cast<std::size_t>(candidates_->size()),
               neutral_trajectory(*problem_, horizon())) {
  now_.contacts = Flags::Constant(horizon() + 1, team_.feet(), false);
  now_.before = Flags::Constant(1, team_.feet(), false);
  now_.feet = RowMatrix::Zero(team_.feet(), 3);
  last_.trajectory = guesses_.front();
  last_.contacts = now_.contacts;
  if (slots_.has_ground()) own_parameters_.resize(guesses_.size() - 1, parameters_);
  asked_parameters_.reserve(guesses_.size());
  asked_guesses_.reserve(guesses_.size());
  events_.reserve(kEvents);
  pending_.reserve(kEvents);
  motion_.make({}, {}, now_.references);
  restart();
}

Status TeamPlanner::solve(double time, const TeamState& state, const Velocity& command) {
  const auto use = user_.change("solve");
  const double started = now_ms();
  observe(time, state);
  set_up(time, state, command);
  slots_.write_measured(state, measured_.data());
  has_fed_back_ = false;
  solve_from_guess();
  return answer(started);
}

bool TeamPlanner::prepare(double time, const TeamState& predicted, const Velocity& command) {
  const auto use = user_.change("prepare");
  if (candidates_->size() > 1)
    throw std::logic_error("a planner with candidates has no two phases; use solve");
  set_up(time, predicted, command);
  slots_.write_measured(predicted, predicted_.data());
  slots_.write_ground(*terrain_, guesses_.front(), parameters_);
  chosen_ = 0;
  is_ready_ = candidates_->solver(0).prepare(parameters_, predicted_, guesses_.front());
  is_prepared_ = true;
  return is_ready_;
}

Status TeamPlanner::feedback(const TeamState& state) {
  const auto use = user_.change("feedback");
  if (!is_prepared_)
    throw std::logic_error("nothing was prepared; feedback needs a call of prepare before it");
  check(state);
  const double started = now_ms();
  observe(now_.time, state);
  is_prepared_ = false;
  slots_.write_measured(state, measured_.data());
  has_fed_back_ = is_ready_;
  if (is_ready_)
    candidates_->solver(0).feedback(measured_);
  else
    solve_from_guess();
  return answer(started);
}

Status TeamPlanner::settle(double time, const TeamState& state, const Velocity& command,
                           int at_most) {
  Status status = Status::NotSolved;
  for (int i = 0; i < at_most && status != Status::Converged; ++i)
    status = solve(time, state, command);
  return status;
}

void TeamPlanner::sense(double time, const Flags& grounded) {
  const auto use = user_.change("sense");
  if (grounded.rows() != 1 || grounded.cols() != team_.feet())
    throw std::invalid_argument("sense: grounded is [" + std::to_string(grounded.rows()) + ", " +
                                std::to_string(grounded.cols()) + "], but must be [1, " +
                                std::to_string(team_.feet()) + "]");
  for (int i = 0; i < team_.feet(); ++i)
    clocks_[static_cast<std::size_t>(i / kFeet)].sense(i % kFeet, time, grounded(0, i));
}

/// References, contacts and a guess for a solve at `time`; the parameters are written.
void TeamPlanner::set_up(double time, const TeamState& state, const Velocity& command) {
  check(state);
  is_prepared_ = false;
  advance_reference(time, command);
  now_.time = time;
  now_.feet = state.feet;
  spacing_ = parameters_.col(slots_.spacing());
  if (!(spacing_.minCoeff() > 0.0))
    throw std::invalid_argument("parameter 'dt' is " + std::to_string(spacing_.minCoeff()) +
                                " at a knot; it must be positive");
  make_references(time, state, command);
  sample_contacts(time);
  slots_.write_instant(now_, parameters_);
  if (observer_.is_on()) {
    const RowMatrix& observed = observer_.wrenches();
    wrenches_ = expected_;
    wrenches_.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(observed.data(), observed.size());
    slots_.write_wrenches(wrenches_, parameters_);
  }
  give_up_on_last(time);
  make_guess();
}

/// Corrects the observers by how bodies move otherwise than the last plan has them now.
void TeamPlanner::observe(double time, const TeamState& state) {
  check(state);
  double left = time - last_.time;
  if (!observer_.is_on() || !last_.exists || !(left > 0.0)) return;
  int k = 0;
  while (k < horizon() && left >= spacing_[k]) left -= spacing_[k++];
  if (k == horizon()) return;
  slots_.read_bodies(&last_.trajectory(k, 0), planned_.data());
  slots_.read_bodies(&last_.trajectory(k + 1, 0), planned_next_.data());
  planned_ += left / spacing_[k] * (planned_next_ - planned_);
  for (int body = 0; body < team_.bodies(); ++body)
    observer_.observe(body, state.bodies.data() + kState * body, &planned_(body, 0),
                      slots_.inertial(parameters_, body));
}

double TeamPlanner::payload_mass() const { return slots_.inertial(parameters_, 0).mass; }

double TeamPlanner::apparent_payload_mass() const {
  return apparent_mass(payload_mass(), observer_.wrenches().row(0).head<3>().transpose());
}

void TeamPlanner::check(const TeamState& state) const {
  if (state.bodies.size() != kState * team_.bodies() || state.feet.rows() != team_.feet() ||
      state.feet.cols() != 3)
    throw std::invalid_argument("a state of " + std::to_string(team_.robots()) +
                                " robots has bodies [R + 1, 13] and feet [4 R, 3]");
}

void TeamPlanner::advance_reference(double time, const Velocity& command) {
  if (!std::isfinite(time))
    throw std::invalid_argument("time is " + std::to_string(time) + "; it must be finite");
  if (has_time_ && time < time_)
    throw std::invalid_argument("time is " + std::to_string(time) +
                                " s; the last plan was made at " + std::to_string(time_) + " s");
  if (!has_time_) start_ = time_ = time;
  reference_ = reference_at(time);
  has_time_ = true;
  time_ = time;
  command_ = command;
}

Pose TeamPlanner::reference_at(double time) const {
  const double elapsed = has_time_ ? time - time_ : 0.0;
  if (elapsed <= 0.0) return reference_;
  return step_along(terrain_->trend(), reference_, command_, elapsed).pose;
}

void TeamPlanner::make_references(double time, const TeamState& state, const Velocity& command) {
  motion_.make(reference_, command, now_.references);
  if (settings_.footholds == FootholdRule::Raibert) look_ahead(time, state);
}

void TeamPlanner::look_ahead(double time, const TeamState& state) {
  for (std::size_t k = 0; k < times_.size(); ++k) {
    times_[k] = time + spacing_[0] * static_cast<double>(k);
    for (int r = 0; r < team_.robots(); ++r) stances_[k][r] = clocks_[r].stances(times_[k]);
  }
  for (int r = 0; r < team_.robots(); ++r) {
    const Eigen::Map<const Vector3> measured(state.bodies.data() + kState * (r + 1) + 7);
    const ConstBodyState reference(now_.references.bodies, 0, r + 1);
    too_fast_[r] = (measured - reference.velocity).head<2>();
  }
  use_raibert_footholds(team_, *terrain_, times_, stances_, too_fast_, now_.references);
}

/// Flags at the knots, and just before the first one. A foot that stood before and stands now stays
/// where it was measured; so does, at the start, every foot that stands.
void TeamPlanner::sample_contacts(double time) {
  const auto sample = [this](double at, Flags& flags, Eigen::Index k) {
    for (int r = 0; r < team_.robots(); ++r) {
      const auto stands = clocks_[r].contacts(at);
      for (int f = 0; f < kFeet; ++f) flags(k, kFeet * r + f) = stands[f];
    }
  };
  sample(std::max(time - 1e-3 * spacing_[0], start_), now_.before, 0);
  for (Eigen::Index k = 0; k <= horizon(); ++k)
    sample(time + spacing_[0] * static_cast<double>(k), now_.contacts, k);
  for (int r = 0; r < team_.robots(); ++r)
    for (int f = 0; f < kFeet; ++f)
      stance_[kFeet * r + f] =
          settings_.footholds == FootholdRule::Raibert ? 0.0 : clocks_[r].gait(time).stance(f);
}

/// Forgets the last plan when too many solves in a row have failed to improve on it.
void TeamPlanner::give_up_on_last(double time) {
  if (!last_.exists || failures_ < settings_.restart_after) return;
  pending_.push_back({time, EventKind::Restart, failures_, 0.0});
  last_.exists = false;
  failures_ = 0;
}

void TeamPlanner::make_guess() {
  warm_start_.guess(now_, last_, ground_, stance_, spacing_, guesses_.front());
}

/// The guess and others whose feet land elsewhere, each with the ground around its feet; how many.
int TeamPlanner::make_choices() {
  const int count = candidates_->size() > 1 ? warm_start_.choose(now_, ground_, guesses_) : 1;
  asked_parameters_.clear();
  asked_guesses_.clear();
  for (int i = 0; i < count; ++i) {
    RowMatrix* parameters = &parameters_;
    if (i > 0 && slots_.has_ground()) *(parameters = &own_parameters_[i - 1]) = parameters_;
    slots_.write_ground(*terrain_, guesses_[i], *parameters);
    asked_parameters_.push_back(parameters);
    asked_guesses_.push_back(&guesses_[i]);
  }
  return count;
}

Status TeamPlanner::solve_from_guess() {
  make_choices();
  chosen_ = candidates_->solve(asked_parameters_, measured_, asked_guesses_);
  return solver().status();
}

/// The plan is the last one now; the next one starts from it.
Status TeamPlanner::answer(double started_ms) {
  const Sqp& sqp = solver();
  failures_ = sqp.has_usable_plan() ? 0 : failures_ + 1;
  std::swap(events_, pending_);
  pending_.clear();
  append_plan_events(sqp.history(), sqp.has_usable_plan(), now_.time, events_);
  last_.exists = true;
  last_.time = now_.time;
  last_.trajectory = sqp.trajectory();
  last_.contacts = now_.contacts;
  solve_ms_ = now_ms() - started_ms;
  return sqp.status();
}

void TeamPlanner::restart(const Pose& reference) {
  reference_ = reference;
  for (int r = 0; r < team_.robots(); ++r) clocks_[r] = GaitClock(team_.carriers[r].gait);
  expect_wrenches(RowMatrix::Zero(horizon() + 1, 6 * team_.bodies()));
  observer_.reset();
  has_time_ = is_prepared_ = last_.exists = false;
  start_ = 0.0;
  failures_ = 0;
  command_ = {};
  events_.clear();
  pending_.clear();
}

void TeamPlanner::set_ditches(MatrixView lines) {
  ground_ = StandingGround(terrain_, Ditches(lines));
  if (lines.rows() > slots_.most_ditches())
    throw std::invalid_argument("ditches: " + std::to_string(lines.rows()) +
                                " are given; the problem was built for at most " +
                                std::to_string(slots_.most_ditches()));
  for (int i = 0; i < slots_.most_ditches(); ++i) {
    const Eigen::RowVector4d none(1.0, 0.0, 0.0, 0.0);  // of no width
    const Eigen::RowVector4d line = i < lines.rows() ? Eigen::RowVector4d(lines.row(i)) : none;
    parameters_.middleCols<4>(slots_.ditches() + 4 * i).rowwise() = line;
  }
}

void TeamPlanner::set_policy(const std::string& family, const Policy& policy) {
  for (int i = 0; i < candidates_->size(); ++i) candidates_->solver(i).set_policy(family, policy);
}

void TeamPlanner::expect_wrenches(MatrixView wrenches) {
  slots_.write_wrenches(wrenches, parameters_);
  expected_ = wrenches;
}

void TeamPlanner::use_solvers(std::vector<std::shared_ptr<Sqp>> solvers) {
  if (static_cast<int>(solvers.size()) != candidates_->size())
    throw std::invalid_argument("planner: as many solvers as before are needed");
  candidates_ = std::make_unique<Candidates>(std::move(solvers), settings_.threads);
}

TeamState TeamPlanner::nominal_state(const Pose& pose) const {
  return planning::nominal_state(team_, *terrain_, pose, settings_.references);
}

}  // namespace palanquin::planning
