#include <nanobind/eigen/dense.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palanquin/control/estimation/held_body.hpp"
#include "palanquin/plant/robot_senses.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

void bind_sensors(nb::module_& m) {
  nb::class_<RobotSensorSettings>(m, "RobotSensorSettings", "See robot_sensors.hpp.")
      .def(nb::init<>())
      .def_rw("gyro", &RobotSensorSettings::gyro)
      .def_rw("gyro_bias", &RobotSensorSettings::gyro_bias)
      .def_rw("gyro_walk", &RobotSensorSettings::gyro_walk)
      .def_rw("accelerometer", &RobotSensorSettings::accelerometer)
      .def_rw("accelerometer_bias", &RobotSensorSettings::accelerometer_bias)
      .def_rw("accelerometer_walk", &RobotSensorSettings::accelerometer_walk)
      .def_rw("joint_position", &RobotSensorSettings::joint_position)
      .def_rw("joint_resolution", &RobotSensorSettings::joint_resolution)
      .def_rw("joint_velocity", &RobotSensorSettings::joint_velocity)
      .def_rw("place_rate", &RobotSensorSettings::place_rate)
      .def_rw("place_position", &RobotSensorSettings::place_position)
      .def_rw("place_heading", &RobotSensorSettings::place_heading)
      .def_rw("place_latency", &RobotSensorSettings::place_latency)
      .def_rw("seed", &RobotSensorSettings::seed)
      .def("explain_invalid", &RobotSensorSettings::explain_invalid);
}

void bind_estimators(nb::module_& m) {
  nb::class_<BaseEstimatorSettings>(m, "BaseEstimatorSettings", "See base_estimator.hpp.")
      .def(nb::init<>())
      .def_rw("gyro", &BaseEstimatorSettings::gyro)
      .def_rw("accelerometer", &BaseEstimatorSettings::accelerometer)
      .def_rw("gyro_walk", &BaseEstimatorSettings::gyro_walk)
      .def_rw("accelerometer_walk", &BaseEstimatorSettings::accelerometer_walk)
      .def_rw("stance", &BaseEstimatorSettings::stance)
      .def_rw("swing", &BaseEstimatorSettings::swing)
      .def_rw("start_position", &BaseEstimatorSettings::start_position)
      .def_rw("start_orientation", &BaseEstimatorSettings::start_orientation)
      .def_rw("start_velocity", &BaseEstimatorSettings::start_velocity)
      .def_rw("start_gyro_bias", &BaseEstimatorSettings::start_gyro_bias)
      .def_rw("start_accelerometer_bias", &BaseEstimatorSettings::start_accelerometer_bias)
      .def_rw("gravity", &BaseEstimatorSettings::gravity);
  nb::class_<RobotEstimatorSettings>(m, "RobotEstimatorSettings", "See robot_estimator.hpp.")
      .def(nb::init<>())
      .def_rw("base", &RobotEstimatorSettings::base)
      .def_rw("joint_position", &RobotEstimatorSettings::joint_position)
      .def_rw("leg", &RobotEstimatorSettings::leg)
      .def_rw("force_bandwidth", &RobotEstimatorSettings::force_bandwidth)
      .def("explain_invalid", &RobotEstimatorSettings::explain_invalid);
  nb::class_<EstimationSettings>(m, "EstimationSettings", "See robot_senses.hpp.")
      .def(nb::init<>())
      .def_rw("sensors", &EstimationSettings::sensors)
      .def_rw("estimator", &EstimationSettings::estimator)
      .def_rw("feels_feet", &EstimationSettings::feels_feet);
  nb::class_<EstimationErrors>(m, "EstimationErrors", "See robot_senses.hpp.")
      .def_ro("position", &EstimationErrors::position)
      .def_ro("largest_position", &EstimationErrors::largest_position)
      .def_ro("orientation", &EstimationErrors::orientation)
      .def_ro("largest_orientation", &EstimationErrors::largest_orientation)
      .def_ro("velocity", &EstimationErrors::velocity)
      .def_ro("largest_velocity", &EstimationErrors::largest_velocity);
}

void bind_held_body(nb::module_& m) {
  nb::class_<Grip>(m, "Grip", "A hand's frame in the body that it holds.")
      .def(
          "__init__",
          [](Grip* self, const Vector3& position, const Vector4& orientation) {
            new (self) Grip{position, orientation};
          },
          "position"_a, "orientation"_a);
  nb::class_<BodyMotion>(m, "BodyMotion", "See held_body.hpp.")
      .def_ro("position", &BodyMotion::position)
      .def_ro("orientation", &BodyMotion::orientation)
      .def_ro("velocity", &BodyMotion::velocity)
      .def_ro("rate", &BodyMotion::rate);
  nb::class_<HeldBody>(m, "HeldBody", "A body from the hands that hold it; see held_body.hpp.")
      .def(nb::init<std::vector<Grip>, double>(), "grips"_a, "arm"_a = 0.3)
      .def("update", &HeldBody::update, "hands"_a, nb::rv_policy::copy);
}

}  // namespace

void bind_estimation(nb::module_& m) {
  bind_sensors(m);
  bind_estimators(m);
  bind_held_body(m);
}

}  // namespace palanquin
