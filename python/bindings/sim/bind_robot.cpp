#include <nanobind/eigen/dense.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palanquin/sim/robot_model.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

void bind_robot(nb::module_& m) {
  nb::class_<BodyDescription>(m, "BodyDescription", "A link; see robot_model.hpp.")
      .def(nb::init<>())
      .def_rw("name", &BodyDescription::name)
      .def_rw("parent", &BodyDescription::parent)
      .def_rw("position", &BodyDescription::position)
      .def_rw("orientation", &BodyDescription::orientation)
      .def_rw("axis", &BodyDescription::axis)
      .def_rw("mass", &BodyDescription::mass)
      .def_rw("com", &BodyDescription::com)
      .def_rw("inertia", &BodyDescription::inertia)
      .def_rw("armature", &BodyDescription::armature)
      .def_rw("damping", &BodyDescription::damping)
      .def_rw("effort", &BodyDescription::effort);
  nb::class_<PointDescription>(m, "PointDescription", "A point on a body.")
      .def(nb::init<>())
      .def_rw("name", &PointDescription::name)
      .def_rw("body", &PointDescription::body)
      .def_rw("position", &PointDescription::position);
  nb::class_<RobotDescription>(m, "RobotDescription", "A floating-base robot.")
      .def(nb::init<>())
      .def_rw("bodies", &RobotDescription::bodies)
      .def_rw("points", &RobotDescription::points)
      .def("explain_invalid", &RobotDescription::explain_invalid);
  nb::class_<RobotState>(m, "RobotState", "What is measured of a robot; see robot_model.hpp.")
      .def(nb::init<>())
      .def_rw("base_position", &RobotState::base_position)
      .def_rw("base_orientation", &RobotState::base_orientation)
      .def_rw("joint_positions", &RobotState::joint_positions)
      .def_rw("base_velocity", &RobotState::base_velocity)
      .def_rw("base_rate", &RobotState::base_rate)
      .def_rw("joint_velocities", &RobotState::joint_velocities);
  nb::class_<PointKinematics>(m, "PointKinematics", "p'' = J v' + drift, world axes.")
      .def_ro("position", &PointKinematics::position)
      .def_ro("velocity", &PointKinematics::velocity)
      .def_ro("drift", &PointKinematics::drift)
      .def_prop_ro("jacobian",
                   [](const PointKinematics& p) { return Eigen::MatrixXd(p.jacobian); });
  nb::class_<RobotModel>(m, "RobotModel", "Kinematics and dynamics; see robot_model.hpp.")
      .def(nb::init<const RobotDescription&>(), "description"_a)
      .def("update", &RobotModel::update, "state"_a)
      .def_prop_ro("mass", &RobotModel::mass)
      .def_prop_ro("velocity", &RobotModel::velocity)
      .def_prop_ro("mass_matrix", &RobotModel::mass_matrix)
      .def_prop_ro("bias", &RobotModel::bias)
      .def_prop_ro("com", &RobotModel::com)
      .def("point", &RobotModel::point, "index"_a, nb::rv_policy::reference_internal);
}

}  // namespace palanquin
