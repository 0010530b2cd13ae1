// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
namespace {

constexpr std::size_t kMostShown = 4;

Result<std::string> held_out_row(const TransportTensor& tensor, const HeldOut& one,
                                 const HeldOutError& error) {
  SYMRIG_TRY(const Image<float> predicted, tensor.apply(one.pattern));
  const float white = white_level(one.photograph);
  const Image<float> off = shrunk(difference(predicted, one.photograph), kPictureSide);
  const float top = white_level(off, 0.999);
  const auto shown = [&](const Image<float>& image, float level, const char* alt,
                         const std::string& caption) {
    return figure(photograph(shrunk(image, kPictureSide), level), alt, caption);
  };
  const std::vector<std::string> figures{
      shown(one.pattern, 1, "pattern", "The pattern on the projector."),
      shown(one.photograph, white, "held-out photograph",
            fmt::format("The photograph. White: {} (units of the photographs' radiance).",
                        short_number(white))),
      shown(predicted, white, "prediction", "Predicted by the tensor, same exposure."),
      figure(false_colour(off, top), "difference",
             fmt::format(
                 "|prediction − photograph|. Rms over the {} lit pixels: {}, that is {} of mean white ({}).",
                 grouped(static_cast<double>(error.lit_pixels)), short_number(error.rms),
                 percent(error.relative()), short_number(error.mean_white)),
             colour_scale("0", short_number(top)))};
  return "<h3>" + escape(one.name) + "</h3>" + row_of(figures, 260);
}

}  // namespace

Result<std::string> held_out_section(const Context& context) {
  const std::vector<HeldOut>& all = context.scene.held_out;
  if (all.empty()) return std::string();
  std::string html = paragraph(fmt::format(
      "Photographs that were kept out of the fit ({}{}): what the tensor predicts for their patterns, and "
      "how far off it is. "
      "Lit pixels: flood-lit prediction above a tenth of its mean.",
      all.size(), all.size() > kMostShown ? fmt::format(", the first {} shown", kMostShown) : ""));
  for (std::size_t k = 0; k < std::min(kMostShown, all.size()); ++k) {
    SYMRIG_TRY(const std::string row, held_out_row(context.tensor(), all[k], context.held_out[k]));
    html += row;
  }
  return section("held-out", "Held-out photographs", html);
}

}  // namespace symrig::report
