#include "palanquin/core/lowered_problem.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace palanquin {

namespace {

namespace fs = std::filesystem;

fs::path library_at(const fs::path& path) {
  return fs::is_directory(path) ? path / "sqp.so" : path;
}

/// What lies beside a library in a saved folder or in the cache; of a library that was taken away
/// from there, what it was compiled with.
std::string manifest_of(const fs::path& path, const LoweredLibrary& library) {
  const bool is_folder = fs::is_directory(path);
  const fs::path at = is_folder ? path / "manifest" : fs::path(path).replace_extension(".manifest");
  if (!is_folder && !fs::exists(at)) return library.manifest();
  std::ifstream file(at, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error("cannot read '" + at.string() + "'");
  return text;
}

}  // namespace

LoweredProblem::LoweredProblem(const std::string& path)
    : LoweredProblem(path, LoweredLibrary(library_at(path).string())) {}

// NOLINTNEXTLINE(performance-unnecessary-value-param): the next one keeps a copy anyhow
LoweredProblem::LoweredProblem(const std::string& path, LoweredLibrary library)
    : LoweredProblem(library, parse_manifest(manifest_of(path, library), path)) {}

LoweredProblem::LoweredProblem(const std::string& library, const std::string& manifest)
    : LoweredProblem(LoweredLibrary(library), parse_manifest(manifest, library)) {}

LoweredProblem::LoweredProblem(LoweredLibrary library, Manifest manifest)
    : library_(std::move(library)), manifest_(std::move(manifest)) {
  library_.check_structure(manifest_);
  for (const BlockInfo& b : manifest_.blocks) add_block(b);
  for (const ParameterInfo& p : manifest_.parameters) np_ += p.size;
  structure = LoweredFunction(library_, "structure");
  chart = LoweredFunction(library_, "chart");
  running = LoweredFunction(library_, "running");
  running_linear = LoweredFunction(library_, "running_linear");
  terminal = LoweredFunction(library_, "terminal");
  terminal_linear = LoweredFunction(library_, "terminal_linear");
  link = LoweredFunction(library_, "link");
  link_linear = LoweredFunction(library_, "link_linear");
  knot_values = {LaneFunction(library_, "running"), LaneFunction(library_, "terminal")};
  knot_derivatives = {LaneFunction(library_, "running_linear"),
                      LaneFunction(library_, "terminal_linear")};
}

/// Takes a block into the sizes and runs of the knot vector.
void LoweredProblem::add_block(const BlockInfo& block) {
  const bool follows_vector = nz_ > 0 && !vector_runs_.empty() &&
                              vector_runs_.back().offset + vector_runs_.back().size == nz_;
  nz_ += block.size;
  ndz_ += block.tangent_size;
  if (block.is_state) {
    nx_ += block.size;
    ndx_ += block.tangent_size;
    states_.push_back(block);
  }
  if (block.is_quaternion)
    quaternions_.push_back(block);
  else if (follows_vector)
    vector_runs_.back().size += block.size;
  else
    vector_runs_.push_back({block.offset, block.tangent_offset, block.size});
}

int LoweredProblem::row_count(StageKind stage, RowKind kind) const {
  const auto& groups = rows(stage, kind);
  return groups.empty() ? 0 : groups.back().offset + groups.back().size;
}

const BlockInfo& LoweredProblem::block(const std::string& name) const {
  std::string known;
  for (const BlockInfo& b : blocks()) {
    if (b.name == name) return b;
    known += (known.empty() ? "" : ", ") + b.name;
  }
  throw std::invalid_argument("problem '" + manifest_.name + "' has no block '" + name +
                              "'; it has " + known);
}

std::string LoweredProblem::row_name(StageKind stage, RowKind kind, int row, int knot) const {
  for (const RowGroup& g : rows(stage, kind)) {
    if (row >= g.offset + g.size) continue;
    std::string text = g.family + " (";
    if (!g.robot.empty()) text += "robot " + g.robot + ", ";
    if (!g.limb.empty()) text += "limb " + g.limb + ", ";
    return text + "row " + std::to_string(row - g.offset) + ", knot " + std::to_string(knot) + ")";
  }
  throw std::invalid_argument("row_name: row " + std::to_string(row) + " does not exist");
}

std::string LoweredProblem::dynamics_name(int row, int knot) const {
  for (const BlockInfo& b : states_) {
    if (row < b.size)
      return "dynamics of " + b.name + "[" + std::to_string(row) + "] (knot " +
             std::to_string(knot) + ")";
    row -= b.size;
  }
  throw std::invalid_argument("dynamics_name: row " + std::to_string(row) + " does not exist");
}

}  // namespace palanquin
