// SPDX-License-Identifier: Apache-2.0
// The scene under other lights, and the relit picture if the capture had ended after each level
// [Garg06 Fig. 11].

#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/report/text.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {

namespace {

/// The picture under one light, and the truth if it is known.
struct Relit {
  Image<float> light;
  Image<float> predicted;
  std::optional<Image<float>> truth;

  const Image<float>& best() const { return truth ? *truth : predicted; }
};

Result<Relit> relight(const Context& context, Image<float> light) {
  SYMRIG_TRY(Image<float> predicted, context.picture(light));
  Relit relit{std::move(light), std::move(predicted), std::nullopt};
  if (!context.true_picture()) return relit;
  SYMRIG_TRY(relit.truth, context.true_picture()(relit.light));
  return relit;
}

/// The same on the projector's cells.
Result<Relit> relight_cells(const Context& context, Image<float> light) {
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

/// The bar again, exposed for the pixels that only indirect light reaches. "Outside" is known on the cells of
/// a coaxial rig only.
Result<std::string> indirect_row(const Context& context) {
  if (context.tensor().camera_grid() != context.tensor().projector_grid()) return std::string();
  SYMRIG_TRY(const Relit bar, relight_cells(context, bar_pattern(context.tensor().projector_grid())));
  const float white = white_outside(bar);
  const float direct = white_level(bar.best());
  if (!(white > 1e-4F * direct)) return std::string();
  std::string html = paragraph(fmt::format(
      "The same bar{}, exposed {:.0f}× longer. Only light that bounced at least twice arrives outside "
      "the bar. The bar itself is overexposed.",
      context.has_own_pixels() ? " on the projector's cells" : "", direct / white));
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
  SYMRIG_TRY(const std::string indirect, indirect_row(context));
  html += "<h3>A vertical bar</h3>" + relit_row(context, bar, white_level(bar.best()), "a vertical bar") +
          indirect;
  SYMRIG_TRY(const Relit letters, relight(context, letters_pattern(projector)));
  return html + "<h3>Letters</h3>" + relit_row(context, letters, white_level(letters.best()), "letters");
}

/// Without a truth: lights that are not at the top of the page.
Result<std::string> more_lights(const Context& context) {
  constexpr unsigned kSeed = 9;
  const Grid projector = context.tensor().projector_grid();
  SYMRIG_TRY(const Relit natural, relight(context, natural_pattern(projector, kSeed)));
  SYMRIG_TRY(const std::string indirect, indirect_row(context));
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
  const bool known = static_cast<bool>(context.true_picture());
  SYMRIG_TRY(const std::string html, known ? compared(context) : more_lights(context));
  const std::string intro =
      known ? "The bar and the letters were not shown during the capture. Ground truth is the simulated "
              "scene itself, free of noise. Relative error: ‖relit − truth‖ / ‖truth‖."
            : "The scene under new light, computed from the tensor.";
  return section("lights", "Under new light", paragraph(intro) + html);
}

namespace {

/// Squared error of a tensor's predictions of its held-out photographs.
Result<double> misfit(const TransportTensor& tensor, const std::vector<HeldOut>& held_out) {
  double squares = 0;
  for (const HeldOut& one : held_out) {
    SYMRIG_TRY(const Image<float> predicted, tensor.apply(one.pattern));
    for (std::size_t i = 0; i < predicted.values().size(); ++i)
      squares += std::pow(static_cast<double>(predicted.values()[i]) - one.photograph.values()[i], 2);
  }
  return squares;
}

/// The tensor of a capture that stops at this level. As in a capture, the held-out photographs choose between
/// direct light and products inside blocks; direct light if there are none.
Result<TransportTensor> stopped(const StoredScene& scene, int level) {
  SYMRIG_TRY(TransportTensor direct, stopped_capture(scene.tensor, level, WithinBlocks::direct));
  if (scene.held_out.empty()) return direct;
  SYMRIG_TRY(TransportTensor product, stopped_capture(scene.tensor, level, WithinBlocks::product));
  SYMRIG_TRY(const double of_direct, misfit(direct, scene.held_out));
  SYMRIG_TRY(const double of_product, misfit(product, scene.held_out));
  return of_product < of_direct ? std::move(product) : std::move(direct);
}

/// The stage that measured the blocks of `level`: the stage before the levels, or the search of the level
/// above.
const Stage* stage_before(const Context& context, int level) {
  if (level == 0) return context.stages.size() > 1 ? &context.stages.front() : nullptr;
  const auto found = std::find_if(context.stages.begin(), context.stages.end(),
                                  [level](const Stage& stage) { return stage.level == level - 1; });
  return found != context.stages.end() ? &*found : nullptr;
}

/// The last level whose blocks the capture measured, according to the file.
int last_level(const Context& context) {
  const int deepest = context.tensor().camera_tree().levels() - 1;
  int last = -1;
  for (const Stage& stage : context.stages)
    if (stage.level) last = std::max(last, *stage.level + 1);
  return last < 0 ? deepest : std::min(last, deepest);
}

std::string when(const Context& context, int level) {
  const Stage* stage = stage_before(context, level);
  std::string text = level == 0 ? "Before the levels" : fmt::format("After level {}", level - 1);
  if (stage == nullptr || !stage->by_then) return text;
  return text + fmt::format(" ({} patterns)", sourced_text(stage->by_then, grouped));
}

}  // namespace

Result<std::string> pictures_by_level(const Context& context) {
  const Image<float> letters = letters_pattern(context.tensor().projector_grid());
  SYMRIG_TRY(Image<float> reference, context.tensor().apply(letters));
  if (context.has_truth()) {
    SYMRIG_TRY(reference, context.options.truth(letters));
  }
  const float white = white_level(reference);
  std::vector<std::string> figures;
  for (int level = 0; level <= last_level(context); ++level) {
    SYMRIG_TRY(const TransportTensor tensor, stopped(context.scene, level));
    SYMRIG_TRY(const Image<float> relit, tensor.apply(letters));
    const double off = relative_error(relit, reference);
    figures.push_back(figure(
        photograph(shrunk(relit, kSmallSide), white),
        {.alt = fmt::format("stopped with blocks of level {}", level),
         .caption_html = fmt::format("{}: error {}.", when(context, level),
                                     number(off, fmt::format("letters:/stopped/{}", level), percent(off))),
         .file = context.file(fmt::format("stopped-{}", level))}));
  }
  const std::string_view reference_name = context.has_truth() ? "ground truth" : "the finished tensor";
  return "<h3>Stopped at each level</h3>\n" +
         paragraph(fmt::format(
             "The letters, relit from a capture that stops there (<code>--max-patterns</code>), computed "
             "from the finished tensor. A pair of different blocks that would be divided further becomes one "
             "product of two pictures. A block with itself becomes direct light. So light that goes from the "
             "letters to other places in large blocks is spread over these blocks. Error: ‖relit − "
             "reference‖ / ‖reference‖ of this picture; the reference is {}.",
             reference_name)) +
         row_of(figures, 180);
}

}  // namespace symrig::report
