// Where feet may stand, and in which order choices come.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "palanquin/control/planning/foothold_areas.hpp"
#include "palanquin/control/planning/foothold_starts.hpp"
#include "palanquin/control/planning/height_map.hpp"

namespace palanquin::planning {
namespace {

void expect_slope_of_height(const Terrain& terrain, double x, double y) {
  constexpr double kStep = 1e-6;
  const Vector2 differences(terrain.height(x + kStep, y) - terrain.height(x - kStep, y),
                            terrain.height(x, y + kStep) - terrain.height(x, y - kStep));
  EXPECT_LT((terrain.slope(x, y) - differences / (2 * kStep)).norm(), 1e-8) << x << ", " << y;
}

TEST(Terrain, SlopesAreThoseOfTheHeight) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const RowMatrix coefficients = RowMatrix::NullaryExpr(26, 30, [&] { return 0.1 * unit(random); });
  const HeightMap map(coefficients, {-1.0, -0.5}, 0.1, nullptr);
  const PlaneWithRamp ramp({0.1, 0.2, -0.3}, {1.6, 2.0, 0.2});
  for (int i = 0; i < 50; ++i) {
    const double x = 0.4 * unit(random), y = 0.4 * unit(random);
    expect_slope_of_height(map, x, y);
    expect_slope_of_height(ramp, x, y);
  }
  EXPECT_TRUE(PlaneWithRamp({0.1, 0.2, -0.3}, Vector3::Zero()).is_plane());
  EXPECT_FALSE(ramp.is_plane());
}

TEST(Ditches, APointLeavesOverEitherEdgeAndOnThroughAdjoiningOnes) {
  const RowMatrix lines{{1.0, 0.0, -0.5, 0.3}, {1.0, 0.0, -0.8, 0.3}};
  const Ditches ditches(lines);
  const Vector2 p(0.55, 0.2);
  EXPECT_NEAR(ditches.leave(p, false).x(), 0.34, 1e-12);
  EXPECT_NEAR(ditches.leave(p, true).x(), 0.96, 1e-12);
  EXPECT_NEAR(ditches.nearest_clear(p).x(), 0.34, 1e-12);
  EXPECT_EQ(ditches.nearest_clear({0.2, 1.0}), Vector2(0.2, 1.0));
  EXPECT_THROW(Ditches(RowMatrix{{0.0, 0.0, 1.0, 0.1}}), std::invalid_argument);
}

FootholdArea square(double x, double z) {
  FootholdArea area;
  area.half_spaces = RowMatrix{{1, 0, -x - 0.1}, {-1, 0, x - 0.1}, {0, 1, -0.1}, {0, -1, -0.1}};
  area.corners = RowMatrix{{x - 0.1, -0.1}, {x + 0.1, -0.1}, {x + 0.1, 0.1}, {x - 0.1, 0.1}};
  area.plane = {z, 0.0, 0.0};
  return area;
}

TEST(FootholdAreas, OfferTheirNearestPointsNearestFirst) {
  const FootholdAreas areas({square(0.0, 0.0), square(0.5, 0.2)}, {-0.1, -0.1}, {0.6, 0.1},
                            nullptr);
  const Offers offers = areas.options({0.35, 0.0, 0.0});
  ASSERT_EQ(offers.count, 2);
  EXPECT_LT((offers.points[0] - Vector3(0.4, 0.0, 0.2)).norm(), 1e-12);
  EXPECT_LT((offers.points[1] - Vector3(0.1, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_EQ(areas.nearest({0.45, 0.05, 9.0}), Vector3(0.45, 0.05, 0.2));
  EXPECT_TRUE(areas.has_gaps());
}

TEST(CheapestCombinations, ComeInOrderAndOnceEach) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const std::vector<int> sizes = {3, 1, 4, 2};
  std::vector<std::vector<double>> costs;
  CheapestCombinations combinations(30, 4);
  for (int size : sizes) {
    costs.emplace_back();
    for (int i = 0; i < size; ++i) costs.back().push_back(unit(random));
    combinations.add(costs.back().data(), size);
  }
  combinations.begin();
  std::set<std::vector<int>> found;
  double before = 0.0;
  while (const std::uint8_t* picked = combinations.next()) {
    double total = 0.0;
    for (std::size_t i = 0; i < 4; ++i) total += costs[i][picked[i]];
    EXPECT_GE(total, before - 1e-12);
    before = total;
    EXPECT_TRUE(found.emplace(picked, picked + 4).second);
  }
  EXPECT_EQ(found.size(), 24u);
}

}  // namespace
}  // namespace palanquin::planning
