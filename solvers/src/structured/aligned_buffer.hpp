#pragma once

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

namespace palanquin::structured {

/// Doubles on a 64-byte boundary, as the kernels want them. Only ever grows.
///
/// Much memory goes on huge pages where the system has them: a long horizon passes through more
/// small pages than a processor keeps translations of.
class AlignedBuffer {
 public:
  /// Makes room for `size` doubles. Contents are lost when the buffer grows.
  void reserve(std::size_t size) {
    if (size <= capacity_) return;
    std::size_t bytes = size * sizeof(double);
    const bool is_much = bytes >= kHugePage / 4;
    if (is_much) bytes = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    const std::align_val_t alignment{is_much ? kHugePage : kCacheLine};
    data_ = {static_cast<double*>(::operator new(bytes, alignment)), Free{alignment}};
#if defined(MADV_HUGEPAGE)
    if (is_much) madvise(data_.get(), bytes, MADV_HUGEPAGE);  // a wish: nothing depends on it
#endif
    capacity_ = size;
    std::fill_n(data_.get(), size, 0.0);
  }
  /// Sets all of it to zero.
  void clear() { std::fill_n(data_.get(), capacity_, 0.0); }
  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }

 private:
  static constexpr std::size_t kCacheLine = 64, kHugePage = std::size_t{2} * 1024 * 1024;
  struct Free {
    std::align_val_t alignment;
    void operator()(double* p) const { ::operator delete(p, alignment); }
  };
  std::unique_ptr<double[], Free> data_{nullptr, Free{std::align_val_t{kCacheLine}}};
  std::size_t capacity_ = 0;
};

}  // namespace palanquin::structured
