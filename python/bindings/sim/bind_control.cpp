#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <stdexcept>

#include "bindings.hpp"
#include "palanquin/control/whole_body/robot_controller.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

void bind_control(nb::module_& m) {
  nb::class_<Gains>(m, "Gains", "Of a virtual constraint, 1/s^2 and 1/s.")
      .def(nb::init<double, double>(), "kp"_a, "kd"_a)
      .def_rw("kp", &Gains::kp)
      .def_rw("kd", &Gains::kd);
  nb::class_<WholeBodySettings>(m, "WholeBodySettings", "See whole_body_controller.hpp.")
      .def(nb::init<>())
      .def_rw("torque_weight", &WholeBodySettings::torque_weight)
      .def_rw("force_weight", &WholeBodySettings::force_weight)
      .def_rw("slack_weight", &WholeBodySettings::slack_weight)
      .def_rw("com", &WholeBodySettings::com)
      .def_rw("orientation", &WholeBodySettings::orientation)
      .def_rw("point", &WholeBodySettings::point)
      .def_rw("joint", &WholeBodySettings::joint)
      .def_rw("contact_damping", &WholeBodySettings::contact_damping)
      .def_rw("largest_force", &WholeBodySettings::largest_force)
      .def_rw("hold_periods", &WholeBodySettings::hold_periods)
      .def("explain_invalid", &WholeBodySettings::explain_invalid);
  nb::class_<GaitPattern>(m, "GaitPattern", "See gait_pattern.hpp.")
      .def(nb::init<>())
      .def_rw("period", &GaitPattern::period)
      .def_rw("duty", &GaitPattern::duty)
      .def_rw("offset", &GaitPattern::offset)
      .def_rw("start", &GaitPattern::start)
      .def(
          "stands",
          [](const GaitPattern& gait, int leg, double time) {
            if (leg < 0 || leg >= kLegs)
              throw std::out_of_range("leg is " + std::to_string(leg) + "; 0 to 3 exist");
            return gait.stands(leg, time);
          },
          "leg"_a, "time"_a)
      .def("explain_invalid", &GaitPattern::explain_invalid);
  nb::class_<ContactSettings>(m, "ContactSettings", "See contact_monitor.hpp.")
      .def(nb::init<>())
      .def_rw("touch_force", &ContactSettings::touch_force)
      .def_rw("release_force", &ContactSettings::release_force)
      .def_rw("lost_time", &ContactSettings::lost_time)
      .def_rw("earliest", &ContactSettings::earliest)
      .def_rw("early_force", &ContactSettings::early_force)
      .def("explain_invalid", &ContactSettings::explain_invalid);
  nb::class_<RobotControlSettings>(m, "RobotControlSettings", "See robot_controller.hpp.")
      .def(nb::init<>())
      .def_rw("whole_body", &RobotControlSettings::whole_body)
      .def_rw("gait", &RobotControlSettings::gait)
      .def_rw("contact", &RobotControlSettings::contact)
      .def_rw("friction", &RobotControlSettings::friction)
      .def_rw("swing_clearance", &RobotControlSettings::swing_clearance)
      .def_rw("foothold_gain", &RobotControlSettings::foothold_gain)
      .def_rw("reach_speed", &RobotControlSettings::reach_speed)
      .def_rw("reach_depth", &RobotControlSettings::reach_depth)
      .def_rw("penetration", &RobotControlSettings::penetration)
      .def_rw("foot_radius", &RobotControlSettings::foot_radius)
      .def("explain_invalid", &RobotControlSettings::explain_invalid);
  nb::class_<RobotTarget>(m, "RobotTarget", "What the planner wants; see robot_controller.hpp.")
      .def(nb::init<>())
      .def_rw("time", &RobotTarget::time)
      .def_rw("position", &RobotTarget::position)
      .def_rw("velocity", &RobotTarget::velocity)
      .def_rw("acceleration", &RobotTarget::acceleration)
      .def_rw("orientation", &RobotTarget::orientation)
      .def_rw("rate", &RobotTarget::rate)
      .def_rw("rate_derivative", &RobotTarget::rate_derivative)
      .def_prop_rw(
          "forces", [](const RobotTarget& t) { return Eigen::MatrixXd(t.forces.transpose()); },
          [](RobotTarget& t, const Eigen::Matrix<double, kLegs, 3>& f) {
            t.forces = f.transpose();
          },
          "Of the ground on the feet [4, 3], world, N.")
      .def_rw("commanded_velocity", &RobotTarget::commanded_velocity)
      .def_rw("commanded_yaw_rate", &RobotTarget::commanded_yaw_rate);
  nb::class_<RobotObservation>(m, "RobotObservation", "See robot_controller.hpp; feet are [4, 3].")
      .def_ro("position", &RobotObservation::position)
      .def_ro("velocity", &RobotObservation::velocity)
      .def_ro("orientation", &RobotObservation::orientation)
      .def_ro("rate", &RobotObservation::rate)
      .def_prop_ro("feet",
                   [](const RobotObservation& o) { return Eigen::MatrixXd(o.feet.transpose()); })
      .def_prop_ro(
          "footholds",
          [](const RobotObservation& o) { return Eigen::MatrixXd(o.footholds.transpose()); })
      .def_ro("ground", &RobotObservation::ground);
}

}  // namespace palanquin
