// Planners of robots on bars: from folders and back, references on a leash, plans that bear.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "palanquin/control/planning/bar_planner_file.hpp"
#include "support/saved_planner.hpp"

namespace palanquin::planning {
namespace {

namespace fs = std::filesystem;

/// Two robots that stand side by side, 1 m apart, in a quick trot's first phase.
BarMeasurement standing() {
  BarMeasurement seen{
      0.0, RowMatrix::Zero(2, 13), RowMatrix::Zero(8, 3), {}, Eigen::Vector2d(0, 0)};
  for (int i = 0; i < 2; ++i) {
    seen.bodies.row(i).head<4>() << 0.0, 0.5 - i, kBarStandingHeight, 1.0;
    for (int f = 0; f < kFeet; ++f)
      seen.feet.row(kFeet * i + f) << (f < 2 ? 0.18 : -0.18), 0.5 - i + (f % 2 == 0 ? 0.13 : -0.13),
          0.0;
  }
  seen.footholds = seen.feet;
  return seen;
}

Flags trot(const BarPlanner& planner) {
  Flags contacts(planner.planner().horizon() + 1, 8);
  for (int i = 0; i < 8; ++i) contacts.col(i).setConstant(i % kFeet == 0 || i % kFeet == 3);
  return contacts;
}

class SavedBarPlanners : public palanquin::testing::OnSavedPlanners {
 protected:
  static std::string text_of(const std::string& folder) {
    std::stringstream text;
    text << std::ifstream(folder + "/planner").rdbuf();
    return text.str();
  }
  /// A copy of a saved planner whose file is `text`.
  std::string copy_with(const std::string& name, const std::string& text) const {
    const std::string folder = ::testing::TempDir() + "/bar-planner-copy";
    fs::remove_all(folder);
    fs::copy(path(name), folder, fs::copy_options::recursive);
    std::ofstream(folder + "/planner") << text;
    return folder;
  }
};

TEST_F(SavedBarPlanners, AreTheSameAgain) {
  for (const std::string name : {"bar-centralized", "bar-distributed"}) {
    const auto planner = load_bar_planner(path(name));
    std::vector<std::string> problems;
    for (std::size_t i = 1; i <= planner->planner().problems().size(); ++i)
      problems.push_back("problem" + std::to_string(i));
    const std::string folder = copy_with(name, "");
    save_bar_planner(*planner, problems, folder);
    EXPECT_EQ(text_of(folder), text_of(path(name)));
  }
}

TEST_F(SavedBarPlanners, PlanWhatBearsTheRobots) {
  for (const std::string name : {"bar-centralized", "bar-distributed"}) {
    const auto planner = load_bar_planner(path(name));
    BarMeasurement seen = standing();
    for (int tick = 0; tick < 5; ++tick) {
      seen.time = 0.005 * tick;
      const BarPlan& plan = planner->plan(seen, trot(*planner), {{0.3, 0.0, 0.0}, {0.3, 0.0, 0.1}});
      EXPECT_TRUE(plan.mpc.is_usable) << plan.mpc.event;
      EXPECT_TRUE(plan.events.empty());
      EXPECT_LT(plan.friction_violation(0.6), 1e-6);
      double load = 0.0;
      for (int i = 0; i < 8; ++i) {
        const double bears = point(plan.mpc.inputs, 0, i).z();
        EXPECT_TRUE(plan.contacts(0, i) || bears == 0.0);
        load += bears;
      }
      EXPECT_GT(load, 9.81 * 10 * 2);
      EXPECT_TRUE(plan.bodies.row(0).head<13>().isApprox(seen.bodies.row(0), 1e-9));
    }
    EXPECT_NEAR(planner->references()[0].position.x(), 0.3 * 0.02, 1e-12);
    EXPECT_NEAR(planner->references()[1].yaw, 0.1 * 0.02, 1e-12);
  }
}

TEST_F(SavedBarPlanners, RefuseWhatTheyCannotPlanFrom) {
  const auto planner = load_bar_planner(path("bar-centralized"));
  const BarMeasurement seen = standing();
  const std::vector<Velocity> still(2);
  EXPECT_THROW(planner->plan(seen, trot(*planner), {{}}), std::invalid_argument);
  EXPECT_THROW(planner->plan(seen, trot(*planner).leftCols(4), still), std::invalid_argument);
  BarMeasurement broken = seen;
  broken.bodies(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(planner->plan(broken, trot(*planner), still), std::invalid_argument);
  planner->plan(seen, trot(*planner), still);
  broken = seen;
  broken.time = -1.0;
  EXPECT_THROW(planner->plan(broken, trot(*planner), still), std::invalid_argument);
}

TEST_F(SavedBarPlanners, DamagedFilesAreRefusedByLine) {
  const auto damaged = [&](const std::string& name, const std::string& good,
                           const std::string& bad) {
    std::string changed = text_of(path(name));
    changed.replace(changed.find(good), good.size(), bad);
    try {
      load_bar_planner(copy_with(name, changed));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("nothing was refused");
  };
  const auto refuses = [&](const char* name, const char* good, const char* bad, const char* why) {
    EXPECT_NE(damaged(name, good, bad).find(why), std::string::npos) << damaged(name, good, bad);
  };
  refuses("bar-centralized", "bar_planner 1", "bar_planner 9", "version 1");
  refuses("bar-centralized", "bar_planner 1", "planner 1", "must be the first line");
  refuses("bar-centralized", "leash circle", "leash star", "one of circle");
  refuses("bar-centralized", "bar 0 1", "bar 0 7", "no robot 7");
  refuses("bar-centralized", "bar 0 1 1", "bar 0 1 3", "bar1.lambda");
  refuses("bar-centralized", "kind centralized", "kind distributed", "2 are needed");
  refuses("bar-centralized", "parameter robot1.", "parameter nobody.", "no parameter 'nobody.");
  refuses("bar-distributed", "link 0 1", "link 0 5", "no bar joins robots 0 and 5");
  refuses("bar-distributed", "problem2", "problem7", "problem7");
  EXPECT_THROW(load_bar_planner("/nowhere"), std::runtime_error);
}

TEST(Leash, HoldsReferencesNearTheirRobots) {
  RowMatrix bodies = standing().bodies;
  const ConstBodyState body(bodies, 0, 0);
  const Leash circle{Leash::Shape::Circle, 0.15}, square{Leash::Shape::Square, 0.05};
  BarReference reference = reference_at(body);
  for (int i = 0; i < 100; ++i) reference.advance({1.0, 1.0, 2.0}, body, 0.1, circle, 0.01);
  EXPECT_NEAR((reference.position - body.position).head<2>().norm(), 0.15, 1e-9);
  EXPECT_NEAR(reference.position.z(), 0.1 + kBarStandingHeight, 1e-12);
  EXPECT_NEAR(reference.yaw, kYawLeash, 1e-12);
  EXPECT_TRUE(square.hold({0.2, -0.01}).isApprox(Vector2(0.05, -0.01)));
  EXPECT_TRUE(circle.hold({0.03, 0.04}).isApprox(Vector2(0.03, 0.04)));
}

}  // namespace
}  // namespace palanquin::planning
