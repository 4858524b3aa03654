#pragma once

// Counts the allocations of a test program that is linked with support/allocation_counter.cpp.

namespace palanquin::testing {

/// Calls of malloc and its relatives so far, and so of operator new, from any library. Always 0
/// under a sanitizer, whose allocator must not be replaced.
long allocation_count();

/// Allocations while `work` ran.
template <class Work>
long allocations_during(Work work) {
  const long before = allocation_count();
  work();
  return allocation_count() - before;
}

}  // namespace palanquin::testing
