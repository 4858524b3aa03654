#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <cstdint>

#include "bindings.hpp"
#include "palanquin/sim/team_simulation.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

using Flags = Eigen::Matrix<bool, Eigen::Dynamic, kLegs, Eigen::RowMajor>;

Flags contacts(const TeamSimulation& simulation, int robot, const Eigen::VectorXd& times) {
  Flags flags(times.size(), kLegs);
  for (Eigen::Index k = 0; k < times.size(); ++k) {
    const auto row = simulation.controller(robot).contacts(simulation.time(), times[k]);
    for (int leg = 0; leg < kLegs; ++leg) flags(k, leg) = row[static_cast<std::size_t>(leg)];
  }
  return flags;
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
  nb::class_<TeamMember>(m, "TeamMember", "One robot of a team; see team_simulation.hpp.")
      .def(nb::init<>())
      .def_rw("name", &TeamMember::name)
      .def_rw("robot", &TeamMember::robot)
      .def_prop_rw(
          "hips", [](const TeamMember& t) { return Eigen::MatrixXd(t.hips.transpose()); },
          [](TeamMember& t, const Eigen::Matrix<double, kLegs, 3>& h) { t.hips = h.transpose(); },
          "[4, 3], base axes, m.")
      .def_rw("control", &TeamMember::control)
      .def_rw("measurement", &TeamMember::measurement)
      .def_rw("trunk", &TeamMember::trunk)
      .def_rw("joints", &TeamMember::joints)
      .def_rw("motors", &TeamMember::motors)
      .def_rw("foot_geoms", &TeamMember::foot_geoms);
  nb::class_<BarSites>(m, "BarSites", "Two sites that a bar holds apart, m.")
      .def(nb::init<int, int, double>(), "first"_a, "second"_a, "length"_a);
  nb::class_<TeamExtremes>(m, "TeamExtremes", "Worst values since the start.")
      .def_ro("torque_fraction", &TeamExtremes::torque_fraction)
      .def_ro("bar_length_error", &TeamExtremes::bar_length_error)
      .def_ro("contact_force", &TeamExtremes::contact_force)
      .def_ro("fallbacks", &TeamExtremes::fallbacks)
      .def_ro("control_ms", &TeamExtremes::control_ms)
      .def_ro("control_periods", &TeamExtremes::control_periods);
}

}  // namespace

void bind_simulation(nb::module_& m) {
  bind_data(m);
  nb::class_<TeamSimulation>(m, "TeamSimulation", "Steps a team; see team_simulation.hpp.")
      .def(
          "__init__",
          [](TeamSimulation* self, std::uintptr_t model, std::uintptr_t data,
             const std::vector<TeamMember>& members, std::vector<int> keep_off,
             std::vector<BarSites> bars, std::vector<Disturbance> disturbances) {
            new (self) TeamSimulation(
                reinterpret_cast<mjModel_*>(model), reinterpret_cast<mjData_*>(data), members,
                std::move(keep_off), std::move(bars), std::move(disturbances));
          },
          "model_address"_a, "data_address"_a, "members"_a, "keep_off"_a, "bars"_a,
          "disturbances"_a,
          "`model_address` and `data_address` are MuJoCo's `_address`; both must outlive this.")
      .def("run", &TeamSimulation::run, "periods"_a, "targets"_a,
           nb::call_guard<nb::gil_scoped_release>())
      .def("observe", &TeamSimulation::observe, "robot"_a)
      .def("measured", &TeamSimulation::measured, "robot"_a)
      .def("contacts", &contacts, "robot"_a, "times"_a, "Flags [n, 4] at `times` [n].")
      .def(
          "foot_forces",
          [](const TeamSimulation& s, int robot) {
            return Eigen::MatrixXd(s.foot_forces(robot).transpose());
          },
          "robot"_a, "[4, 3], world, N.")
      .def(
          "output_errors",
          [](const TeamSimulation& s, int robot) {
            return Eigen::VectorXd(s.controller(robot).output_errors());
          },
          "robot"_a, "Virtual constraints [6]: centre of mass (m), orientation (rad).")
      .def_prop_ro("time", &TeamSimulation::time)
      .def_prop_ro("has_fallen", &TeamSimulation::has_fallen)
      .def_prop_ro("fall", &TeamSimulation::fall)
      .def_prop_ro("fall_time", &TeamSimulation::fall_time)
      .def_prop_ro("extremes", &TeamSimulation::extremes);
}

}  // namespace palanquin
