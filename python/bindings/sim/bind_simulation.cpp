#include <nanobind/eigen/dense.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "bindings.hpp"
#include "palanquin/plant/team_simulation.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// The C struct behind an object of the Python package mujoco, whose type `kind` names.
template <class Struct>
Struct* struct_of(const nb::object& object, const char* kind) {
  if (!nb::isinstance(object, nb::module_::import_("mujoco").attr(kind)))
    throw nb::type_error((std::string("a mujoco.") + kind + " is needed").c_str());
  // NOLINTNEXTLINE(performance-no-int-to-ptr): so are addresses told by Python packages
  return reinterpret_cast<Struct*>(nb::cast<std::uintptr_t>(object.attr("_address")));
}

void construct(TeamSimulation* self, const nb::object& model, const nb::object& data,
               const std::vector<TeamMember>& members, const std::vector<int>& keep_off,
               std::vector<BarSites> bars, std::vector<Disturbance> disturbances) {
  auto* const model_struct = struct_of<mjModel_>(model, "MjModel");
  auto* const data_struct = struct_of<mjData_>(data, "MjData");
  if (!data.attr("model").is(model))  // its arrays would have other lengths
    throw std::invalid_argument("team simulation: data is another model's");
  new (self) TeamSimulation(model_struct, data_struct, members, keep_off, std::move(bars),
                            std::move(disturbances));
}

using Flags = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Flags contacts(const TeamSimulation& simulation, int robot, const Eigen::VectorXd& times) {
  const RobotController& controller = simulation.controller(robot);
  Flags flags(times.size(), controller.feet());
  for (Eigen::Index k = 0; k < times.size(); ++k)
    for (int foot = 0; foot < controller.feet(); ++foot)
      flags(k, foot) = controller.will_bear(foot, times[k]);
  return flags;
}

/// The same of all robots' feet, [n, 4 R].
Flags contacts_of_all(const TeamSimulation& simulation, const Eigen::VectorXd& times) {
  const int feet = simulation.controller(0).feet();
  Flags flags(times.size(), feet * simulation.robots());
  for (int i = 0; i < simulation.robots(); ++i)
    flags.middleCols(feet * i, feet) = contacts(simulation, i, times);
  return flags;
}

Eigen::MatrixXd foot_forces(const TeamSimulation& simulation, int robot) {
  return simulation.foot_forces(robot).transpose();
}

Eigen::MatrixXd known_forces(const TeamSimulation& simulation, int robot) {
  return simulation.known_forces(robot).transpose();
}

Eigen::VectorXd output_errors(const TeamSimulation& simulation, int robot) {
  return simulation.controller(robot).output_errors();
}

/// Of all robots: states [R, 13], feet and footholds [4 R, 3], heights of the ground [R].
using Observations = std::tuple<RowMatrix, RowMatrix, RowMatrix, Eigen::VectorXd>;

Observations observe_all(TeamSimulation& simulation) {
  const int robots = simulation.robots(), feet = simulation.controller(0).feet();
  Observations all{RowMatrix(robots, 13), RowMatrix(feet * robots, 3), RowMatrix(feet * robots, 3),
                   Eigen::VectorXd(robots)};
  auto& [bodies, stands, footholds, ground] = all;
  for (int i = 0; i < robots; ++i) {
    const RobotObservation seen = simulation.observe(i);
    bodies.row(i) << seen.position.transpose(), seen.orientation.transpose(),
        seen.velocity.transpose(), seen.rate.transpose();
    stands.middleRows(feet * i, feet) = seen.feet.transpose();
    footholds.middleRows(feet * i, feet) = seen.footholds.transpose();
    ground[i] = seen.ground;
  }
  return all;
}

