// Teams, their references, and planners.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palanquin/control/planning/planner_file.hpp"
#include "palanquin/control/planning/sqp_settings_text.hpp"
#include "palanquin/core/shapes.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

using namespace planning;

namespace {

Pose pose_of(const Vector3& p) { return {p[0], p[1], p[2]}; }
Vector3 vector_of(const Pose& p) { return {p.x, p.y, p.yaw}; }
Velocity velocity_of(const Vector3& v) { return {v[0], v[1], v[2]}; }

RobotReferences references_of(bool on_ground) {
  return on_ground ? RobotReferences::Ground : RobotReferences::Rigid;
}

void bind_team(nb::module_& m) {
  using Hips = Eigen::Matrix<double, kFeet, 3, Eigen::RowMajor>;
  nb::class_<Carrier>(m, "Carrier", "A robot that holds the payload; see team.hpp.")
      .def(
          "__init__",
          [](Carrier* self, std::string name, const Vector3& attach, const Vector3& hand,
             const Hips& hips, double yaw, double mass, double standing_height, Gait gait) {
            new (self) Carrier{std::move(name), attach,         hand, {}, yaw, mass,
                               standing_height, std::move(gait)};
            for (int f = 0; f < kFeet; ++f) self->hips[f] = hips.row(f);
          },
          "name"_a, "attach"_a, "hand"_a, "hips"_a, "yaw"_a, "mass"_a, "standing_height"_a,
          "gait"_a);
  nb::class_<Team>(m, "Team", "Who carries what; see team.hpp.")
      .def(
          "__init__",
          [](Team* self, double mass, double height, std::vector<Carrier> carriers, bool loaded) {
            const FeetBelow below = loaded ? FeetBelow::Load : FeetBelow::Hips;
            new (self) Team({mass, height}, std::move(carriers), below);
          },
          "mass"_a, "height"_a, "carriers"_a, "feet_below_load"_a = false);
  m.def(
      "carrying_forces",
      [](const Team& team, const Flags& contacts) {
        check_shape("contacts have", contacts, contacts.rows(), team.feet());
        RowMatrix forces(contacts.rows(), 3 * contacts.cols());
        for (Eigen::Index k = 0; k < contacts.rows(); ++k)
          for (int i = 0; i < team.feet(); ++i)
            point(forces, k, i) = carrying_force(team, contacts, k, i);
        return forces;
      },
      "team"_a, "contacts"_a);
}

void bind_references(nb::module_& m) {
  m.def(
      "payload_path",
      [](const Terrain& ground, const Vector3& start, const Vector3& command, int knots,
         double dt) {
        std::vector<PathKnot> path(static_cast<std::size_t>(knots));
        payload_path(ground, pose_of(start), velocity_of(command), dt, path);
        RowMatrix poses(knots, 3);
        for (int k = 0; k < knots; ++k) poses.row(k) = vector_of(path[k].pose);
        return poses;
      },
      "ground"_a, "start"_a, "command"_a, "knots"_a, "dt"_a);
  m.def(
      "make_references",
      [](const Team& team, const Terrain& terrain, const Vector3& start, const Vector3& command,
         int horizon, double dt, bool on_ground) {
        References references;
        ReferenceMotion(team, terrain, references_of(on_ground), horizon, dt)
            .make(pose_of(start), velocity_of(command), references);
        return std::make_pair(references.bodies, references.footholds);
      },
      "team"_a, "terrain"_a, "start"_a, "command"_a, "horizon"_a, "dt"_a, "on_ground"_a);
  m.def(
      "raibert_footholds",
      [](const Team& team, const Terrain& terrain, const RowMatrix& bodies,
         const std::vector<double>& times, const RowMatrix& begin, const RowMatrix& end,
         const RowMatrix& too_fast) {
        const auto knots = static_cast<Eigen::Index>(times.size());
        check_shape("bodies have", bodies, knots, 13 * (team.robots() + 1));
        check_shape("begins of stances have", begin, knots, team.feet());
        check_shape("ends of stances have", end, knots, team.feet());
        check_shape("excess velocities have", too_fast, team.robots(), 2);
        References references{bodies, RowMatrix(bodies.rows(), 3 * team.feet())};
        std::vector<std::vector<Stances>> stances(times.size());
        for (std::size_t k = 0; k < times.size(); ++k)
          for (int r = 0; r < team.robots(); ++r) {
            Stances& s = stances[k].emplace_back();
            for (int f = 0; f < kFeet; ++f) {
              s.begin[f] = begin(static_cast<Eigen::Index>(k), kFeet * r + f);
              s.end[f] = end(static_cast<Eigen::Index>(k), kFeet * r + f);
            }
          }
        std::vector<Vector2> excess;
        excess.reserve(static_cast<std::size_t>(team.robots()));
        for (int r = 0; r < team.robots(); ++r) excess.emplace_back(too_fast.row(r));
        use_raibert_footholds(team, terrain, times, stances, excess, references);
        return references.footholds;
      },
      "team"_a, "terrain"_a, "bodies"_a, "times"_a, "begin"_a, "end"_a, "too_fast"_a);
  m.attr("MOST_CORRECTION") = kMostCorrection;
}

using EventParts = std::tuple<double, std::string, std::string>;

std::vector<EventParts> in_words(const std::vector<Event>& events, const std::string& message) {
  std::vector<EventParts> words;
  words.reserve(events.size());
  for (const Event& e : events)
    words.emplace_back(e.time, std::string(to_string(e.kind)), e.reason(message));
  return words;
}

/// Kind, length and damping of an iteration's step, whether Hessians were mirrored and a cycle was
/// refused, and what a slower method for its QP said, if there was one.
using StepParts = std::tuple<std::string, double, double, bool, bool, std::string>;

StepKind step_of(const std::string& name) {
  for (const StepKind kind : {StepKind::Full, StepKind::Damped, StepKind::Regularized,
                              StepKind::Restored, StepKind::Rejected})
    if (palanquin::to_string(kind) == name) return kind;
  throw std::invalid_argument("there is no step '" + name + "'");
}

QpStatus qp_status_of(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(QpStatus::Unsupported); ++i)
    if (palanquin::to_string(static_cast<QpStatus>(i)) == name) return static_cast<QpStatus>(i);
  throw std::invalid_argument("there is no QP status '" + name + "'");
}

