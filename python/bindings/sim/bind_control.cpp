#include <nanobind/eigen/dense.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <utility>
#include <vector>

#include "bindings.hpp"
#include "palanquin/control/whole_body/bar_targets.hpp"
#include "palanquin/control/whole_body/robot_controller.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// Columns of C++ are rows in Python.
template <class Class, Eigen::Matrix3Xd Class::* member>
Eigen::MatrixXd rows(const Class& object) {
  return (object.*member).transpose();
}

void set_hands(RobotTarget& target, std::vector<HandTarget> hands) {
  target.hands = std::move(hands);
}

void bind_settings(nb::module_& m) {
  nb::class_<TaskSettings>(m, "TaskSettings", "Of a task; see whole_body_controller.hpp.")
      .def(
          "__init__",
          [](TaskSettings* self, double kp, double kd, double weight) {
            new (self) TaskSettings{kp, kd, weight};
          },
          "kp"_a, "kd"_a, "weight"_a = 1e6, "Gains, 1/s^2 and 1/s, and what the slack costs.")
      .def_rw("kp", &TaskSettings::kp)
      .def_rw("kd", &TaskSettings::kd)
      .def_rw("weight", &TaskSettings::weight);
  nb::class_<WholeBodySettings>(m, "WholeBodySettings", "See whole_body_controller.hpp.")
      .def(nb::init<>())
      .def_rw("torque_weight", &WholeBodySettings::torque_weight)
      .def_rw("force_weight", &WholeBodySettings::force_weight)
      .def_rw("moment_weight", &WholeBodySettings::moment_weight)
      .def_rw("com", &WholeBodySettings::com)
      .def_rw("orientation", &WholeBodySettings::orientation)
      .def_rw("foot", &WholeBodySettings::foot)
      .def_rw("hand", &WholeBodySettings::hand)
      .def_rw("limb_orientation", &WholeBodySettings::limb_orientation)
      .def_rw("joint", &WholeBodySettings::joint)
      .def_rw("contact_damping", &WholeBodySettings::contact_damping)
      .def_rw("largest_force", &WholeBodySettings::largest_force)
      .def_rw("hold_periods", &WholeBodySettings::hold_periods)
      .def("explain_invalid", &WholeBodySettings::explain_invalid);
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
      .def_rw("gait", &RobotControlSettings::gait,  // of the type that _core registers
              nb::for_getter(nb::sig("def gait(self) -> object")),
              nb::for_setter(nb::sig("def gait(self, gait: object, /) -> None")))
      .def_rw("gait_start", &RobotControlSettings::gait_start)
      .def_rw("contact", &RobotControlSettings::contact)
      .def_rw("friction", &RobotControlSettings::friction)
      .def_rw("least_force", &RobotControlSettings::least_force)
      .def_rw("loaded_after", &RobotControlSettings::loaded_after)
      .def_rw("swing_clearance", &RobotControlSettings::swing_clearance)
      .def_rw("foothold_gain", &RobotControlSettings::foothold_gain)
      .def_rw("reach_speed", &RobotControlSettings::reach_speed)
      .def_rw("reach_depth", &RobotControlSettings::reach_depth)
      .def_rw("penetration", &RobotControlSettings::penetration)
      .def_rw("posture", &RobotControlSettings::posture)
      .def("explain_invalid", &RobotControlSettings::explain_invalid);
}

