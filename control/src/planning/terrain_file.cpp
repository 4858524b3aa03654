#include "palanquin/control/planning/terrain_file.hpp"

#include <filesystem>

#include "palanquin/control/planning/foothold_areas.hpp"
#include "palanquin/control/planning/height_map.hpp"

namespace palanquin::planning {

namespace {

constexpr const char* kLibrary = "terrain.so";

template <typename Numbers>
void append(std::string& text, const Numbers& numbers) {
  for (Eigen::Index i = 0; i < numbers.rows(); ++i)
    for (Eigen::Index j = 0; j < numbers.cols(); ++j) text += ' ' + to_text(numbers(i, j));
}

void append_trend(std::string& text, const Terrain& terrain, const std::string& folder) {
  if (&terrain.trend() == &terrain) return;
  std::string line;
  terrain.trend().write(line, folder);
  text += "trend" + line.substr(std::string("terrain").size());
}

template <typename Numbers>
Numbers read(TextLine& line, Numbers numbers) {
  for (Eigen::Index i = 0; i < numbers.rows(); ++i)
    for (Eigen::Index j = 0; j < numbers.cols(); ++j) numbers(i, j) = line.number();
  return numbers;
}

std::shared_ptr<const Terrain> read_plane(TextLine& line) {
  const Vector3 plane = read(line, Vector3()), ramp = read(line, Vector3());
  return std::make_shared<PlaneWithRamp>(plane, ramp);
}

std::shared_ptr<const Terrain> read_map(TextLine& line, std::shared_ptr<const Terrain> trend) {
  const int rows = line.integer(1), columns = line.integer(1);
  const Vector2 origin = read(line, Vector2());
  const double spacing = line.number();
  return std::make_shared<HeightMap>(read(line, RowMatrix(rows, columns)), origin, spacing,
                                     std::move(trend));
}

std::shared_ptr<const Terrain> read_areas(TextLine& line, std::shared_ptr<const Terrain> trend) {
  const int count = line.integer(1), sides = line.integer(3);
  const Vector2 low = read(line, Vector2()), high = read(line, Vector2());
  std::vector<FootholdArea> areas(static_cast<std::size_t>(count));
  for (FootholdArea& area : areas) {
    area.plane = read(line, Vector3());
    area.half_spaces = read(line, RowMatrix(sides, 3));
    area.corners = read(line, RowMatrix(sides, 2));
  }
  return std::make_shared<FootholdAreas>(std::move(areas), low, high, std::move(trend));
}

}  // namespace

void PlaneWithRamp::write(std::string& text, const std::string& /*folder*/) const {
  text += "terrain plane";
  append(text, plane_);
  append(text, ramp_);
  text += '\n';
}

void LoweredTerrain::write(std::string& text, const std::string& folder) const {
  namespace fs = std::filesystem;
  const fs::path target = fs::path(folder) / kLibrary;
  if (!fs::exists(target) || !fs::equivalent(library_.path(), target))
    fs::copy_file(library_.path(), target, fs::copy_options::overwrite_existing);
  text += "terrain lowered\n";
}

void HeightMap::write(std::string& text, const std::string& folder) const {
  append_trend(text, *this, folder);
  text += "terrain map " + std::to_string(coefficients_.rows()) + ' ' +
          std::to_string(coefficients_.cols());
  append(text, origin_);
  text += ' ' + to_text(spacing_);
  append(text, coefficients_);
  text += '\n';
}

void FootholdAreas::write(std::string& text, const std::string& folder) const {
  append_trend(text, *this, folder);
  text += "terrain areas " + std::to_string(areas_.size()) + ' ' +
          std::to_string(areas_.front().half_spaces.rows());
  append(text, least_);
  append(text, most_);
  for (const FootholdArea& area : areas_) {
    append(text, area.plane);
    append(text, area.half_spaces);
    append(text, area.corners);
  }
  text += '\n';
}

std::shared_ptr<const Terrain> read_terrain(TextLine& line, std::shared_ptr<const Terrain> trend,
                                            const std::string& folder) {
  switch (line.choice({"plane", "lowered", "map", "areas"})) {
    case 0:
      return read_plane(line);
    case 1:
      return std::make_shared<LoweredTerrain>(folder + '/' + kLibrary);
    case 2:
      return read_map(line, std::move(trend));
    default:
      return read_areas(line, std::move(trend));
  }
}

}  // namespace palanquin::planning
