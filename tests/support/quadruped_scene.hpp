#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "palanquin/plant/team_simulation.hpp"
#include "support/simple_quadruped.hpp"

namespace palanquin::testing {

/// Simple quadrupeds side by side on a floor in MuJoCo, standing still: the model is written from
/// the description that their controllers have, so that both know the same robot.
class QuadrupedScene {
 public:
  static constexpr double kLane = 0.8;      ///< between neighbours, m
  static constexpr double kHeight = 0.299;  ///< of a trunk whose feet rest on the floor, m

  explicit QuadrupedScene(int robots = 1) {
    char error[500] = "";
    const std::unique_ptr<mjSpec, decltype(&mj_deleteSpec)> spec(
        mj_parseXMLString(text(robots).c_str(), nullptr, error, sizeof error), mj_deleteSpec);
    if (!spec) throw std::runtime_error(error);
    model.reset(mj_compile(spec.get(), nullptr));
    if (!model) throw std::runtime_error(mjs_getError(spec.get()));
    data.reset(mj_makeData(model.get()));
    stand(robots);
  }

  /// The robots with the settings that `control` has.
  std::vector<TeamMember> members(const RobotControlSettings& control = {}) const {
    std::vector<TeamMember> all;
    for (int robot = 0; robot * 13 + 1 < model->nbody; ++robot) {
      TeamMember& member = all.emplace_back();
      member.name = "robot" + std::to_string(robot);
      member.robot = simple_quadruped();
      member.hips = simple_hips();
      member.control = control;
      member.trunk = id(mjOBJ_BODY, member.name + "/trunk");
      for (const BodyDescription& body : member.robot.bodies) {
        if (body.axis.isZero()) continue;
        member.joints.push_back(id(mjOBJ_JOINT, member.name + "/" + body.name));
        member.motors.push_back(id(mjOBJ_ACTUATOR, member.name + "/" + body.name));
      }
      for (const LimbDescription& limb : member.robot.limbs)
        member.foot_geoms.push_back(id(mjOBJ_GEOM, member.name + "/" + limb.name + " foot"));
    }
    return all;
  }

  int id(mjtObj type, const std::string& name) const {
    return mj_name2id(model.get(), type, name.c_str());
  }

  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, mj_deleteData};

 private:
  static std::string text(int robots) {
    std::ostringstream xml;
    xml << "<mujoco><compiler angle='radian'/>"
           "<option timestep='0.001' integrator='implicitfast' cone='elliptic' impratio='10'>"
           "<flag autoreset='disable'/></option>"
           "<default><geom solref='0.005 1' friction='0.8' contype='0' conaffinity='1'/></default>"
           "<worldbody><geom name='floor' type='plane' size='9 9 1' contype='1'/>";
    for (int robot = 0; robot < robots; ++robot) write_robot(xml, robot);
    xml << "</worldbody><actuator>";
    for (int robot = 0; robot < robots; ++robot)
      for (const BodyDescription& body : simple_quadruped().bodies)
        if (!body.axis.isZero())
          xml << "<motor name='robot" << robot << '/' << body.name << "' joint='robot" << robot
              << '/' << body.name << "'/>";
    xml << "</actuator></mujoco>";
    return xml.str();
  }

  static void write_robot(std::ostream& xml, int robot) {
    const RobotDescription description = simple_quadruped();
    const std::string prefix = "robot" + std::to_string(robot) + "/";
    std::vector<int> open;  // from the trunk to the body that was written last
    for (std::size_t i = 0; i < description.bodies.size(); ++i) {
      const BodyDescription& body = description.bodies[i];
      for (; !open.empty() && open.back() != body.parent; open.pop_back()) xml << "</body>";
      const Vector3 inertia = body.inertia.diagonal();
      xml << "<body name='" << prefix << body.name << "' pos='" << body.position.transpose()
          << "'><inertial pos='" << body.com.transpose() << "' mass='" << body.mass
          << "' diaginertia='" << inertia.transpose() << "'/>";
      if (body.axis.isZero())
        xml << "<freejoint/><site name='" << prefix << "back'/>"
            << "<geom type='box' size='0.2 0.08 0.05' mass='0'/>";
      else
        xml << "<joint name='" << prefix << body.name << "' axis='" << body.axis.transpose()
            << "' armature='" << body.armature << "' damping='" << body.damping << "'/>";
      for (const LimbDescription& limb : description.limbs)
        if (limb.body == static_cast<int>(i))
          xml << "<geom name='" << prefix << limb.name << " foot' type='sphere' size='"
              << limb.radius << "' mass='0' pos='" << limb.position.transpose() << "'/>";
      open.push_back(static_cast<int>(i));
    }
    for (; !open.empty(); open.pop_back()) xml << "</body>";
  }

  void stand(int robots) {
    const RobotState state = standing_state();
    double* q = data->qpos;
    for (int robot = 0; robot < robots; ++robot, q += 19) {
      Eigen::Map<Eigen::VectorXd>(q, 19) << 0, -kLane * robot, kHeight, 1, 0, 0, 0,
          state.joint_positions;
    }
  }
};

}  // namespace palanquin::testing
