#include <stdexcept>

#include "palanquin/control/planning/bar_planner_file.hpp"
#include "palanquin/control/planning/centralized_planner.hpp"
#include "palanquin/control/planning/distributed_planner.hpp"
#include "palanquin/control/planning/planner_text.hpp"
#include "palanquin/control/planning/sqp_settings_text.hpp"

namespace palanquin::planning {

namespace {

/// What a planner's file states, while it is read.
class BarPlannerReader {
 public:
  explicit BarPlannerReader(std::string folder) : folder_(std::move(folder)) {}

  void read(TextLine& line) {
    const std::string key = line.word();
    if ((version_ == 0) != (key == "bar_planner"))
      throw std::runtime_error("'bar_planner VERSION' must be the first line");
    if (key == "bar_planner") {
      version_ = line.integer(0);
      if (version_ != 1) throw std::runtime_error("this version reads files of version 1");
    } else if (key == "kind") {
      is_distributed_ = line.choice({"centralized", "distributed"}) == 1;
      settings_.dt = line.number();
    } else if (key == "exchange") {
      settings_.dual_terms = line.integer(0) != 0;
      settings_.exchanges = line.integer(1);
    } else if (key == "link") {
      const int sender = line.integer(0), receiver = line.integer(0);
      links_[{sender, receiver}] = read_link(line);
    } else if (key == "leash") {
      leash_.shape = static_cast<Leash::Shape>(line.choice({"circle", "square"}));
      leash_.length = line.number();
    } else if (key == "robot") {
      team_.masses.push_back(line.number());
    } else if (key == "bar") {
      team_.bars.push_back(read_bar(line));
    } else if (key == "setting") {
      read_setting(line, sqp_);
    } else if (key == "problem") {
      read_problem(line);
    } else if (key == "parameter") {
      if (problems_.empty()) throw std::runtime_error("no problem is stated before");
      read_parameter(line, problems_.back()->problem(), problems_.back()->parameters);
    } else {
      throw std::runtime_error("'" + key + "' is unknown");
    }
  }

  std::unique_ptr<BarPlanner> build() {
    if (team_.masses.empty()) throw std::runtime_error("it states no robot");
    const std::size_t needed = is_distributed_ ? team_.masses.size() : 1;
    if (problems_.size() != needed)
      throw std::runtime_error("it states " + std::to_string(problems_.size()) + " problems; " +
                               std::to_string(needed) + " are needed");
    for (const auto& mpc : problems_)
      if (mpc->horizon() != problems_.front()->horizon())
        throw std::runtime_error("its problems have several horizons");
    std::shared_ptr<LayeredPlanner> planner;
    if (is_distributed_)
      planner = std::make_shared<DistributedPlanner>(team_, settings_, problems_, links_);
    else
      planner = std::make_shared<CentralizedPlanner>(team_, settings_, problems_.front());
    return std::make_unique<BarPlanner>(planner, leash_);
  }

 private:
  static LinkSettings read_link(TextLine& line) {
    LinkSettings link;
    link.delay = line.integer(1);
    link.loss = line.number();
    link.bias = line.number();
    link.bias_from = line.integer(0);
    link.seed = static_cast<unsigned>(line.integer(0));
    return link;
  }

  Bar read_bar(TextLine& line) const {
    Bar bar;
    for (int& robot : bar.robots) {
      robot = line.integer(0);
      if (robot >= team_.robots())
        throw std::runtime_error("there is no robot " + std::to_string(robot) + " before it");
    }
    bar.rows = line.integer(1);
    return bar;
  }

  void read_problem(TextLine& line) {
    const auto problem = std::make_shared<const LoweredProblem>(folder_ + '/' + line.word());
    const int horizon = line.integer(1);
    problems_.push_back(std::make_shared<LinearMpc>(problem, default_parameters(*problem, horizon),
                                                    std::make_shared<Sqp>(problem, horizon, sqp_)));
  }

  std::string folder_;
  int version_ = 0;
  bool is_distributed_ = false;
  LayeredSettings settings_;
  Leash leash_;
  BarTeam team_;
  DistributedPlanner::Links links_;
  SqpSettings sqp_;
  std::vector<std::shared_ptr<LinearMpc>> problems_;
};

}  // namespace

std::unique_ptr<BarPlanner> load_bar_planner(const std::string& folder) {
  BarPlannerReader reader(folder);
  read_planner_text(folder, [&](TextLine& line) { reader.read(line); });
  try {
    return reader.build();
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + folder + "/planner': " + error.what());
  }
}

}  // namespace palanquin::planning
