#pragma once

#include <cstddef>

namespace palanquin {

/// How many combinations of flags, or what follows from each, is remembered for a horizon of
/// `knots` before all are forgotten: some gaits' worth (a trot over 16 knots has about 30), and a
/// bound on memory where contacts never repeat.
inline std::size_t most_kept(std::size_t knots) { return 500 + 10 * knots; }

}  // namespace palanquin