void bind_targets(nb::module_& m) {
  nb::class_<PointTarget>(m, "PointTarget", "Where a point should be, world axes.")
      .def(nb::init<>())
      .def_rw("position", &PointTarget::position)
      .def_rw("velocity", &PointTarget::velocity)
      .def_rw("acceleration", &PointTarget::acceleration);
  nb::class_<OrientationTarget>(m, "OrientationTarget", "How a body should be turned.")
      .def(nb::init<>())
      .def_rw("orientation", &OrientationTarget::orientation)
      .def_rw("rate", &OrientationTarget::rate)
      .def_rw("acceleration", &OrientationTarget::acceleration);
  nb::class_<Wrench>(m, "Wrench", "Of the world on a limb, world axes, N and N m.")
      .def(nb::init<>())
      .def_rw("force", &Wrench::force)
      .def_rw("moment", &Wrench::moment);
  nb::enum_<HandLoad>(m, "HandLoad", "What is known of the wrench of a hand's load.")
      .value("KNOWN", HandLoad::Known)
      .value("FORCE", HandLoad::Force)
      .value("WRENCH", HandLoad::Wrench);
  nb::class_<HandTarget>(m, "HandTarget", "See robot_target.hpp.")
      .def(nb::init<>())
      .def_rw("point", &HandTarget::point)
      .def_rw("orientation", &HandTarget::orientation)
      .def_rw("wrench", &HandTarget::wrench)
      .def_rw("load", &HandTarget::load);
  nb::class_<RobotTarget> target(m, "RobotTarget", "What the planner wants; see robot_target.hpp.");
  def_rows(target, "forces", &RobotTarget::forces,
           "Of the ground on the feet [feet, 3], world, N; a copy.");
  def_rows(target, "footholds", &RobotTarget::footholds,
           "Where swinging feet are to land [feet, 3], world, m; or NaN, or [0, 3]; a copy.");
  def_rows(target, "normals", &RobotTarget::normals,
           "Of the ground at the feet [feet, 3]; or [0, 3]; a copy.");
  target.def(nb::init<>())
      .def_rw("time", &RobotTarget::time)
      .def_rw("position", &RobotTarget::position)
      .def_rw("velocity", &RobotTarget::velocity)
      .def_rw("acceleration", &RobotTarget::acceleration)
      .def_rw("orientation", &RobotTarget::orientation)
      .def_rw("rate", &RobotTarget::rate)
      .def_rw("rate_derivative", &RobotTarget::rate_derivative)
      .def_rw("commanded_velocity", &RobotTarget::commanded_velocity)
      .def_rw("commanded_yaw_rate", &RobotTarget::commanded_yaw_rate)
      .def_prop_rw("hands", nullptr, &set_hands, "A HandTarget for each, to be set as a whole.");
  m.def("targets_of", &targets_of, "plan"_a,
        nb::sig("def targets_of(plan: object) -> list[RobotTarget]"),
        "What the controllers are given of a plan of robots on bars, one each.");
  nb::class_<HandObservation>(m, "HandObservation", "A hand's motion, world axes.")
      .def_ro("position", &HandObservation::position)
      .def_ro("orientation", &HandObservation::orientation)
      .def_ro("velocity", &HandObservation::velocity)
      .def_ro("rate", &HandObservation::rate);
  nb::class_<RobotObservation>(m, "RobotObservation", "See robot_target.hpp.")
      .def_ro("position", &RobotObservation::position)
      .def_ro("velocity", &RobotObservation::velocity)
      .def_ro("orientation", &RobotObservation::orientation)
      .def_ro("rate", &RobotObservation::rate)
      .def_prop_ro("feet", &rows<RobotObservation, &RobotObservation::feet>, "[feet, 3], m.")
      .def_prop_ro("footholds", &rows<RobotObservation, &RobotObservation::footholds>)
      .def_ro("hands", &RobotObservation::hands)
      .def_ro("ground", &RobotObservation::ground);
}

void bind_controller(nb::module_& m) {
  nb::enum_<LegPhase>(m, "LegPhase", "What a foot is doing.")
      .value("STANCE", LegPhase::Stance)
      .value("SWING", LegPhase::Swing)
      .value("REACHING", LegPhase::Reaching);
  nb::class_<WholeBodyResult>(m, "WholeBodyResult", "See whole_body_controller.hpp.")
      .def_prop_ro("is_usable", [](const WholeBodyResult& r) { return !r.is_fallback; })
      .def_prop_ro("torques", [](const WholeBodyResult& r) { return Eigen::VectorXd(r.torques); })
      .def_prop_ro("forces", &rows<WholeBodyResult, &WholeBodyResult::forces>,
                   "[limbs, 3], world, N.")
      .def_prop_ro("moments", &rows<WholeBodyResult, &WholeBodyResult::moments>,
                   "[limbs, 3], world, N m.");
  nb::class_<RobotController>(m, "RobotController", "See robot_controller.hpp.")
      .def(
          "__init__",
          [](RobotController* self, const RobotDescription& robot, const Rows& hips,
             const RobotControlSettings& settings) {
            new (self) RobotController(robot, hips.transpose(), settings);
          },
          "robot"_a, "hips"_a, "settings"_a)
      .def(
          "update",
          [](RobotController& self, double time, double dt, const RobotState& measured,
             const Rows& forces, const RobotTarget& target) {
            self.update(time, dt, measured, forces.transpose(), target);
          },
          "time"_a, "dt"_a, "measured"_a, "forces"_a, "target"_a)
      .def_prop_ro("result", [](const RobotController& c) { return c.result(); })
      .def_prop_ro("slack",
                   [](const RobotController& c) { return Eigen::VectorXd(c.controller().slack()); })
      .def_prop_ro("model", &RobotController::model, nb::rv_policy::reference_internal)
      .def("change_gait", &RobotController::change_gait, "gait"_a, "time"_a, "at_once"_a = false,
           nb::sig("def change_gait(self, gait: object, time: float, "
                   "at_once: bool = False) -> float"))
      .def(
          "stands",
          [](const RobotController& c, int foot, double time) {
            return c.clock().stands(foot, time);
          },
          "foot"_a, "time"_a)
      .def(
          "stance",
          [](const RobotController& c, int foot, double time) {
            const planning::Stance stance = c.clock().stance(foot, time);
            return std::pair(stance.begin, stance.end);
          },
          "foot"_a, "time"_a)
      .def("phase", &RobotController::phase, "foot"_a)
      .def("observe", &RobotController::observe, "measured"_a);
}

}  // namespace

void bind_control(nb::module_& m) {
  bind_settings(m);
  bind_targets(m);
  bind_controller(m);
}

}  // namespace palanquin
