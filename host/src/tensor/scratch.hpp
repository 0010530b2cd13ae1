// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include <tbb/cache_aligned_allocator.h>

namespace symrig::tensor {

/// Uninitialised floats from an allocator that keeps freed memory. New pages for each photograph would cost a
/// third of its time.
class Scratch {
 public:
  explicit Scratch(std::size_t size = 0)
      : size_(size), values_(size > 0 ? Allocator().allocate(size) : nullptr) {}
  Scratch(Scratch&& other) noexcept
      : size_(std::exchange(other.size_, 0)), values_(std::exchange(other.values_, nullptr)) {}
  Scratch& operator=(Scratch&& other) noexcept {
    std::swap(size_, other.size_);
    std::swap(values_, other.values_);
    return *this;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    if (values_ != nullptr) Allocator().deallocate(values_, size_);
  }

  std::size_t size() const { return size_; }
  float* data() const { return values_; }

 private:
  using Allocator = tbb::cache_aligned_allocator<float>;
  std::size_t size_;
  float* values_;
};

}  // namespace symrig::tensor
