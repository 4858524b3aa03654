// Observers of unknown wrenches: what they find, how fast, how much of it they believe.
#include "palanquin/control/planning/wrench_observer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "nominal_loop.hpp"
#include "support/saved_planner.hpp"

namespace palanquin::planning {
namespace {

using State = std::array<double, kState>;
constexpr double kTick = 0.01;
const Inertial kBody{20.0, {0.5, 1.0, 2.0}};

State at_rest() { return {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0}; }

/// What remains of a plan's ignorance moves the body within a tick.
void push(WrenchObserver& observer, int body, const Vector3& force, const Vector3& torque,
          int ticks) {
  for (int n = 0; n < ticks; ++n) {
    State measured = at_rest(), planned = at_rest();
    const Eigen::RowVectorXd known = observer.wrenches().row(body);
    const Vector3 faster = kTick / kBody.mass * (force - known.head<3>().transpose());
    const Vector3 spin =
        kTick * (torque - known.tail<3>().transpose()).cwiseQuotient(kBody.moments);
    std::copy_n(faster.data(), 3, &measured[7]);
    std::copy_n(spin.data(), 3, &measured[10]);
    observer.observe(body, measured.data(), planned.data(), kBody);
  }
}

TEST(WrenchObserver, FollowsWithItsTimeConstant) {
  WrenchObserver observer(1, {{10.0, 100.0, 5.0, 10.0}, {3.0, 100.0, 0.0, 0.0}});
  const Vector3 force(20.0, -30.0, 5.0), torque(2.0, 0.0, -3.0);
  push(observer, 1, force, torque, 10);  // one time constant of the force
  const Eigen::RowVectorXd found = observer.wrenches().row(1);
  EXPECT_NEAR(found.head<3>().norm(), (1.0 - std::pow(0.9, 10)) * force.norm(), 1e-9);
  EXPECT_NEAR(found.tail<3>().norm(), (1.0 - std::pow(0.95, 10)) * torque.norm(), 1e-9);
  EXPECT_TRUE(observer.wrenches().row(0).isZero());
  push(observer, 0, force, torque, 300);
  EXPECT_NEAR((observer.wrenches().row(0).head<3>().transpose() - force).norm(), 0.0, 0.01);
  EXPECT_TRUE(observer.wrenches().row(0).tail<3>().isZero());  // no gain
  observer.reset();
  EXPECT_TRUE(observer.wrenches().isZero());
}

TEST(WrenchObserver, BelievesSoMuchAndForgetsAtOnce) {
  WrenchObserver observer(1, {{10.0, 50.0, 10.0, 3.0}, {}});
  push(observer, 1, {300.0, 400.0, 0.0}, {0.0, 9.0, 0.0}, 200);
  const Eigen::RowVectorXd found = observer.wrenches().row(1);
  EXPECT_NEAR((found.head<3>().transpose() - Vector3(30.0, 40.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((found.tail<3>().transpose() - Vector3(0.0, 3.0, 0.0)).norm(), 0.0, 1e-9);
  push(observer, 1, Vector3::Zero(), Vector3::Zero(), 30);  // three time constants: no windup
  EXPECT_LT(observer.wrenches().row(1).norm(), 3.0);
}

TEST(WrenchObserver, TorquesAreOfTheWorld) {
  WrenchObserver observer(1, {{0.0, 0.0, 1.0, 10.0}, {}});
  State measured = at_rest();
  const double half = std::sqrt(0.5);
  measured[3] = half;
  measured[6] = half;  // a quarter turn about z: the body's x is the world's y
  measured[10] = 1.0;
  observer.observe(1, measured.data(), at_rest().data(), kBody);
  const Vector3 torque = observer.wrenches().row(1).tail<3>();
  EXPECT_NEAR((torque - Vector3(0.0, kBody.moments.x(), 0.0)).norm(), 0.0, 1e-12);
}

TEST(WrenchObserver, RefusesNegativeGains) {
  EXPECT_THROW(WrenchObserver(1, {{-1.0, 0.0, 0.0, 0.0}, {}}), std::invalid_argument);
  ObserverSettings settings;
  settings.payload.most_torque = std::nan("");
  EXPECT_NE(settings.explain_invalid().find("observers.payload.most_torque"), std::string::npos);
}

TEST(WrenchObserver, AMassIsAForceOfGravity) {
  EXPECT_NEAR(apparent_mass(16.0, {5.0, 0.0, -4.0 * 9.81}), 20.0, 1e-12);
}

using ObservingPlanner = palanquin::testing::OnSavedPlanners;

/// The planner stands for so many ticks while the payload weighs `more` kg than it was told, and
/// robot 0 is pushed by `force`: velocities that its model would not have.
void stand(TeamPlanner& planner, NominalLoop& loop, double more, const Vector3& force, int ticks) {
  for (int n = 0; n < ticks; ++n) {
    planner.solve(loop.time(), loop.state(), {});
    ASSERT_TRUE(planner.has_usable_plan());
    RowMatrix wrenches = -planner.observed_wrenches();
    wrenches.row(0).head<3>() += more * kGravity.transpose();
    wrenches.row(1).head<3>() += force.transpose();
    loop.advance(kTick, wrenches);
  }
}

TEST_F(ObservingPlanner, FindsAPayloadsMassAndAPush) {
  const auto planner = load("planner-observing");
  for (int r = 0; r < planner->team().robots(); ++r)
    planner->clock(r).change(Gait{"stand", 0.5, {1, 1, 1, 1}, {}}, 0.0, true);
  NominalLoop loop(*planner);
  planner->settle(0.0, loop.state(), {});
  const double height = loop.state().bodies(0, 2);
  stand(*planner, loop, 4.0, {0.0, 30.0, 0.0}, 200);
  EXPECT_NEAR(planner->apparent_payload_mass(), planner->payload_mass() + 4.0, 0.1);
  EXPECT_NEAR(planner->observed_wrenches()(1, 1), 30.0, 1.0);
  EXPECT_NEAR(loop.state().bodies(0, 2), height, 1e-3);
  planner->restart();
  EXPECT_TRUE(planner->observed_wrenches().isZero());
}

TEST_F(ObservingPlanner, SeesNothingWhereThePlanComesTrue) {
  const auto planner = load("planner-observing");
  NominalLoop loop(*planner);
  planner->settle(0.0, loop.state(), {});
  for (int n = 0; n < 50; ++n) {
    planner->solve(loop.time(), loop.state(), {0.4, 0.0, 0.0});
    loop.advance(kTick);
  }
  EXPECT_LT(planner->observed_wrenches().norm(), 1e-6);
}

}  // namespace
}  // namespace palanquin::planning