/// What a record has of all robots at a period's end: forces on the feet [4 R, 3], virtual
/// constraints [R, 6].
std::pair<RowMatrix, RowMatrix> values(const TeamSimulation& simulation) {
  const int robots = simulation.robots(), feet = simulation.controller(0).feet();
  std::pair<RowMatrix, RowMatrix> all{RowMatrix(feet * robots, 3), RowMatrix(robots, 6)};
  for (int i = 0; i < robots; ++i) {
    all.first.middleRows(feet * i, feet) = simulation.foot_forces(i).transpose();
    all.second.row(i) = output_errors(simulation, i).transpose();
  }
  return all;
}

const auto& last_qp(const TeamSimulation& simulation, int robot) {
  return simulation.controller(robot).controller().qp();
}

/// A getter whose result is copied before another thread may change the simulation.
template <class Result, class... Arguments>
auto guarded(const char* call, Result (*get)(const TeamSimulation&, Arguments...)) {
  return [call, get](const TeamSimulation& simulation, Arguments... arguments) {
    const auto use = simulation.read(call);
    return std::decay_t<Result>(get(simulation, arguments...));
  };
}
template <class Result, class... Arguments>
auto guarded(const char* call, Result (TeamSimulation::*get)(Arguments...) const) {
  return [call, get](const TeamSimulation& simulation, Arguments... arguments) {
    const auto use = simulation.read(call);
    return std::decay_t<Result>((simulation.*get)(arguments...));
  };
}

void bind_data(nb::module_& m) {
  nb::class_<MeasurementSettings>(m, "MeasurementSettings", "See measurement.hpp.")
      .def(nb::init<>())
      .def_rw("position", &MeasurementSettings::position)
      .def_rw("orientation", &MeasurementSettings::orientation)
      .def_rw("velocity", &MeasurementSettings::velocity)
      .def_rw("rate", &MeasurementSettings::rate)
      .def_rw("joint_position", &MeasurementSettings::joint_position)
      .def_rw("joint_velocity", &MeasurementSettings::joint_velocity)
      .def_rw("delay", &MeasurementSettings::delay)
      .def_rw("seed", &MeasurementSettings::seed)
      .def("explain_invalid", &MeasurementSettings::explain_invalid);
  nb::class_<Push>(m, "Push", "A force on a body; see disturbance.hpp.")
      .def(nb::init<>())
      .def_rw("body", &Push::body)
      .def_rw("point", &Push::point)
      .def_rw("amplitude", &Push::amplitude)
      .def_rw("period", &Push::period)
      .def_rw("phase", &Push::phase)
      .def_rw("start", &Push::start)
      .def_rw("end", &Push::end)
      .def("force", &Push::force, "time"_a);
  nb::class_<Tether>(m, "Tether", "A rope; see disturbance.hpp.")
      .def(nb::init<>())
      .def_rw("body", &Tether::body)
      .def_rw("point", &Tether::point)
      .def_rw("anchor", &Tether::anchor)
      .def_rw("velocity", &Tether::velocity)
      .def_rw("slack", &Tether::slack)
      .def_rw("stiffness", &Tether::stiffness)
      .def_rw("damping", &Tether::damping)
      .def_rw("start", &Tether::start)
      .def_rw("end", &Tether::end);
  nb::class_<TeamMember> member(m, "TeamMember", "One robot of a team; see team_simulation.hpp.");
  def_rows(member, "hips", &TeamMember::hips, "[feet, 3], base axes, m; a copy.");
  def_list(member, "joints", &TeamMember::joints);
  def_list(member, "motors", &TeamMember::motors);
  def_list(member, "foot_geoms", &TeamMember::foot_geoms);
  member.def(nb::init<>())
      .def_rw("name", &TeamMember::name)
      .def_rw("robot", &TeamMember::robot)
      .def_rw("control", &TeamMember::control)
      .def_rw("measurement", &TeamMember::measurement)
      .def_rw("estimation", &TeamMember::estimation, nb::arg().none())
      .def_rw("trunk", &TeamMember::trunk);
  nb::class_<BarSites>(m, "BarSites", "Two sites that a bar holds apart, m.")
      .def(nb::init<int, int, double>(), "first"_a, "second"_a, "length"_a);
  nb::class_<TeamExtremes>(m, "TeamExtremes", "Worst values since the start.")
      .def_ro("torque_fraction", &TeamExtremes::torque_fraction)
      .def_ro("bar_length_error", &TeamExtremes::bar_length_error)
      .def_ro("contact_force", &TeamExtremes::contact_force)
      .def_ro("slip", &TeamExtremes::slip)
      .def_ro("collisions", &TeamExtremes::collisions)
      .def_ro("fallbacks", &TeamExtremes::fallbacks)
      .def_ro("control_ms", &TeamExtremes::control_ms)
      .def_ro("control_periods", &TeamExtremes::control_periods);
}

}  // namespace

