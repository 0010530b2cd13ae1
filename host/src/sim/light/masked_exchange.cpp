// SPDX-License-Identifier: Apache-2.0

#include "sim/light/exchange.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::sim {

namespace {

/// top = a + b, low = (a − b) e^{−iφ}, with cos φ = c and sin φ = s.
struct Butterfly {
  float c, s;

  void operator()(const FftLane& a_re, const FftLane& a_im, const FftLane& b_re, const FftLane& b_im,
                  FftLane& top_re, FftLane& top_im, FftLane& low_re, FftLane& low_im) const {
    for (std::size_t k = 0; k < kFftLanes; ++k) {
      const float re = a_re[k] - b_re[k];
      const float im = a_im[k] - b_im[k];
      top_re[k] = a_re[k] + b_re[k];
      top_im[k] = a_im[k] + b_im[k];
      low_re[k] = re * c + im * s;
      low_im[k] = im * c - re * s;
    }
  }
};

}  // namespace

LaneFft::LaneFft(std::size_t length) : length_(length) {
  for (std::size_t k = 0; k < length / 2; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
    cos_.push_back(static_cast<float>(std::cos(angle)));
    sin_.push_back(static_cast<float>(std::sin(angle)));
  }
}

void LaneFft::forward(LaneSignal& signal, LaneSignal& scratch) const {
  LaneSignal* from = &signal;
  LaneSignal* to = &scratch;
  const std::size_t half = length_ / 2;
  for (std::size_t stride = 1; stride < length_; stride *= 2) {
    for (std::size_t first = 0; first < half; first += stride) {
      const Butterfly butterfly{cos_[first], sin_[first]};
      for (std::size_t at = first; at < first + stride; ++at)
        butterfly(from->re[at], from->im[at], from->re[at + half], from->im[at + half], to->re[at + first],
                  to->im[at + first], to->re[at + first + stride], to->im[at + first + stride]);
    }
    std::swap(from, to);
  }
  if (from != &signal) std::swap(signal, scratch);
}

namespace {

/// (1 + x) e^−x is 1e-7 there.
constexpr double kLastPhase = 19;

/// Columns [begin, end) of one plane.
struct ColumnRange {
  int begin = 0, end = 0;
  int size() const { return end - begin; }
};

/// The kernels of one frequency: toward[0][t][s] for light to the left, toward[1][s][t] (the same numbers)
/// for light to the right.
struct Frequency {
  ColumnRange side[2];
  std::vector<float> toward[2];
};

/// Spectra of all columns: planes of (frequencies × columns).
struct Spectrum {
  Spectrum(std::size_t frequencies, int cols_)
      : cols(static_cast<std::size_t>(cols_)), re(frequencies * cols, 0.F), im(frequencies * cols, 0.F) {}
  std::size_t cols;
  std::vector<float> re, im;
};

class MaskedExchange final : public Exchange {
 public:
  MaskedExchange(const Groove& groove, const Sight& sees);
  void apply(std::span<const float> in, std::span<float> out) const override;

 private:
  void transform(std::span<const float> in, Spectrum& spectrum) const;
  void multiply(const Spectrum& in, Spectrum& out) const;
  void transform_back(const Spectrum& spectrum, std::span<float> out) const;
  void fill_kernels(const Groove& groove, const Sight& sees, int left_col);

  Grid grid_;
  LaneFft fft_;
  std::vector<Frequency> frequencies_;
};

/// Leaves a quarter of half the length for the fade of the kernel.
std::size_t padded_length(int rows) {
  return std::bit_ceil(static_cast<std::size_t>(2.5 * rows));
}

/// The kernel must be exact only for |dy| < rows. Beyond that, up to half the period, it fades out like ½
/// erfc. A kink at the end of the period would spread over all frequencies.
struct Fade {
  Fade(int rows, std::size_t length) : begin(rows - 1), width(static_cast<double>(length) / 2 - begin) {}

