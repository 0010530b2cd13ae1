// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

namespace symrig::report {
namespace {

constexpr std::size_t kMostShown = 4;

/// Whether a photograph shows a pattern of single pixels, which is hard to judge by eye.
bool of_dots(const HeldOut& one) {
  return one.name.find("random") != std::string::npos || one.name.find("1/32") != std::string::npos ||
         one.name == "its complement";
}

/// Pictures first, dots last; else the order of the file.
std::vector<std::size_t> by_interest(const std::vector<HeldOut>& all) {
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_partition(order.begin(), order.end(), [&](std::size_t k) { return !of_dots(all[k]); });
  return order;
}

/// A table of all held-out photographs, including those without pictures.
std::string held_out_table(const Context& context) {
  std::vector<std::vector<std::string>> rows;
  Csv csv({"photograph", "relative", "rms", "mean_white", "lit_pixels"});
  constexpr std::size_t kMostRows = 200;
  for (std::size_t k = 0; k < std::min(context.held_out.size(), kMostRows); ++k) {
    const HeldOutError& error = context.held_out[k];
    const auto from = [k](const char* key) { return fmt::format("evaluate:/held_out/{}/{}", k, key); };
    rows.push_back({escape(error.name), number(error.relative(), from("relative"), percent(error.relative())),
                    number(error.rms, from("rms"), short_number(error.rms)),
                    number(error.mean_white, from("mean_white"), short_number(error.mean_white))});
    csv.add({error.name, exact(error.relative()), exact(error.rms), exact(error.mean_white),
             exact(static_cast<double>(error.lit_pixels))});
  }
  return number_table_html("Held-out photographs", {"photograph", "rms of mean white", "rms", "mean white"},
                           rows) +
         save_row(csv.link(context.file("held-out"), "held-out photographs"));
}

Result<std::string> held_out_row(const Context& context, std::size_t k) {
  const TransportTensor& tensor = context.tensor();
  const HeldOut& one = context.scene.held_out[k];
  const HeldOutError& error = context.held_out[k];
  const std::string file = context.file(fmt::format("held-out-{}", k + 1));
  const auto from = [k](const char* key) { return fmt::format("evaluate:/held_out/{}/{}", k, key); };
  SYMRIG_TRY(const Image<float> predicted, tensor.apply(one.pattern));
  const float white = white_level(one.photograph);
  const Image<float> off = shrunk(difference(predicted, one.photograph), kSmallSide);
  const float top = white_level(off, 0.999);
  const auto shown = [&](const Image<float>& image, float level, const char* alt, const std::string& caption,
                         const char* what) {
    return figure(photograph(shrunk(image, kSmallSide), level),
                  {.alt = alt, .caption_html = caption, .file = file + what});
  };
  const std::vector<std::string> figures{
      shown(one.pattern, 1, "pattern", "The pattern on the projector.", "-pattern"),
      shown(
          one.photograph, white, "held-out photograph",
          fmt::format("The photograph. White: {} (units of the photographs' radiance).", short_number(white)),
          "-photograph"),
      shown(predicted, white, "prediction", "Predicted by the tensor, same exposure.", "-prediction"),
      figure(false_colour(off, top),
             {.alt = "difference",
              .caption_html = fmt::format(
                  "|prediction − photograph|. Rms over the {} lit pixels: {}, that is {} of mean white ({}).",
                  number(static_cast<double>(error.lit_pixels), from("lit_pixels"),
                         grouped(static_cast<double>(error.lit_pixels))),
                  number(error.rms, from("rms"), short_number(error.rms)),
                  number(error.relative(), from("relative"), percent(error.relative())),
                  number(error.mean_white, from("mean_white"), short_number(error.mean_white))),
              .scale_html = colour_scale("0", short_number(top)),
              .file = file + "-difference"})};
  return "<h3>" + escape(one.name) + "</h3>" + row_of(figures, 260);
}

}  // namespace

Result<std::string> held_out_section(const Context& context) {
  const std::vector<HeldOut>& all = context.scene.held_out;
  if (all.empty()) return std::string();
  std::string html = paragraph(fmt::format(
      "Photographs that the fit did not use ({}{}), compared with the prediction of the tensor. Lit "
      "pixels have a flood-lit prediction above a tenth of its mean.",
      all.size(), all.size() > kMostShown ? fmt::format(", {} shown", kMostShown) : ""));
  html += held_out_table(context);
  const std::vector<std::size_t> order = by_interest(all);
  for (std::size_t k = 0; k < std::min(kMostShown, all.size()); ++k) {
    SYMRIG_TRY(const std::string row, held_out_row(context, order[k]));
    html += row;
  }
  return section("held-out", "Held-out photographs", html);
}

}  // namespace symrig::report
