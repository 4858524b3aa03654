#pragma once

#include "palanquin/core/transcription/evaluation.hpp"
#include "palanquin/solvers/filter.hpp"

namespace palanquin {

inline Merit merit_of(const Evaluation& evaluation) {
  return {evaluation.infeasibility, evaluation.total()};
}

}  // namespace palanquin
