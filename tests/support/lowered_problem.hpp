#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/trajectory.hpp"
#include "palanquin/core/transcription/exact_hessian.hpp"

namespace palanquin::testing {

/// A problem of tests/support/small_problems with the arguments of its solve, as
/// lower_small_problems.py left them in $PALANQUIN_LOWERED_PROBLEMS (ctest sets it).
struct LoweredCase {
  std::shared_ptr<const LoweredProblem> problem;
  std::shared_ptr<const ExactHessian> exact;
  RowMatrix parameters;      ///< [N + 1, np]
  Eigen::VectorXd measured;  ///< [nz]
  RowMatrix guess;           ///< [N + 1, nz]
  int horizon() const { return static_cast<int>(guess.rows()) - 1; }

  LoweredCase(const std::string& folder, const std::string& name)
      : problem(std::make_shared<LoweredProblem>(folder + "/" + name)),
        exact(std::make_shared<ExactHessian>(folder + "/" + name + "-exact.so")) {
    std::ifstream file(folder + "/" + name + ".txt");
    parameters = read(file);
    measured = read(file).row(0);
    guess = read(file);
    if (!file) throw std::runtime_error("cannot read the inputs of " + name);
  }

 private:
  static RowMatrix read(std::ifstream& file) {
    Eigen::Index rows = 0, cols = 0;
    file >> rows >> cols;
    RowMatrix m(rows, cols);
    for (Eigen::Index i = 0; i < m.size(); ++i) file >> m.data()[i];
    return m;
  }
};

/// A test on lowered problems; skipped by hand-started programs that know of none.
class OnLoweredProblems : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("PALANQUIN_LOWERED_PROBLEMS");
    if (folder == nullptr)
      GTEST_SKIP() << "PALANQUIN_LOWERED_PROBLEMS is not set; run this by ctest";
    folder_ = folder;
  }
  LoweredCase load(const std::string& name) const { return LoweredCase(folder_, name); }

 private:
  std::string folder_;
};

}  // namespace palanquin::testing