void bind_candidates(nb::module_& m) {
  nb::class_<Candidates>(m, "Candidates", "Several starts solved side by side; see candidates.hpp.")
      .def(nb::init<std::vector<std::shared_ptr<Sqp>>, int>(), "solvers"_a, "threads"_a)
      .def(
          "solve",
          [](Candidates& self, const std::vector<RowMatrix>& parameters, VectorView measured,
             const std::vector<RowMatrix>& guesses) {
            std::vector<const RowMatrix*> p, g;
            for (const RowMatrix& given : parameters) p.push_back(&given);
            for (const RowMatrix& given : guesses) g.push_back(&given);
            return self.solve(p, measured, g);
          },
          "parameters"_a, "measured"_a, "guesses"_a, nb::call_guard<nb::gil_scoped_release>());
  m.def(
      "plan_events",
      [](const std::vector<StepParts>& steps, bool is_usable, const std::string& message,
         double time) {
        std::vector<IterationRecord> history;
        for (const auto& [kind, length, damping, convexified, refused_cycle, answer] : steps) {
          IterationRecord& record = history.emplace_back();
          record.step = step_of(kind);
          record.step_length = length;
          record.damping = damping;
          record.convexified = convexified;
          record.refused_cycle = refused_cycle;
          record.fell_back = !answer.empty();
          if (record.fell_back) record.qp_status = qp_status_of(answer);
        }
        std::vector<Event> events;
        append_plan_events(history, is_usable, time, events);
        return in_words(events, message);
      },
      "steps"_a, "is_usable"_a, "message"_a, "time"_a);
}

void bind_observers(nb::module_& m) {
  nb::class_<ObserverGains>(m, "ObserverGains", "Of one body; see wrench_observer.hpp.")
      .def(
          "__init__",
          [](ObserverGains* self, double force, double most_force, double torque,
             double most_torque) {
            new (self) ObserverGains{force, most_force, torque, most_torque};
          },
          "force"_a = 0.0, "most_force"_a = 0.0, "torque"_a = 0.0, "most_torque"_a = 0.0);
  nb::class_<ObserverSettings>(m, "ObserverSettings", "Of a team's; see wrench_observer.hpp.")
      .def(
          "__init__",
          [](ObserverSettings* self, const ObserverGains& robots, const ObserverGains& payload) {
            const ObserverSettings settings{robots, payload};
            if (const std::string reason = settings.explain_invalid(); !reason.empty())
              throw std::invalid_argument(reason);
            new (self) ObserverSettings(settings);
          },
          "robots"_a = ObserverGains(), "payload"_a = ObserverGains());
}

TeamState state_of(MatrixView bodies, MatrixView feet) { return {bodies, feet}; }