void bind_simulation(nb::module_& m) {
  bind_data(m);
  nb::enum_<Sense>(m, "Sense", "What a robot may lose.")
      .value("STATE", Sense::State)
      .value("FOOT_FORCES", Sense::FootForces);
  nb::class_<TeamSimulation>(m, "TeamSimulation", "Steps a team; see team_simulation.hpp.")
      .def("__init__", &construct, "model"_a, "data"_a, "members"_a, "keep_off"_a, "bars"_a,
           "disturbances"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           "`model` and `data` are a mujoco.MjModel and a mujoco.MjData of it, kept alive.")
      .def("run", &TeamSimulation::run, "periods"_a, "targets"_a,
           nb::call_guard<nb::gil_scoped_release>())
      .def("observe", &TeamSimulation::observe, "robot"_a)
      .def("observe_all", &observe_all,
           "Of all robots: states [R, 13], feet and footholds [4 R, 3], heights of the ground [R].")
      .def("observe_truth", &TeamSimulation::observe_truth, "robot"_a)
      .def("change_gait", &TeamSimulation::change_gait, "robot"_a, "gait"_a, "time"_a,
           "at_once"_a = false,
           nb::sig("def change_gait(self, robot: int, gait: object, time: float, "
                   "at_once: bool = False) -> float"))
      .def("lose", &TeamSimulation::lose, "robot"_a, "sense"_a, "is_lost"_a)
      .def("measured", guarded("measured", &TeamSimulation::measured), "robot"_a)
      .def("qp", guarded("qp", &last_qp), "robot"_a,
           "A copy of the controller's last QP: torques, then the contacts' forces.")
      .def("contacts", guarded("contacts", &contacts), "robot"_a, "times"_a,
           "Flags [n, feet] at `times` [n].")
      .def("contacts_of_all", guarded("contacts_of_all", &contacts_of_all), "times"_a,
           "Of all robots, [n, 4 R].")
      .def("foot_forces", guarded("foot_forces", &foot_forces), "robot"_a, "[feet, 3], world, N.")
      .def("known_forces", guarded("known_forces", &known_forces), "robot"_a,
           "[feet, 3], world, N, as its controller knows them.")
      .def("estimation_errors", guarded("estimation_errors", &TeamSimulation::estimation_errors),
           "robot"_a)
      .def("output_errors", guarded("output_errors", &output_errors), "robot"_a,
           "Virtual constraints [6]: centre of mass (m), orientation (rad).")
      .def("values", guarded("values", &values),
           "Of all robots: `foot_forces` [4 R, 3] and `output_errors` [R, 6].")
      .def_prop_ro("time", guarded("time", &TeamSimulation::time))
      .def_prop_ro("has_fallen", guarded("has_fallen", &TeamSimulation::has_fallen))
      .def_prop_ro("fall", guarded("fall", &TeamSimulation::fall))
      .def_prop_ro("collision", guarded("collision", &TeamSimulation::collision))
      .def_prop_ro("fall_time", guarded("fall_time", &TeamSimulation::fall_time))
      .def_prop_ro("extremes", guarded("extremes", &TeamSimulation::extremes));
}

}  // namespace palanquin