  double operator()(double dy) const {
    return dy <= begin ? 1 : 0.5 * std::erfc(kSteepness * (2 * (dy - begin) / width - 1));
  }
  /// Beyond this frequency, the spectrum of the fade, exp(−(ω · width / 4 kSteepness)²), is below 1e-6.
  double bandwidth() const { return 4 * kSteepness * 3.72 / width; }

  static constexpr double kSteepness = 3.4;  // ½ erfc(3.4) = 8e-7 is the jump at its ends
  double begin, width;
};

/// The columns of a plane that matter at angular frequency w [rad/px]: all columns up to the fade's
/// bandwidth, above it only the columns near the crease.
ColumnRange columns_within(const Groove& groove, int begin, int end, double w, double bandwidth) {
  const double reach = w > bandwidth ? kLastPhase / (std::numbers::sqrt2 * w) : 1e30;
  ColumnRange range{begin, end};
  while (range.begin < range.end && groove.distance[range.begin] > reach) ++range.begin;
  while (range.end > range.begin && groove.distance[static_cast<std::size_t>(range.end) - 1] > reach)
    --range.end;
  return range;
}

MaskedExchange::MaskedExchange(const Groove& groove, const Sight& sees)
    : grid_(groove.grid), fft_(padded_length(groove.grid.rows)) {
  const double bandwidth = Fade(grid_.rows, fft_.length()).bandwidth();
  for (std::size_t k = 0; k <= fft_.length() / 2; ++k) {
    const double w = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(fft_.length());
    Frequency& f = frequencies_.emplace_back();
    f.side[0] = columns_within(groove, 0, groove.left_cols, w, bandwidth);
    f.side[1] = columns_within(groove, groove.left_cols, grid_.cols, w, bandwidth);
    const auto pairs =
        static_cast<std::size_t>(f.side[0].size()) * static_cast<std::size_t>(f.side[1].size());
    f.toward[0].assign(pairs, 0.F);
    f.toward[1].assign(pairs, 0.F);
  }
  tbb::parallel_for(0, groove.left_cols, [&](int left_col) { fill_kernels(groove, sees, left_col); });
}

/// Samples the kernel of one pair of columns. The samples are periodic and even, so their spectrum is real.
/// So two pairs share a complex signal, one as the real and one as the imaginary part.
void sample_kernel(const Groove& groove, int left_col, int right_col, std::vector<FftLane>& part,
                   std::size_t lane) {
  const double s = groove.distance[left_col];
  const double t = groove.distance[right_col];
  const std::size_t n = part.size();
  const Fade fade(groove.grid.rows, n);
  for (std::size_t y = 0; y < n; ++y) {
    const auto dy = static_cast<double>(std::min(y, n - y));
    part[y][lane] = static_cast<float>(fade(dy) * point_form_factor(s, t, dy) / static_cast<double>(n));
  }
}

void store_kernel(Frequency& f, int left_col, int right_col, float value) {
  if (left_col < f.side[0].begin || left_col >= f.side[0].end) return;
  if (right_col < f.side[1].begin || right_col >= f.side[1].end) return;
  const std::size_t s = left_col - f.side[0].begin;
  const std::size_t t = right_col - f.side[1].begin;
  f.toward[0][t * static_cast<std::size_t>(f.side[0].size()) + s] = value;
  f.toward[1][s * static_cast<std::size_t>(f.side[1].size()) + t] = value;
}

void MaskedExchange::fill_kernels(const Groove& groove, const Sight& sees, int left_col) {
  std::vector<int> seen;
  for (int col = groove.left_cols; col < grid_.cols; ++col)
    if (sees(groove.distance[left_col], groove.distance[col])) seen.push_back(col);
  LaneSignal kernels(fft_.length());
  LaneSignal scratch(fft_.length());
  for (std::size_t first = 0; first < seen.size(); first += 2 * kFftLanes) {
    const std::size_t count = std::min(2 * kFftLanes, seen.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      sample_kernel(groove, left_col, seen[first + i], i % 2 == 0 ? kernels.re : kernels.im, i / 2);
    fft_.forward(kernels, scratch);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < frequencies_.size(); ++k)
        store_kernel(frequencies_[k], left_col, seen[first + i],
                     (i % 2 == 0 ? kernels.re : kernels.im)[k][i / 2]);
  }
}

/// Two real columns a and b share one complex signal z = a + i b. Their spectra are its even and odd parts:
/// A(k) = (Z(k) + Z*(−k)) / 2, B(k) = (Z(k) − Z*(−k)) / 2i.
void split(const LaneSignal& z, std::size_t k, std::size_t lane, std::size_t col, bool second,
           Spectrum& out) {
  const std::size_t mirrored = (z.re.size() - k) % z.re.size();
  const float re = z.re[k][lane];
  const float im = z.im[k][lane];
  const float mirrored_re = z.re[mirrored][lane];
  const float mirrored_im = z.im[mirrored][lane];
  out.re[k * out.cols + col] = 0.5F * (re + mirrored_re);
  out.im[k * out.cols + col] = 0.5F * (im - mirrored_im);
  if (!second) return;
  out.re[k * out.cols + col + 1] = 0.5F * (im + mirrored_im);
  out.im[k * out.cols + col + 1] = 0.5F * (mirrored_re - re);
}

void MaskedExchange::transform(std::span<const float> in, Spectrum& spectrum) const {
  LaneSignal z(fft_.length());
  LaneSignal scratch(fft_.length());
  const std::size_t cols = grid_.cols;
  for (std::size_t first = 0; first < cols; first += 2 * kFftLanes) {
    const std::size_t count = std::min(2 * kFftLanes, cols - first);
    std::fill(z.re.begin(), z.re.end(), FftLane{});
    std::fill(z.im.begin(), z.im.end(), FftLane{});
    for (std::size_t y = 0; y < static_cast<std::size_t>(grid_.rows); ++y)
      for (std::size_t i = 0; i < count; ++i) (i % 2 == 0 ? z.re : z.im)[y][i / 2] = in[y * cols + first + i];
    fft_.forward(z, scratch);
    for (std::size_t k = 0; k < frequencies_.size(); ++k)
      for (std::size_t i = 0; i < count; i += 2) split(z, k, i / 2, first + i, i + 1 < count, spectrum);
  }
}

/// out[to..] += Σ_from kernel[from][to] · in[from], for real and imaginary parts.
void multiply_side(const Frequency& f, int from, const float* in, float* out) {
  const ColumnRange& source = f.side[from];
  const ColumnRange& target = f.side[1 - from];
  const float* kernel = f.toward[1 - from].data();
  const std::size_t width = target.size();
  for (int col = source.begin; col < source.end; ++col, kernel += width)
    for (std::size_t i = 0; i < width; ++i)
      out[static_cast<std::size_t>(target.begin) + i] += kernel[i] * in[col];
}

void MaskedExchange::multiply(const Spectrum& in, Spectrum& out) const {
  for (std::size_t k = 0; k < frequencies_.size(); ++k) {
    for (int from = 0; from < 2; ++from) {
      multiply_side(frequencies_[k], from, &in.re[k * in.cols], &out.re[k * in.cols]);
      multiply_side(frequencies_[k], from, &in.im[k * in.cols], &out.im[k * in.cols]);
    }
  }
}

/// The inverse of split(), for k and −k.
void join(const Spectrum& in, std::size_t k, std::size_t lane, std::size_t col, bool second, LaneSignal& z) {
  const std::size_t mirrored = (z.re.size() - k) % z.re.size();
  const float a_re = in.re[k * in.cols + col];
  const float a_im = in.im[k * in.cols + col];
  const float b_re = second ? in.re[k * in.cols + col + 1] : 0.F;
  const float b_im = second ? in.im[k * in.cols + col + 1] : 0.F;
  z.re[mirrored][lane] = a_re + b_im;
  z.im[mirrored][lane] = b_re - a_im;
  z.re[k][lane] = a_re - b_im;
  z.im[k][lane] = a_im + b_re;
}

void MaskedExchange::transform_back(const Spectrum& spectrum, std::span<float> out) const {
  LaneSignal z(fft_.length());
  LaneSignal scratch(fft_.length());
  const std::size_t cols = grid_.cols;
  for (std::size_t first = 0; first < cols; first += 2 * kFftLanes) {
    const std::size_t count = std::min(2 * kFftLanes, cols - first);
    for (std::size_t k = 0; k < frequencies_.size(); ++k)
      for (std::size_t i = 0; i < count; i += 2) join(spectrum, k, i / 2, first + i, i + 1 < count, z);
    std::swap(z.re, z.im);
    fft_.forward(z, scratch);
    std::swap(z.re, z.im);
    for (std::size_t y = 0; y < static_cast<std::size_t>(grid_.rows); ++y)
      for (std::size_t i = 0; i < count; ++i)
        out[y * cols + first + i] = (i % 2 == 0 ? z.re : z.im)[y][i / 2];
  }
}

void MaskedExchange::apply(std::span<const float> in, std::span<float> out) const {
  Spectrum arriving(frequencies_.size(), grid_.cols);
  Spectrum leaving(frequencies_.size(), grid_.cols);
  transform(in, leaving);
  multiply(leaving, arriving);
  transform_back(arriving, out);
}

class ChamberedExchange final : public Exchange {
 public:
  ChamberedExchange(Grid grid, std::vector<Chamber> chambers) : grid_(grid), chambers_(std::move(chambers)) {}