void bind_planner(nb::module_& m) {
  using Release = nb::call_guard<nb::gil_scoped_release>;
  nb::class_<TeamPlanner>(m, "TeamPlanner", "Plans for a team; see team_planner.hpp.")
      .def(
          "__init__",
          [](TeamPlanner* self, std::shared_ptr<LoweredProblem> problem, const Team& team,
             std::shared_ptr<const Terrain> terrain, const RowMatrix& parameters,
             std::vector<std::shared_ptr<Sqp>> solvers, bool looks_ahead, bool on_ground,
             int restart_after, int threads, const ObserverSettings& observers) {
            PlannerSettings settings;
            settings.footholds = looks_ahead ? FootholdRule::Raibert : FootholdRule::Hips;
            settings.references = references_of(on_ground);
            settings.restart_after = restart_after;
            settings.threads = threads;
            settings.observers = observers;
            new (self) TeamPlanner(std::move(problem), team, std::move(terrain), settings,
                                   parameters, std::move(solvers));
          },
          "problem"_a, "team"_a, "terrain"_a, "parameters"_a, "solvers"_a, "looks_ahead"_a,
          "on_ground"_a, "restart_after"_a, "threads"_a, "observers"_a)
      .def(
          "solve",
          [](TeamPlanner& p, double time, MatrixView bodies, MatrixView feet, const Vector3& v) {
            return p.solve(time, state_of(bodies, feet), velocity_of(v));
          },
          "time"_a, "bodies"_a, "feet"_a, "command"_a, Release())
      .def(
          "prepare",
          [](TeamPlanner& p, double time, MatrixView bodies, MatrixView feet, const Vector3& v) {
            return p.prepare(time, state_of(bodies, feet), velocity_of(v));
          },
          "time"_a, "bodies"_a, "feet"_a, "command"_a, Release())
      .def(
          "feedback",
          [](TeamPlanner& p, MatrixView bodies, MatrixView feet) {
            return p.feedback(state_of(bodies, feet));
          },
          "bodies"_a, "feet"_a, Release())
      .def(
          "restart", [](TeamPlanner& p, const Vector3& pose) { p.restart(pose_of(pose)); },
          "reference"_a)
      .def("set_ditches", &TeamPlanner::set_ditches, "lines"_a)
      .def("expect_wrenches", &TeamPlanner::expect_wrenches, "wrenches"_a)
      .def("use_solvers", &TeamPlanner::use_solvers, "solvers"_a)
      .def(
          "reference_at",
          [](const TeamPlanner& p, double time) { return vector_of(p.reference_at(time)); },
          "time"_a)
      .def_prop_rw(
          "reference", [](const TeamPlanner& p) { return vector_of(p.reference()); },
          [](TeamPlanner& p, const Vector3& pose) { p.set_reference(pose_of(pose)); })
      .def(
          "clock", [](TeamPlanner& p, int robot) { return &p.clock(robot); }, "robot"_a,
          nb::rv_policy::reference_internal)
      .def_prop_ro(
          "parameters",
          [](TeamPlanner& p) {
            RowMatrix& values = p.parameters();
            return Eigen::Map<RowMatrix>(values.data(), values.rows(), values.cols());
          },
          nb::rv_policy::reference_internal)
      .def_prop_ro("references",
                   [](const TeamPlanner& p) {
                     const References& references = p.instant().references;
                     return std::make_pair(references.bodies, references.footholds);
                   })
      .def_prop_ro("contacts", [](const TeamPlanner& p) { return Flags(p.instant().contacts); })
      .def_prop_ro("time", [](const TeamPlanner& p) { return p.instant().time; })
      .def_prop_ro("measured", [](const TeamPlanner& p) { return Eigen::VectorXd(p.measured()); })
      .def_prop_ro("predicted", [](const TeamPlanner& p) { return Eigen::VectorXd(p.predicted()); })
      .def_prop_ro("guess", [](const TeamPlanner& p) { return RowMatrix(p.guess()); })
      .def_prop_ro("chosen", &TeamPlanner::chosen)
      .def_prop_ro("observed_wrenches",
                   [](const TeamPlanner& p) { return RowMatrix(p.observed_wrenches()); })
      .def_prop_ro("apparent_payload_mass", &TeamPlanner::apparent_payload_mass)
      .def_prop_ro("solve_ms", &TeamPlanner::solve_ms)
      .def_prop_ro("failures", &TeamPlanner::failures)
      .def_prop_ro("has_fed_back", &TeamPlanner::has_fed_back)
      .def_prop_ro("events",
                   [](const TeamPlanner& p) { return in_words(p.events(), p.solver().message()); });
}

}  // namespace

void bind_planning(nb::module_& m) {
  m.def("save_planner", &save_planner, "planner"_a, "policies"_a, "folder"_a);
  m.def(
      "sqp_settings_text", [](const SqpSettings& s) { return planning::to_text(s); }, "settings"_a);
  bind_team(m);
  bind_references(m);
  bind_candidates(m);
  bind_observers(m);
  bind_planner(m);
}

}  // namespace palanquin
