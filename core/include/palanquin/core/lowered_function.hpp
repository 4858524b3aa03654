#pragma once

#include <string>
#include <vector>

#include "palanquin/core/lowered_library.hpp"

namespace palanquin {

/// Compressed-column pattern of one result of a lowered function.
struct Sparsity {
  int rows = 0;
  int cols = 0;
  std::vector<int> column_start;  ///< [cols + 1]
  std::vector<int> row_index;     ///< [nnz]
  int nnz() const { return static_cast<int>(row_index.size()); }
};

/// Scratch memory for calls from one thread; created once, grown by LoweredFunction::prepare.
struct FunctionWorkspace {
  std::vector<const double*> arguments;
  std::vector<double*> results;
  std::vector<long long> integers;
  std::vector<double> reals;
  std::vector<double> values;  ///< results of a LaneFunction without lanes
};

/// One function of a lowered library, in CasADi's C calling convention.
class LoweredFunction {
 public:
  LoweredFunction() = default;
  /// Throws std::runtime_error when the library lacks `name` or what describes it.
  LoweredFunction(const LoweredLibrary& library, const std::string& name);

  const std::string& name() const { return name_; }
  int argument_count() const { return argument_count_; }
  int result_count() const { return static_cast<int>(results_.size()); }
  /// Pattern of result `i`.
  const Sparsity& result(int i) const { return results_[static_cast<std::size_t>(i)]; }

  /// Makes `workspace` large enough for this function.
  void prepare(FunctionWorkspace& workspace) const;
  /// Evaluates with workspace.arguments and workspace.results as set by the caller, none of them
  /// null unless it has no entries. Does not allocate.
  void operator()(FunctionWorkspace& workspace) const;

 private:
  using Code = int (*)(const double**, double**, long long*, double*, int);

  std::string name_;
  Code code_ = nullptr;
  int argument_count_ = 0;
  std::vector<Sparsity> results_;
  std::size_t size_arguments_ = 0, size_results_ = 0, size_integers_ = 0, size_reals_ = 0;
};

/// A lowered function at several knots at once, one in each lane of a SIMD register, whose results
/// are handed over while they are in the cache. Where the library has no code over lanes, a single
/// lane: the function itself.
class LaneFunction {
 public:
  LaneFunction() = default;
  /// Throws as LoweredFunction.
  LaneFunction(const LoweredLibrary& library, const std::string& name);

  int lanes() const { return lanes_; }
  /// Makes `workspace` large enough for this function.
  void prepare(FunctionWorkspace& workspace) const;
  /// Evaluates argument i of the knot in `lane` from workspace.arguments[i * lanes() + lane], none
  /// of them null, and calls take(int result, const double* values) for every result in turn, with
  /// values[entry * lanes() + lane]. A knot's results do not depend on its lane or on the other
  /// knots. Does not allocate.
  template <typename Take>
  void operator()(FunctionWorkspace& workspace, Take take) const {
    auto call = [](void* context, int result, const double* values) {
      (*static_cast<Take*>(context))(result, values);
    };
    evaluate(workspace, call, &take);
  }

 private:
  using TakeResult = void (*)(void* context, int result, const double* values);
  using Code = void (*)(const double* const*, TakeResult, void* context);
  void evaluate(FunctionWorkspace& workspace, TakeResult take, void* context) const;

  LoweredFunction function_;
  Code code_ = nullptr;
  int lanes_ = 1;
};

}  // namespace palanquin
