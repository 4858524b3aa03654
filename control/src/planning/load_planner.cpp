#include <stdexcept>

#include "palanquin/control/planning/planner_file.hpp"
#include "palanquin/control/planning/planner_text.hpp"
#include "palanquin/control/planning/sqp_settings_text.hpp"
#include "palanquin/control/planning/terrain_file.hpp"

namespace palanquin::planning {

namespace {

/// What a planner's file states, while it is read.
class PlannerReader {
 public:
  PlannerReader(std::string folder, std::shared_ptr<const LoweredProblem> problem)
      : folder_(std::move(folder)), problem_(std::move(problem)) {}

  void read(TextLine& line) {
    const std::string key = line.word();
    if ((horizon_ == 0 && version_ == 0) != (key == "planner"))
      throw std::runtime_error("'planner VERSION' must be the first line");
    if (key == "planner") {
      version_ = line.integer(0);
      if (version_ != 1) throw std::runtime_error("this version reads files of version 1");
    } else if (key == "horizon") {
      horizon_ = line.integer(1);
      parameters_ = default_parameters(*problem_, horizon_);
    } else if (key == "rules") {
      read_rules(line);
    } else if (key == "observers") {
      for (ObserverGains* g : {&rules_.observers.robots, &rules_.observers.payload})
        for (double* value : {&g->force, &g->most_force, &g->torque, &g->most_torque})
          *value = line.number();
    } else if (key == "payload") {
      payload_ = {line.number(), line.number()};
    } else if (key == "feet_below") {
      feet_below_ = static_cast<FeetBelow>(line.choice({"hips", "load"}));
    } else if (key == "robot" || key == "grasp" || key == "hips" || key == "gait") {
      read_robot(key, line);
    } else if (key == "trend" || key == "terrain") {
      (key == "trend" ? trend_ : terrain_) = read_terrain(line, trend_, folder_);
    } else if (key == "ditch") {
      for (int i = 0; i < 4; ++i) ditches_.push_back(line.number());
    } else if (key == "setting") {
      read_setting(line, sqp_);
    } else if (key == "policy") {
      read_policy(line);
    } else if (key == "parameter") {
      read_parameter(line, *problem_, parameters_);
    } else {
      throw std::runtime_error("'" + key + "' is unknown");
    }
  }

  std::unique_ptr<TeamPlanner> build() {
    if (horizon_ == 0) throw std::runtime_error("it states no horizon");
    if (terrain_ == nullptr) throw std::runtime_error("it states no terrain");
    std::vector<std::shared_ptr<Sqp>> solvers;
    for (int i = 0; i < candidates_; ++i) {
      solvers.push_back(std::make_shared<Sqp>(problem_, horizon_, sqp_));
      for (const auto& [family, policy] : policies_) solvers.back()->set_policy(family, policy);
    }
    auto planner =
        std::make_unique<TeamPlanner>(problem_, Team(payload_, std::move(carriers_), feet_below_),
                                      terrain_, rules_, parameters_, solvers);
    const auto count = static_cast<Eigen::Index>(ditches_.size() / 4);
    planner->set_ditches(Eigen::Map<const RowMatrix>(ditches_.data(), count, 4));
    return planner;
  }

 private:
  void read_rules(TextLine& line) {
    rules_.footholds = static_cast<FootholdRule>(line.choice({"hips", "raibert"}));
    rules_.references = static_cast<RobotReferences>(line.choice({"rigid", "ground"}));
    rules_.restart_after = line.integer(1);
    candidates_ = line.integer(1);
    rules_.threads = line.integer(1);
  }

  static Vector3 vector(TextLine& line) {
    Vector3 v;
    for (double& x : v) x = line.number();
    return v;
  }

  void read_robot(const std::string& key, TextLine& line) {
    if (key == "robot") {
      Carrier& carrier = carriers_.emplace_back();
      carrier.name = line.word();
      carrier.mass = line.number();
      carrier.standing_height = line.number();
      carrier.yaw = line.number();
      return;
    }
    if (carriers_.empty()) throw std::runtime_error("no robot is stated before");
    Carrier& carrier = carriers_.back();
    if (key == "grasp") {
      carrier.attach = vector(line);
      carrier.hand = vector(line);
    } else if (key == "hips") {
      for (Vector3& hip : carrier.hips) hip = vector(line);
    } else {
      carrier.gait.name = line.word();
      carrier.gait.period = line.number();
      for (auto* numbers : {&carrier.gait.duty, &carrier.gait.offset}) {
        numbers->resize(kFeet);
        for (double& number : *numbers) number = line.number();
      }
      if (!(carrier.gait.period > 0.0)) throw std::runtime_error("its period must be positive");
    }
  }

  void read_policy(TextLine& line) {
    const std::string family = line.word();
    const int kind = line.choice({"hard", "c2_penalty", "squared_hinge", "relaxed_barrier"});
    const double stiffness = line.number();
    policies_[family] = {static_cast<PolicyKind>(kind), stiffness, line.number()};
  }

  std::string folder_;
  std::shared_ptr<const LoweredProblem> problem_;
  int version_ = 0, horizon_ = 0, candidates_ = 1;
  PlannerSettings rules_;
  Payload payload_;
  FeetBelow feet_below_ = FeetBelow::Hips;
  std::vector<Carrier> carriers_;
  std::shared_ptr<const Terrain> trend_, terrain_;
  std::vector<double> ditches_;
  SqpSettings sqp_;
  std::map<std::string, Policy> policies_;
  RowMatrix parameters_;
};

}  // namespace

std::unique_ptr<TeamPlanner> load_planner(const std::string& folder) {
  PlannerReader reader(folder, std::make_shared<const LoweredProblem>(folder));
  read_planner_text(folder, [&](TextLine& line) { reader.read(line); });
  try {
    return reader.build();
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + folder + "/planner': " + error.what());
  }
}

}  // namespace palanquin::planning
