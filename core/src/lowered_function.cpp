#include "palanquin/core/lowered_function.hpp"

#include <algorithm>

namespace palanquin {

namespace {

/// CasADi's compact pattern: rows, cols, then cols + 1 starts (or 1 for dense), then rows' indices.
Sparsity parse_sparsity(const long long* compact) {
  Sparsity s;
  s.rows = static_cast<int>(compact[0]);
  s.cols = static_cast<int>(compact[1]);
  const long long* start = compact + 2;
  if (start[0] != 0) {  // dense
    for (int j = 0; j <= s.cols; ++j) s.column_start.push_back(j * s.rows);
    for (int j = 0; j < s.cols; ++j)
      for (int i = 0; i < s.rows; ++i) s.row_index.push_back(i);
    return s;
  }
  for (int j = 0; j <= s.cols; ++j) s.column_start.push_back(static_cast<int>(start[j]));
  const long long* row = start + s.cols + 1;
  for (long long i = 0; i < start[s.cols]; ++i) s.row_index.push_back(static_cast<int>(row[i]));
  return s;
}

}  // namespace

LoweredFunction::LoweredFunction(const LoweredLibrary& library, const std::string& name)
    : name_(name), code_(reinterpret_cast<Code>(library.symbol(name))) {
  auto count = [&](const char* suffix) {
    return reinterpret_cast<long long (*)()>(library.symbol(name + suffix))();
  };
  argument_count_ = static_cast<int>(count("_n_in"));
  auto pattern =
      reinterpret_cast<const long long* (*)(long long)>(library.symbol(name + "_sparsity_out"));
  const long long results = count("_n_out");
  for (long long i = 0; i < results; ++i) results_.push_back(parse_sparsity(pattern(i)));
  auto work = reinterpret_cast<int (*)(long long*, long long*, long long*, long long*)>(
      library.symbol(name + "_work"));
  long long arguments = 0, outputs = 0, integers = 0, reals = 0;
  work(&arguments, &outputs, &integers, &reals);
  size_arguments_ = static_cast<std::size_t>(arguments);
  size_results_ = static_cast<std::size_t>(outputs);
  size_integers_ = static_cast<std::size_t>(integers);
  size_reals_ = static_cast<std::size_t>(reals);
}

namespace {
template <typename T>
void grow(std::vector<T>& v, std::size_t size) {
  v.resize(std::max(v.size(), size));
}
}  // namespace

void LoweredFunction::prepare(FunctionWorkspace& workspace) const {
  grow(workspace.arguments, std::max(size_arguments_, static_cast<std::size_t>(argument_count_)));
  grow(workspace.results, std::max(size_results_, results_.size()));
  grow(workspace.integers, size_integers_);
  grow(workspace.reals, size_reals_);
}

void LoweredFunction::operator()(FunctionWorkspace& w) const {
  code_(w.arguments.data(), w.results.data(), w.integers.data(), w.reals.data(), 0);
}

LaneFunction::LaneFunction(const LoweredLibrary& library, const std::string& name)
    : function_(library, name),
      code_(reinterpret_cast<Code>(library.find_symbol(name + "_lanes"))) {
  if (code_ != nullptr)
    lanes_ =
        static_cast<int>(reinterpret_cast<long long (*)()>(library.symbol("palanquin_lanes"))());
}

void LaneFunction::prepare(FunctionWorkspace& workspace) const {
  function_.prepare(workspace);
  grow(workspace.arguments, static_cast<std::size_t>(function_.argument_count() * lanes_));
  std::size_t values = 1;
  for (int i = 0; i < function_.result_count(); ++i)
    values += static_cast<std::size_t>(function_.result(i).nnz());
  grow(workspace.values, values);
}

void LaneFunction::evaluate(FunctionWorkspace& w, TakeResult take, void* context) const {
  if (code_ != nullptr) {
    code_(w.arguments.data(), take, context);
    return;
  }
  double* values = w.values.data();
  for (int i = 0; i < function_.result_count(); ++i) {
    w.results[static_cast<std::size_t>(i)] = values;
    values += function_.result(i).nnz();
  }
  function_(w);
  for (int i = 0; i < function_.result_count(); ++i)
    take(context, i, w.results[static_cast<std::size_t>(i)]);
}

}  // namespace palanquin
