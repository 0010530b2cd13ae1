// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"
#include "symrig/report/letters.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
namespace {

/// The tensor's picture under one light, and the truth if it is known.
struct Relit {
  Image<float> light;
  Image<float> predicted;
  std::optional<Image<float>> truth;

  const Image<float>& best() const { return truth ? *truth : predicted; }
};

Result<Relit> relight(const Context& context, Image<float> light) {
  SYMRIG_TRY(Image<float> predicted, context.tensor().apply(light));
  Relit relit{std::move(light), std::move(predicted), std::nullopt};
  if (!context.has_truth()) return relit;
  SYMRIG_TRY(relit.truth, context.options.truth(relit.light));
  return relit;
}

/// file: empty if the page saves it elsewhere.
std::string relit_figure(const Image<float>& image, float white, const std::string& alt,
                         const std::string& caption, const std::string& file = {}) {
  return figure(photograph(shrunk(image, kSmallSide), white),
                {.alt = alt, .caption_html = caption, .file = file});
}

std::string difference_figure(const Relit& relit, const std::string& file) {
  const Image<float> off = difference(relit.predicted, *relit.truth);
  const float top = *std::max_element(off.values().begin(), off.values().end());
  const float white = white_level(*relit.truth);
  const std::string caption = fmt::format(
      "|relit − truth|, the bright end is its largest value: {} of the truth's white. Relative error {}.",
      percent(white > 0 ? top / white : 0), percent(relative_error(relit.predicted, *relit.truth)));
  return figure(false_colour(shrunk(off, kSmallSide), top),
                {.alt = "difference",
                 .caption_html = caption,
                 .scale_html = colour_scale("0", short_number(top)),
                 .file = file});
}

std::string relit_row(const Context& context, const Relit& relit, float white, const std::string& what) {
  const std::string file = context.file(file_stem(what));
  std::vector<std::string> figures{
      relit_figure(relit.light, 1, "light: " + what, "The light: " + what + ".", file + "-light"),
      relit_figure(relit.predicted, white, "relit",
                   fmt::format("Relit from the tensor. White: radiance {}.", short_number(white)),
                   file + "-relit")};
  if (relit.truth) {
    figures.push_back(relit_figure(*relit.truth, white, "ground truth",
                                   "Ground truth under the same light, same exposure.", file + "-truth"));
    figures.push_back(difference_figure(relit, file + "-difference"));
  }
  return row_of(figures, relit.truth ? 210 : 280);
}

/// The radiance that is shown as white if only the pixels outside the light set the exposure.
float white_outside(const Relit& relit) {
  Image<float> outside = relit.best();
  for (int c = 0; c < outside.channels(); ++c)
    for (std::size_t i = 0; i < relit.light.values().size(); ++i)
      if (relit.light.values()[i] > 0) outside.plane(c)[i] = 0;
  return white_level(outside);
}

/// The bar again, exposed for the pixels that only indirect light reaches. "Outside" is known on a coaxial
/// rig only.
std::string indirect_row(const Context& context, const Relit& bar) {
  if (context.tensor().camera_grid() != context.tensor().projector_grid()) return {};
  const float white = white_outside(bar);
  const float direct = white_level(bar.best());
  if (!(white > 1e-4F * direct)) return {};
  std::string html = paragraph(fmt::format(
      "The same bar, exposed {:.0f}× longer. Only light that bounced at least twice arrives outside "
      "the bar. The bar itself is overexposed.",
      direct / white));
  std::vector<std::string> figures{relit_figure(bar.predicted, white, "relit, exposed for indirect light",
                                                "Relit from the tensor.", context.file("bar-indirect"))};
  if (bar.truth)
    figures.push_back(relit_figure(*bar.truth, white, "ground truth, exposed for indirect light",
                                   "Ground truth.", context.file("bar-indirect-truth")));
  return html + row_of(figures, 280);
}

Result<std::string> flood_row(const Context& context) {
  SYMRIG_TRY(const Relit flood, relight(context, Image<float>(context.tensor().projector_grid(), 1, 1.0F)));
  const float white = white_level(flood.best());
  return row_of(
      {relit_figure(
           flood.predicted, white, "flood-lit, relit",
           fmt::format("Flood-lit: every projector pixel on. White: radiance {} per unit of projector light.",
                       short_number(white))),
       relit_figure(*flood.truth, white, "ground truth, flood-lit", "Ground truth, flood-lit, same exposure.",
                    context.file("flood-lit-truth")),
       difference_figure(flood, context.file("flood-lit-difference"))},
      260);
}

/// Pictures beside the truth.
Result<std::string> compared(const Context& context) {
  const Grid projector = context.tensor().projector_grid();
  SYMRIG_TRY(std::string html, flood_row(context));
  SYMRIG_TRY(const Relit bar, relight(context, bar_pattern(projector)));
  html += "<h3>A vertical bar</h3>" + relit_row(context, bar, white_level(bar.best()), "a vertical bar") +
          indirect_row(context, bar);
  SYMRIG_TRY(const Relit letters, relight(context, letters_pattern(projector)));
  return html + "<h3>Letters</h3>" + relit_row(context, letters, white_level(letters.best()), "letters");
}

/// Without a truth: lights that are not at the top of the page.
Result<std::string> more_lights(const Context& context) {
  constexpr unsigned kSeed = 9;
  const Grid projector = context.tensor().projector_grid();
  SYMRIG_TRY(const Relit natural, relight(context, natural_pattern(projector, kSeed)));
  SYMRIG_TRY(const Relit bar, relight(context, bar_pattern(projector)));
  const std::string indirect = indirect_row(context, bar);
  return "<h3>A smooth picture</h3>" +
         relit_row(context, natural, white_level(natural.best()), "a smooth picture") +
         (indirect.empty() ? indirect : "<h3>A vertical bar</h3>" + indirect);
}

}  // namespace

double relative_error(const Image<float>& estimate, const Image<float>& truth) {
  double off = 0;
  double all = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    off += std::pow(static_cast<double>(estimate.values()[i]) - truth.values()[i], 2);
    all += std::pow(static_cast<double>(truth.values()[i]), 2);
  }
  return all > 0 ? std::sqrt(off / all) : 0;
}

Result<std::string> lights_section(const Context& context) {
  SYMRIG_TRY(const std::string html, context.has_truth() ? compared(context) : more_lights(context));
  const std::string intro =
      context.has_truth()
          ? "The bar and the letters were not shown during the capture. Ground truth is the simulated "
            "scene itself, free of noise. Relative error: ‖relit − truth‖ / ‖truth‖."
          : "The scene under new light, computed from the tensor.";
  return section("lights", "Under new light", paragraph(intro) + html);
}

}  // namespace symrig::report