  void apply(std::span<const float> in, std::span<float> out) const override {
    for (const Chamber& chamber : chambers_) {
      const std::size_t first =
          static_cast<std::size_t>(chamber.row_begin) * static_cast<std::size_t>(grid_.cols);
      const std::size_t last =
          static_cast<std::size_t>(chamber.row_end) * static_cast<std::size_t>(grid_.cols);
      chamber.exchange->apply(in.subspan(first, last - first), out.subspan(first, last - first));
    }
  }

 private:
  Grid grid_;
  std::vector<Chamber> chambers_;
};

}  // namespace

std::unique_ptr<Exchange> masked_exchange(const Groove& groove, const Sight& sees) {
  return std::make_unique<MaskedExchange>(groove, sees);
}

std::unique_ptr<Exchange> chambered_exchange(Grid grid, std::vector<Chamber> chambers) {
  return std::make_unique<ChamberedExchange>(grid, std::move(chambers));
}

namespace {

constexpr double kCrossFin = 0.37;                   // of the rows
constexpr double kFinBottom = 0.04, kFinTop = 0.15;  // of the columns

Groove with_rows(const Groove& groove, int rows) {
  return Groove({rows, groove.grid.cols});
}

}  // namespace

bool passes_hovering_fin(const Groove& groove, double s, double t) {
  const double height = s + t > 0 ? 2 * s * t / (s + t) : 0;
  return height < kFinBottom * groove.grid.cols || height > kFinTop * groove.grid.cols;
}

int row_of_cross_fin(const Groove& groove) {
  return static_cast<int>(kCrossFin * groove.grid.rows);
}

std::unique_ptr<Exchange> occluded_exchange(const Groove& groove) {
  const int cut = row_of_cross_fin(groove);
  const int rows = groove.grid.rows;
  const auto sees = [&groove](double s, double t) { return passes_hovering_fin(groove, s, t); };
  std::vector<Chamber> chambers;
  if (cut > 0) chambers.push_back({0, cut, open_exchange(with_rows(groove, cut))});
  chambers.push_back({cut, rows, masked_exchange(with_rows(groove, rows - cut), sees)});
  return chambered_exchange(groove.grid, std::move(chambers));
}

}  // namespace symrig::sim
