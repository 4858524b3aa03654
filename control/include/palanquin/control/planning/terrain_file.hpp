#pragma once

#include <memory>
#include <string>

#include "palanquin/control/planning/terrain.hpp"
#include "palanquin/core/text_lines.hpp"

namespace palanquin::planning {

// How terrains stand in a planner's file, a line each; of a rough one its trend comes before it:
//
//   trend KIND ...      the ground as bodies follow it, of the terrain on the next line
//   terrain KIND ...    with KIND one of
//     plane Z0 AX AY H RATE XG
//     lowered                                    the library terrain.so beside the file
//     map ROWS COLUMNS X0 Y0 SPACING C...        coefficients of the spline, row by row
//     areas COUNT SIDES XMIN YMIN XMAX YMAX, and for each area Z0 AX AY, SIDES times A B C (its
//       half-spaces), SIDES times X Y (corners of where feet may stand)

/// The rest of such a line as a terrain; throws std::runtime_error in words.
std::shared_ptr<const Terrain> read_terrain(TextLine& line, std::shared_ptr<const Terrain> trend,
                                            const std::string& folder);

}  // namespace palanquin::planning
