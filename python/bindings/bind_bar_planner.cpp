// Planners of robots on bars.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <initializer_list>
#include <memory>

#include "bindings.hpp"
#include "palanquin/control/planning/bar_planner_file.hpp"
#include "palanquin/control/planning/centralized_planner.hpp"
#include "palanquin/control/planning/distributed_planner.hpp"
#include "palanquin/control/planning/rotations.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

using namespace planning;

namespace {

using Release = nb::call_guard<nb::gil_scoped_release>;
using Array = nb::ndarray<nb::numpy, double>;

/// A copy of a matrix as an array of another shape.
Array shaped(RowMatrix matrix, std::initializer_list<Eigen::Index> shape) {
  std::array<std::size_t, 4> sizes{};
  std::copy(shape.begin(), shape.end(), sizes.begin());
  auto copy = std::make_unique<RowMatrix>(std::move(matrix));
  double* data = copy->data();
  const nb::capsule owner(copy.release(),
                          [](void* p) noexcept { delete static_cast<RowMatrix*>(p); });
  return {data, shape.size(), sizes.data(), owner};
}

/// One part of the next knot's (r, v, xi, w), [M, 3].
RowMatrix next_knot(const LayeredPlan& plan, int part) {
  RowMatrix values(plan.robots(), 3);
  for (int i = 0; i < plan.robots(); ++i)
    values.row(i) = plan.states.row(1).segment<3>(12 * i + 3 * part);
  return values;
}

Array rotations(const LayeredPlan& plan, bool at_next_knot) {
  RowMatrix rows(3 * plan.robots(), 3);
  for (int i = 0; i < plan.robots(); ++i) {
    const Matrix3& operating = plan.operating[static_cast<std::size_t>(i)];
    const Vector3 xi = plan.states.row(1).segment<3>(12 * i + 6);
    rows.middleRows<3>(3 * i) = at_next_knot ? Matrix3(operating * rotation_exp(xi)) : operating;
  }
  return shaped(std::move(rows), {plan.robots(), 3, 3});
}

void bind_plans(nb::module_& m) {
  nb::class_<LayeredPlan>(m, "LayeredPlan", R"(A plan of one sample of M robots on bars.

For the whole-body layer: the next knot and the forces until then. Arrays are copies.)")
      .def_ro("time", &LayeredPlan::time, "When it was made, s.")
      .def_ro("dt", &LayeredPlan::dt, "Length of an interval, s.")
      .def_prop_ro(
          "states",
          [](const LayeredPlan& p) { return shaped(p.states, {p.states.rows(), p.robots(), 12}); },
          nb::rv_policy::automatic,
          "Planned (r, v, xi, w) at all knots, xi about `operating`, [N + 1, M, 12].")
      .def_prop_ro(
          "operating", [](const LayeredPlan& p) { return rotations(p, false); },
          nb::rv_policy::automatic, "Rotations R_op, [M, 3, 3].")
      .def_prop_ro(
          "inputs",
          [](const LayeredPlan& p) {
            return shaped(p.inputs, {p.horizon(), p.robots(), kFeet, 3});
          },
          nb::rv_policy::automatic, "Ground reaction forces in the world, N, [N, M, 4, 3].")
      .def_prop_ro(
          "bars", [](const LayeredPlan& p) { return shaped(p.bars, {p.horizon(), p.bars.cols()}); },
          nb::rv_policy::automatic, "Multipliers [N, rows of all bars]; for a free bar N/m.")
      .def_prop_ro(
          "estimates",
          [](const LayeredPlan& p) {
            return shaped(p.estimates, {p.robots(), p.estimates.cols()});
          },
          nb::rv_policy::automatic,
          "Each robot's own estimate of them at the first knot, [M, rows]; NaN of others' bars.")
      .def_prop_ro(
          "status", [](const LayeredPlan& p) { return std::string(to_string(p.status)); },
          "Why the solver stopped.")
      .def_ro("is_usable", &LayeredPlan::is_usable,
              "Whether this is a solution; if not, it is the last one, shifted.")
      .def_ro("event", &LayeredPlan::event, "What went wrong, in words.")
      .def_ro("solve_ms", &LayeredPlan::solve_ms,
              "From the states to this plan, all robots' QPs one after the other.")
      .def_prop_ro(
          "cost", [](const LayeredPlan& p) { return nb::tuple(nb::cast(p.cost)); },
          nb::sig("def cost(self) -> tuple[float, ...]"),
          "Optimal costs, constants included: one, or one a robot; none without a solution.")
      .def_prop_ro(
          "position", [](const LayeredPlan& p) { return next_knot(p, 0); },
          "Desired centres of mass at the next knot, m, [M, 3].")
      .def_prop_ro(
          "velocity", [](const LayeredPlan& p) { return next_knot(p, 1); },
          "Desired velocities at the next knot, m/s, [M, 3].")
      .def_prop_ro(
          "rotation", [](const LayeredPlan& p) { return rotations(p, true); },
          nb::rv_policy::automatic, "Desired rotations at the next knot, body to world, [M, 3, 3].")
      .def_prop_ro(
          "angular_velocity", [](const LayeredPlan& p) { return next_knot(p, 3); },
          "Desired angular velocities at the next knot, body axes, rad/s, [M, 3].")
      .def_prop_ro(
          "forces",
          [](const LayeredPlan& p) { return shaped(p.inputs.topRows(1), {p.robots(), kFeet, 3}); },
          nb::rv_policy::automatic,
          "Ground reaction forces until the next knot, world, N, [M, 4, 3]; zero in swing.")
      .def_prop_ro(
          "multipliers", [](const LayeredPlan& p) { return Eigen::VectorXd(p.bars.row(0)); },
          "The bars' multipliers until the next knot, [rows].");
  nb::class_<BarPlan>(m, "BarPlan", "A plan with what it was made for; see bar_planner.hpp.")
      .def_ro("layered", &BarPlan::mpc)
      .def_prop_ro(
          "bodies",
          [](const BarPlan& p) {
            return shaped(p.bodies, {p.bodies.rows(), p.mpc.robots(), kState});
          },
          nb::rv_policy::automatic)
      .def_prop_ro(
          "feet",
          [](const BarPlan& p) {
            const LayeredPlan& plan = p.mpc;
            const RowMatrix one = p.feet.reshaped<Eigen::RowMajor>().transpose();
            return shaped(one.replicate(plan.horizon(), 1),
                          {plan.horizon(), plan.robots(), kFeet, 3});
          },
          nb::rv_policy::automatic, "Over the horizon.")
      .def_prop_ro("reference", &BarPlan::reference_states)
      .def("friction_violation", &BarPlan::friction_violation, "friction"_a);
}

/// Robots' motions as arrays: positions, velocities, rotations [3 M, 3] and angular velocities,
/// [M, 3] each.
struct Motions {
  MatrixView position, velocity, rotation, angular_velocity;
  std::vector<BodyMotion> all() const {
    std::vector<BodyMotion> motions(static_cast<std::size_t>(position.rows()));
    for (Eigen::Index i = 0; i < position.rows(); ++i)
      motions[static_cast<std::size_t>(i)] = {
          position.row(i), velocity.row(i), rotation.middleRows<3>(3 * i), angular_velocity.row(i)};
    return motions;
  }
};

BarSample sample_of(double time, const Motions& measured, MatrixView feet, const Flags& contacts,
                    const Motions& desired) {
  return {time, measured.all(), feet, contacts, desired.all()};
}

/// A method that takes a sample as arrays.
template <typename Planner, typename Call>
auto taking_sample(Call call) {
  return [call](Planner& planner, double time, MatrixView r, MatrixView v, MatrixView R,
                MatrixView w, MatrixView feet, const Flags& contacts, MatrixView r_desired,
                MatrixView v_desired, MatrixView R_desired, MatrixView w_desired) {
    return call(planner, sample_of(time, {r, v, R, w}, feet, contacts,
                                   {r_desired, v_desired, R_desired, w_desired}));
  };
}

BarTeam team_of(const std::vector<double>& masses,
                const std::vector<std::pair<std::array<int, 2>, int>>& bars) {
  BarTeam team{masses, {}};
  for (const auto& [robots, rows] : bars) team.bars.push_back({robots, rows});
  return team;
}

void bind_layered(nb::module_& m) {
  nb::class_<BarTeam>(m, "BarTeam", "Robots on bars; see bar_team.hpp.")
      .def(
          "__init__",
          [](BarTeam* self, const std::vector<double>& masses,
             const std::vector<std::pair<std::array<int, 2>, int>>& bars) {
            new (self) BarTeam(team_of(masses, bars));
          },
          "masses"_a, "bars"_a);
  nb::class_<LinearMpc>(m, "LinearMpc", "One QP at an operating point; see linear_mpc.hpp.")
      .def(nb::init<std::shared_ptr<LoweredProblem>, RowMatrix, std::shared_ptr<Sqp>>(),
           "problem"_a, "parameters"_a, "sqp"_a)
      .def_prop_ro(
          "parameters",
          [](LinearMpc& mpc) {
            RowMatrix& values = mpc.parameters;
            return Eigen::Map<RowMatrix>(values.data(), values.rows(), values.cols());
          },
          nb::rv_policy::reference_internal)
      .def_prop_ro(
          "guess",
          [](LinearMpc& mpc) {
            RowMatrix& values = mpc.guess;
            return Eigen::Map<RowMatrix>(values.data(), values.rows(), values.cols());
          },
          nb::rv_policy::reference_internal);
  const auto plan = [](LayeredPlanner& planner, const BarSample& sample) {
    return planner.plan(sample);
  };
  nb::class_<LayeredPlanner>(m, "LayeredPlanner", "Plans for robots on bars; see its header.")
      .def("plan", taking_sample<LayeredPlanner>(plan), "time"_a, "position"_a, "velocity"_a,
           "rotation"_a, "angular_velocity"_a, "feet"_a, "contacts"_a, "desired_position"_a,
           "desired_velocity"_a, "desired_rotation"_a, "desired_angular_velocity"_a, Release())
      .def("operate_at", &LayeredPlanner::operate_at, "inputs"_a, "multipliers"_a);
  const auto linearize = [](CentralizedPlanner& planner, const BarSample& sample) {
    planner.linearize_at(sample);
  };
  nb::class_<CentralizedPlanner, LayeredPlanner>(m, "CentralizedPlanner", "See its header.")
      .def(
          "__init__",
          [](CentralizedPlanner* self, const BarTeam& team, double dt,
             std::shared_ptr<LinearMpc> mpc) {
            LayeredSettings settings;
            settings.dt = dt;
            new (self) CentralizedPlanner(team, settings, std::move(mpc));
          },
          "team"_a, "dt"_a, "mpc"_a)
      .def("linearize_at", taking_sample<CentralizedPlanner>(linearize), "time"_a, "position"_a,
           "velocity"_a, "rotation"_a, "angular_velocity"_a, "feet"_a, "contacts"_a,
           "desired_position"_a, "desired_velocity"_a, "desired_rotation"_a,
           "desired_angular_velocity"_a);
  nb::class_<LinkSettings>(m, "LinkSettings", "See link.hpp.")
      .def(
          "__init__",
          [](LinkSettings* self, int delay, double loss, double bias, int bias_from,
             unsigned seed) { new (self) LinkSettings{delay, loss, bias, bias_from, seed}; },
          "delay"_a, "loss"_a, "bias"_a, "bias_from"_a, "seed"_a);
  nb::class_<DistributedPlanner, LayeredPlanner>(m, "DistributedPlanner", "See its header.")
      .def(
          "__init__",
          [](DistributedPlanner* self, const BarTeam& team, double dt, bool dual_terms,
             int exchanges, std::vector<std::shared_ptr<LinearMpc>> mpcs,
             DistributedPlanner::Links links) {
            new (self) DistributedPlanner(team, {dt, dual_terms, exchanges}, std::move(mpcs),
                                          std::move(links));
          },
          "team"_a, "dt"_a, "dual_terms"_a, "exchanges"_a, "mpcs"_a, "links"_a)
      .def_prop_ro("local_ms", [](const DistributedPlanner& p) {
        std::vector<double> ms;
        ms.reserve(static_cast<std::size_t>(p.team().robots()));
        for (int i = 0; i < p.team().robots(); ++i) ms.push_back(p.local(i).solve_ms());
        return ms;
      });
  nb::class_<BarPlanner>(m, "BarPlanner", "Leads robots on bars; see bar_planner.hpp.")
      .def(
          "__init__",
          [](BarPlanner* self, std::shared_ptr<LayeredPlanner> planner, bool in_circle,
             double length) {
            const auto shape = in_circle ? Leash::Shape::Circle : Leash::Shape::Square;
            new (self) BarPlanner(std::move(planner), {shape, length});
          },
          "planner"_a, "in_circle"_a, "length"_a)
      .def(
          "plan",
          [](BarPlanner& self, double time, MatrixView bodies, MatrixView feet,
             MatrixView footholds, VectorView ground, const Flags& contacts, MatrixView commands) {
            std::vector<Velocity> velocities;
            velocities.reserve(static_cast<std::size_t>(commands.rows()));
            for (Eigen::Index i = 0; i < commands.rows(); ++i)
              velocities.push_back({commands(i, 0), commands(i, 1), commands(i, 2)});
            return self.plan({time, bodies, feet, footholds, ground}, contacts, velocities);
          },
          "time"_a, "bodies"_a, "feet"_a, "footholds"_a, "ground"_a, "contacts"_a, "commands"_a,
          Release())
      .def_prop_ro("reference", [](const BarPlanner& p) {
        Vector3 pose = Vector3::Zero();
        if (p.references().empty()) return pose;
        const BarReference& first = p.references().front();
        return Vector3(first.position.x(), first.position.y(), first.yaw);
      });
}

}  // namespace

void bind_bar_planner(nb::module_& m) {
  bind_plans(m);
  bind_layered(m);
  m.def("save_bar_planner", &save_bar_planner, "planner"_a, "problems"_a, "folder"_a);
}

}  // namespace palanquin
