#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "palanquin/control/planning/planner_file.hpp"

namespace palanquin::testing {

/// A test on planners as lower_planners.py left them in $PALANQUIN_LOWERED_PROBLEMS (ctest sets
/// it); skipped by hand-started programs that know of none.
class OnSavedPlanners : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("PALANQUIN_LOWERED_PROBLEMS");
    if (folder == nullptr)
      GTEST_SKIP() << "PALANQUIN_LOWERED_PROBLEMS is not set; run this by ctest";
    folder_ = folder;
  }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::unique_ptr<planning::TeamPlanner> load(const std::string& name) const {
    return planning::load_planner(path(name));
  }

 private:
  std::string folder_;
};

}  // namespace palanquin::testing
