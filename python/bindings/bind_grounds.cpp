// Gaits, grounds, and where feet may stand on them.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bindings.hpp"
#include "palanquin/control/planning/foothold_areas.hpp"
#include "palanquin/control/planning/foothold_starts.hpp"
#include "palanquin/control/planning/height_map.hpp"
#include "palanquin/core/shapes.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

using namespace planning;

namespace {

using Points2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using View2 = Eigen::Ref<const Points2>;
using View3 = Eigen::Ref<const Points3>;

Flags stands(const Gait& gait, VectorView phases) {
  Flags flags(phases.size(), kFeet);
  for (Eigen::Index i = 0; i < phases.size(); ++i) {
    const auto row = gait.stands(phases[i]);
    std::copy(row.begin(), row.end(), &flags(i, 0));
  }
  return flags;
}

Flags contacts(const GaitClock& clock, VectorView times) {
  Flags flags(times.size(), kFeet);
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    const auto row = clock.contacts(times[i]);
    std::copy(row.begin(), row.end(), &flags(i, 0));
  }
  return flags;
}

std::pair<RowMatrix, RowMatrix> stances(const GaitClock& clock, VectorView times) {
  std::pair<RowMatrix, RowMatrix> found{RowMatrix(times.size(), kFeet),
                                        RowMatrix(times.size(), kFeet)};
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    const Stances s = clock.stances(times[i]);
    std::copy(s.begin.begin(), s.begin.end(), &found.first(i, 0));
    std::copy(s.end.begin(), s.end.end(), &found.second(i, 0));
  }
  return found;
}

void bind_gaits(nb::module_& m) {
  nb::class_<Gait>(m, "Gait", "A periodic contact pattern; see gait.hpp.")
      .def(
          "__init__",
          [](Gait* self, std::string name, double period, std::vector<double> duty,
             std::vector<double> offset) {
            new (self) Gait{std::move(name), period, std::move(duty), std::move(offset)};
          },
          "name"_a, "period"_a, "duty"_a, "offset"_a)
      .def_ro("name", &Gait::name)
      .def_ro("period", &Gait::period)
      .def_ro("duty", &Gait::duty)
      .def_ro("offset", &Gait::offset)
      .def("stands", &stands, "phases"_a, "Contact flags [n, 4] at phases [n], cycles.");
  nb::class_<GaitClock>(m, "GaitClock", "The gait of one robot over time; see gait.hpp.")
      .def(nb::init<Gait, double, double>(), "gait"_a, "time"_a, "phase"_a)
      .def(
          "gait", [](const GaitClock& clock, double time) { return Gait(clock.gait(time)); },
          "time"_a)
      .def("phase", &GaitClock::phase, "time"_a)
      .def("change", &GaitClock::change, "gait"_a, "time"_a, "at_once"_a)
      .def("sense", &GaitClock::sense, "foot"_a, "time"_a, "has_ground"_a,
           "lands_within"_a = kLandsWithin)
      .def("contacts", &contacts, "times"_a)
      .def("stances", &stances, "times"_a);
}

void bind_terrains(nb::module_& m) {
  nb::class_<Terrain>(m, "Terrain", "A height map and where feet may stand; see terrain.hpp.")
      .def(
          "heights",
          [](const Terrain& t, const View2& points) {
            Eigen::VectorXd z(points.rows());
            for (Eigen::Index i = 0; i < z.size(); ++i) z[i] = t.height(points(i, 0), points(i, 1));
            return z;
          },
          "points"_a)
      .def(
          "gradients",
          [](const Terrain& t, const View2& points) {
            Points2 slopes(points.rows(), 2);
            for (Eigen::Index i = 0; i < slopes.rows(); ++i)
              slopes.row(i) = t.slope(points(i, 0), points(i, 1));
            return slopes;
          },
          "points"_a)
      .def(
          "around",
          [](const Terrain& t, View3 points) {
            int size = 0;
            for (const LocalParameter& p : t.local_parameters()) size += p.size;
            RowMatrix values(points.rows(), size);
            for (Eigen::Index i = 0; i < values.rows() && size > 0; ++i)
              t.around(points.row(i), &values(i, 0));
            return values;
          },
          "points"_a)
      .def(
          "nearest",
          [](const Terrain& t, View3 points) {
            Points3 found(points.rows(), 3);
            for (Eigen::Index i = 0; i < found.rows(); ++i) found.row(i) = t.nearest(points.row(i));
            return found;
          },
          "points"_a)
      .def(
          "options",
          [](const Terrain& t, const Vector3& wanted) {
            const Offers offers = t.options(wanted);
            Points3 found(offers.count, 3);
            for (int i = 0; i < offers.count; ++i) found.row(i) = offers.points[i];
            return found;
          },
          "wanted"_a);
  nb::class_<PlaneWithRamp, Terrain>(m, "PlaneWithRamp")
      .def(nb::init<Vector3, Vector3>(), "plane"_a, "ramp"_a);
  nb::class_<LoweredTerrain, Terrain>(m, "LoweredTerrain")
      .def(nb::init<std::string>(), "library"_a);
  nb::class_<HeightMap, Terrain>(m, "HeightMap")
      .def(nb::init<RowMatrix, Vector2, double, std::shared_ptr<const Terrain>>(), "coefficients"_a,
           "origin"_a, "spacing"_a, "trend"_a.none());
  using AreaParts = std::tuple<RowMatrix, RowMatrix, Vector3>;
  nb::class_<FootholdAreas, Terrain>(m, "FootholdAreas")
      .def(
          "__init__",
          [](FootholdAreas* self, const std::vector<AreaParts>& given, const Vector2& low,
             const Vector2& high, std::shared_ptr<const Terrain> trend) {
            std::vector<FootholdArea> areas;
            areas.reserve(given.size());
            for (const auto& [half_spaces, corners, plane] : given)
              areas.push_back({half_spaces, corners, plane});
            new (self) FootholdAreas(std::move(areas), low, high, std::move(trend));
          },
          "areas"_a, "low"_a, "high"_a, "trend"_a.none())
      .def(
          "excess",
          [](const FootholdAreas& t, const View2& points) {
            Eigen::VectorXd by(points.rows());
            for (Eigen::Index i = 0; i < by.size(); ++i)
              by[i] = t.excess(points(i, 0), points(i, 1));
            return by;
          },
          "points"_a);
  m.def(
      "nearest_in_polygon",
      [](const RowMatrix& corners, const Vector2& point) {
        check_shape("corners have", corners, corners.rows(), 2);
        return nearest_in_polygon(corners, point);
      },
      "corners"_a, "point"_a);
}

