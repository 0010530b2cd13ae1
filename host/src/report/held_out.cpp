// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/summary.hpp"

#include <cmath>

namespace symrig {
namespace {

struct Lit {
  std::vector<bool> pixel;
  double mean_white = 0;
  std::int64_t pixels = 0;
};

double channel_mean(const Image<float>& image, std::size_t pixel) {
  double sum = 0;
  for (int c = 0; c < image.channels(); ++c) sum += image.plane(c)[pixel];
  return sum / image.channels();
}

/// Camera pixels that the projector lights: flood-lit prediction above a tenth of its mean.
Lit lit_pixels(const Image<float>& flood) {
  const std::size_t n = flood.grid().size();
  double mean = 0;
  for (std::size_t i = 0; i < n; ++i) mean += channel_mean(flood, i) / static_cast<double>(n);
  Lit lit{std::vector<bool>(n, false)};
  for (std::size_t i = 0; i < n; ++i) {
    const double white = channel_mean(flood, i);
    if (!(white > 0.1 * mean)) continue;
    lit.pixel[i] = true;
    lit.mean_white += white;
    ++lit.pixels;
  }
  if (lit.pixels > 0) lit.mean_white /= static_cast<double>(lit.pixels);
  return lit;
}

double rms_over(const Lit& lit, const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (int c = 0; c < a.channels(); ++c)
    for (std::size_t i = 0; i < lit.pixel.size(); ++i)
      if (lit.pixel[i]) sum += std::pow(static_cast<double>(a.plane(c)[i]) - b.plane(c)[i], 2);
  const double samples = static_cast<double>(lit.pixels) * a.channels();
  return samples > 0 ? std::sqrt(sum / samples) : 0;
}

}  // namespace

Result<HeldOutError> held_out_error(const TransportOperator& tensor, const HeldOut& held_out) {
  const bool fits = held_out.photograph.grid() == tensor.camera_grid() &&
                    held_out.photograph.channels() == tensor.channels();
  if (!fits)
    return Error{ErrorCode::size_mismatch,
                 "held-out photograph '" + held_out.name + "' is " + to_string(held_out.photograph.grid()) +
                     ", the tensor's camera " + to_string(tensor.camera_grid()),
                 "fit the scene again"};
  SYMRIG_TRY(const Image<float> predicted, tensor.apply(held_out.pattern));
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.0F)));
  const Lit lit = lit_pixels(flood);
  return HeldOutError{held_out.name, rms_over(lit, predicted, held_out.photograph), lit.mean_white,
                      lit.pixels};
}

}  // namespace symrig
