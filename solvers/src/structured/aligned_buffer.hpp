#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

namespace palanquin::structured {

/// Doubles on a 64-byte boundary, as the kernels want them. Only ever grows.
class AlignedBuffer {
 public:
  /// Makes room for `size` doubles. Contents are lost when the buffer grows.
  void reserve(std::size_t size) {
    if (size <= capacity_) return;
    data_.reset(static_cast<double*>(::operator new(size * sizeof(double), kAlignment)));
    capacity_ = size;
    std::fill_n(data_.get(), size, 0.0);
  }
  /// Sets all of it to zero.
  void clear() { std::fill_n(data_.get(), capacity_, 0.0); }
  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Free {
    void operator()(double* p) const { ::operator delete(p, kAlignment); }
  };
  std::unique_ptr<double[], Free> data_;
  std::size_t capacity_ = 0;
};

}  // namespace palanquin::structured
