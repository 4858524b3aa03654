#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "bindings.hpp"
#include "palanquin/control/whole_body/robot_model.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// A vector whose size may change: handed out as a copy, since a view would dangle after the next
/// assignment, and read-only, since a change of the copy would be lost.
template <Eigen::VectorXd RobotState::* vector>
nb::ndarray<nb::numpy, const double, nb::ndim<1>> values(const RobotState& state) {
  auto copy = std::make_unique<Eigen::VectorXd>(state.*vector);
  const auto size = static_cast<std::size_t>(copy->size());
  const double* data = copy->data();
  const nb::capsule owner(copy.release(),
                          [](void* p) noexcept { delete static_cast<Eigen::VectorXd*>(p); });
  return {data, {size}, owner};
}
template <Eigen::VectorXd RobotState::* vector>
void set_values(RobotState& state, const Eigen::VectorXd& all) {
  state.*vector = all;
}

}  // namespace

void bind_robot(nb::module_& m) {
  nb::class_<BodyDescription>(m, "BodyDescription", "A link; see robot_description.hpp.")
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
  nb::enum_<LimbKind>(m, "LimbKind", "What a limb does.")
      .value("FOOT", LimbKind::Foot)
      .value("HAND", LimbKind::Hand);
  nb::class_<LimbDescription>(m, "LimbDescription", "Where a robot touches the world.")
      .def(nb::init<>())
      .def_rw("name", &LimbDescription::name)
      .def_rw("kind", &LimbDescription::kind)
      .def_rw("body", &LimbDescription::body)
      .def_rw("position", &LimbDescription::position)
      .def_rw("radius", &LimbDescription::radius);
  nb::class_<RobotDescription>(m, "RobotDescription", "A floating-base robot.")
      .def(nb::init<std::vector<BodyDescription>, std::vector<LimbDescription>>(), "bodies"_a,
           "limbs"_a)
      .def(
          "bodies", [](const RobotDescription& robot) { return robot.bodies; }, "Copies.")
      .def(
          "limbs", [](const RobotDescription& robot) { return robot.limbs; }, "Copies.")
      .def("explain_invalid", &RobotDescription::explain_invalid);
  nb::class_<RobotState>(m, "RobotState", "What is measured of a robot; see robot_state.hpp.")
      .def(nb::init<>())
      .def_rw("base_position", &RobotState::base_position)
      .def_rw("base_orientation", &RobotState::base_orientation)
      .def_prop_rw("joint_positions", &values<&RobotState::joint_positions>,
                   &set_values<&RobotState::joint_positions>,
                   nb::for_getter(nb::rv_policy::automatic), "[n], rad; a copy.")
      .def_rw("base_velocity", &RobotState::base_velocity)
      .def_rw("base_rate", &RobotState::base_rate)
      .def_prop_rw("joint_velocities", &values<&RobotState::joint_velocities>,
                   &set_values<&RobotState::joint_velocities>,
                   nb::for_getter(nb::rv_policy::automatic), "[n], rad/s; a copy.");
  nb::class_<PointKinematics>(m, "PointKinematics", "p'' = J v' + drift, world axes.")
      .def_ro("position", &PointKinematics::position)
      .def_ro("velocity", &PointKinematics::velocity)
      .def_ro("drift", &PointKinematics::drift)
      .def_prop_ro("jacobian",
                   [](const PointKinematics& p) { return Eigen::MatrixXd(p.jacobian); });
  nb::class_<LimbKinematics, PointKinematics>(m, "LimbKinematics",
                                              "omega' = J_w v' + drift_w, world axes.")
      .def_ro("rotation", &LimbKinematics::rotation)
      .def_ro("rate", &LimbKinematics::rate)
      .def_ro("angular_drift", &LimbKinematics::angular_drift)
      .def_prop_ro("angular_jacobian",
                   [](const LimbKinematics& l) { return Eigen::MatrixXd(l.angular_jacobian); });
  nb::class_<RobotModel>(m, "RobotModel", "Kinematics and dynamics; see robot_model.hpp.")
      .def(nb::init<const RobotDescription&>(), "description"_a)
      .def("update", &RobotModel::update, "state"_a)
      .def_prop_ro("mass", &RobotModel::mass)
      .def_prop_ro("velocity", &RobotModel::velocity)
      .def_prop_ro("mass_matrix", &RobotModel::mass_matrix)
      .def_prop_ro("bias", &RobotModel::bias)
      .def_prop_ro("com", &RobotModel::com)
      .def("limb", &RobotModel::limb, "index"_a, nb::rv_policy::reference_internal);
}

}  // namespace palanquin
