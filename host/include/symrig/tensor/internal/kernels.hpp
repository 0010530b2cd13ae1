// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include <tbb/cache_aligned_allocator.h>

namespace symrig::tensor {

/// The ranges of tree order with non-zero values. A leaf whose range is all zero is skipped, and its factors
/// are not read.
class LitRanges {
 public:
  /// values: a range of numbers, one a pixel.
  template <class Values>
  explicit LitRanges(const Values& values) : before_(std::size(values) + 1) {
    std::size_t i = 0;
    for (const auto value : values) {
      before_[i + 1] = before_[i] + (value != 0 ? 1 : 0);
      ++i;
    }
  }
  /// True if [begin, end) has a non-zero value.
  bool any(std::int32_t begin, std::int32_t end) const { return before_[end] != before_[begin]; }

 private:
  std::vector<std::int32_t> before_;  // number of non-zero values before each index
};

/// Σ aᵢ bᵢ over n values, with one partial sum for each vector lane. The bits are the same for any number of
/// threads, but may differ between instruction sets.  error: ≤ n ε Σ|aᵢ bᵢ|.
float dot(const float* a, const float* b, std::size_t n);

/// y += w a over n values.
void add_scaled(float w, const float* a, float* y, std::size_t n);

/// y += w a, and returns Σ aᵢ pᵢ: one pass over a computes both halves of a symmetric leaf.
float add_scaled_and_dot(float w, const float* a, const float* p, float* y, std::size_t n);

/// The number of patterns in a batch: P[pixel][kBatch], one cache line for each pixel.
inline constexpr std::size_t kBatch = 16;

/// w[c] = Σ_j b[j] P[j][c], c < kBatch, over n pixels. shapes: b [n], p [n × kBatch], w [kBatch].
/// error: ≤ n ε Σ|b P|, ε = 2⁻²⁴; the same bits for any number of threads.
void dot_batch(const float* b, const float* p, std::size_t n, float* w);

/// Y[i][c] += a[i] w[c]. shapes: a [n], w [kBatch], y [n × kBatch].
void add_scaled_batch(const float* a, const float* w, float* y, std::size_t n);

/// One leaf A Bᵀ of one channel: a [rows × rank] and b [cols × rank] column by column, and where its blocks
/// begin in tree order.
struct LeafFactors {
  const float* a;
  const float* b;
  std::size_t row_begin, rows, col_begin, cols, rank;
};

/// Y_I += A (Bᵀ P_J), and if mirrored Y_J += B (Aᵀ P_I): a whole leaf in one dispatch.
/// p, y: all pixels in tree order, kBatch patterns interleaved; they must not overlap.
void add_leaf_batch(const LeafFactors& leaf, bool mirrored, const float* p, float* y);

/// The patterns of a batch that light a pixel: bit k for pattern k.
using LitMask = std::uint16_t;
static_assert(8 * sizeof(LitMask) == kBatch);

/// The same for patterns of only 0 and 1: 2 bytes a pixel instead of 64. lit: the masks of all pixels.
void add_leaf_batch(const LeafFactors& leaf, bool mirrored, const LitMask* lit, float* y);

// Converts pictures to the kernels' layout: pixels in tree order, patterns interleaved lane by lane.

/// to[i] = from[order[i]], i < n.
void gather(const std::int32_t* order, const float* from, float* to, std::size_t n);

/// One row of n values for each lane.
using LaneRows = std::array<const float*, kBatch>;
using LaneRowsOut = std::array<float*, kBatch>;

/// p[i][lane] = lanes[lane][i], i < n. shapes: p [n × kBatch].
void interleave(const LaneRows& lanes, std::size_t n, float* p);

/// lanes[lane][i] = p[i][lane], i < n.
void deinterleave(const float* p, std::size_t n, const LaneRowsOut& lanes);

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
