// SPDX-License-Identifier: Apache-2.0
// The relit picture if the capture had ended after each level [Garg06 Fig. 11].
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"
#include "symrig/report/letters.hpp"
#include "symrig/tensor/stopped.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
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