/// Contacts and measured feet as an instant has them. Throws std::invalid_argument unless `wanted`
/// is [N + 1, 3 feet] and the others fit.
Instant instant_of(const RowMatrix& wanted, const Flags& flags, const Flags& before,
                   const RowMatrix& feet) {
  check_shape("contacts have", flags, wanted.rows(), wanted.cols() / 3);
  check_shape("wanted footholds have", wanted, flags.rows(), 3 * flags.cols());
  check_shape("contacts before have", before, 1, flags.cols());
  Instant now;
  now.contacts = flags;
  now.before = before;
  now.feet = feet;
  return now;
}

std::vector<std::vector<int>> cheapest_combinations(const std::vector<std::vector<double>>& costs,
                                                    int at_most) {
  for (const auto& cost : costs)
    if (cost.empty() || cost.size() > Choices::kMost ||
        !std::all_of(cost.begin(), cost.end(), [](double c) { return std::isfinite(c); }))
      throw std::invalid_argument("costs: 1 to " + std::to_string(Choices::kMost) +
                                  " finite numbers are needed in each list");
  CheapestCombinations combinations(at_most, static_cast<int>(costs.size()));
  for (const auto& cost : costs) combinations.add(cost.data(), static_cast<int>(cost.size()));
  combinations.begin();
  std::vector<std::vector<int>> found;
  while (static_cast<int>(found.size()) < at_most) {
    const std::uint8_t* picked = combinations.next();
    if (picked == nullptr) break;
    found.emplace_back(picked, picked + costs.size());
  }
  return found;
}

std::vector<RowMatrix> foothold_starts(const RowMatrix& wanted, const Flags& flags,
                                       const Flags& before, const StandingGround& ground,
                                       int at_most) {
  const Instant now = instant_of(wanted, flags, before, {});
  FootholdStarts starts(at_most, static_cast<int>(wanted.rows()) - 1,
                        static_cast<int>(flags.cols()));
  std::vector<RowMatrix> found(static_cast<std::size_t>(at_most));
  found.resize(static_cast<std::size_t>(starts.make(wanted, now, ground, found)));
  return found;
}

void bind_footholds(nb::module_& m) {
  nb::class_<Ditches>(m, "Ditches", "Strips that no foot may step into; see ditches.hpp.")
      .def(nb::init<MatrixView>(), "lines"_a)
      .def(
          "depths",
          [](const Ditches& ditches, View2 points) {
            RowMatrix depths(points.rows(), ditches.size());
            for (Eigen::Index i = 0; i < depths.rows(); ++i)
              for (Eigen::Index j = 0; j < depths.cols(); ++j)
                depths(i, j) = ditches.depth(j, points.row(i));
            return depths;
          },
          "points"_a)
      .def(
          "leave",
          [](const Ditches& ditches, View2 points, bool nearer) {
            Points2 moved(points.rows(), 2);
            for (Eigen::Index i = 0; i < moved.rows(); ++i)
              moved.row(i) = ditches.leave(points.row(i), nearer);
            return moved;
          },
          "points"_a, "nearer"_a)
      .def(
          "nearest_clear",
          [](const Ditches& ditches, View2 points) {
            Points2 moved(points.rows(), 2);
            for (Eigen::Index i = 0; i < moved.rows(); ++i)
              moved.row(i) = ditches.nearest_clear(points.row(i));
            return moved;
          },
          "points"_a);
  nb::class_<StandingGround>(m, "StandingGround", "Where feet may stand; see standing_ground.hpp.")
      .def(
          "__init__",
          [](StandingGround* self, std::shared_ptr<const Terrain> terrain, MatrixView lines) {
            new (self) StandingGround(std::move(terrain), Ditches(lines));
          },
          "terrain"_a, "ditches"_a)
      .def_prop_ro("is_whole", &StandingGround::is_whole);
  m.def("cheapest_combinations", &cheapest_combinations, "costs"_a, "at_most"_a);
  m.def("foothold_starts", &foothold_starts, "wanted"_a, "contacts"_a, "before"_a, "ground"_a,
        "at_most"_a);
  m.def(
      "carried_feet",
      [](RowMatrix wanted, const Flags& flags, const Flags& before, const RowMatrix& feet) {
        check_shape("feet have", feet, flags.cols(), 3);
        instant_of(wanted, flags, before, feet).carry(wanted);
        return wanted;
      },
      "wanted"_a, "contacts"_a, "before"_a, "feet"_a);
}

}  // namespace

void bind_grounds(nb::module_& m) {
  bind_gaits(m);
  bind_terrains(m);
  bind_footholds(m);
}

}  // namespace palanquin
