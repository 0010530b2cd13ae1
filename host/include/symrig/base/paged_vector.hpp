// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/memory.hpp"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace symrig {

/// A std::vector for numbers, whose memory may be a scratch file (MemoryScope). It grows without a copy, so
/// it never needs twice its memory. Pointers into it are valid until it grows.
/// fails: throws NoScratchSpace when it grows.
template <class T>
class PagedVector {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  PagedVector() = default;
  explicit PagedVector(std::size_t size) { resize(size); }
  PagedVector(std::size_t size, const T& value) { assign(size, value); }
  PagedVector(std::initializer_list<T> values) : PagedVector(values.begin(), values.end()) {}
  template <std::forward_iterator It>
  PagedVector(It first, It last) {
    assign(first, last);
  }
  PagedVector(const std::vector<T>& values)  // NOLINT: as if they were one type; a copy
      : PagedVector(values.begin(), values.end()) {}
  PagedVector(const PagedVector& other) : PagedVector(other.begin(), other.end()) {}
  PagedVector(PagedVector&& other) noexcept
      : memory_(std::move(other.memory_)), size_(std::exchange(other.size_, 0)) {}
  PagedVector& operator=(const PagedVector& other) {
    if (this != &other) assign(other.begin(), other.end());
    return *this;
  }
  PagedVector& operator=(PagedVector&& other) noexcept {
    memory_ = std::move(other.memory_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }
  ~PagedVector() = default;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* data() { return static_cast<T*>(memory_.data()); }
  const T* data() const { return static_cast<const T*>(memory_.data()); }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  T& operator[](std::size_t k) { return data()[k]; }
  const T& operator[](std::size_t k) const { return data()[k]; }
  const T& back() const { return data()[size_ - 1]; }

  void clear() { size_ = 0; }
  void reserve(std::size_t size) { memory_.reserve(size * sizeof(T)); }
  /// New values are T().
  void resize(std::size_t size) {
    reserve(size);
    if (size > size_) std::uninitialized_value_construct(data() + size_, data() + size);
    size_ = size;
  }
  void assign(std::size_t size, const T& value) {
    reserve(size);
    std::uninitialized_fill_n(data(), size, value);
    size_ = size;
  }
  /// Without room for more.
  template <std::forward_iterator It>
  void assign(It first, It last) {
    clear();
    reserve(static_cast<std::size_t>(std::distance(first, last)));
    append(first, last);
  }
  void push_back(const T& value) {
    const T copy = value;
    grow_to(size_ + 1);
    std::construct_at(data() + size_, copy);
    ++size_;
  }
  /// Adds values of another container at the end.
  template <std::forward_iterator It>
  void append(It first, It last) {
    const auto count = static_cast<std::size_t>(std::distance(first, last));
    grow_to(size_ + count);
    std::uninitialized_copy(first, last, data() + size_);
    size_ += count;
  }

  /// Values [first, first + count) for one pass over all of them: in place, or copied into `buffer` from a
  /// scratch file. To copy is faster than to map pages that are unmapped before the next pass.
  std::span<const T> window(std::size_t first, std::size_t count, std::vector<T>& buffer) const {
    if (!memory_.in_file()) return {data() + first, count};
    if (buffer.size() < count) buffer.resize(count);
    memory_.read(first * sizeof(T), count * sizeof(T), buffer.data());
    return {buffer.data(), count};
  }

  bool operator==(const PagedVector& other) const {
    return std::equal(begin(), end(), other.begin(), other.end());
  }

 private:
  void grow_to(std::size_t size) {
    if (size * sizeof(T) > memory_.capacity()) memory_.grow(size * sizeof(T));
  }

  PagedMemory memory_;
  std::size_t size_ = 0;
};

}  // namespace symrig
