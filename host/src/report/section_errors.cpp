// SPDX-License-Identifier: Apache-2.0

#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

namespace symrig::report {

namespace {

struct ErrorKind {
  const char* name;
  const char* path;  ///< below /error of evaluate and /estimated_error of capture
  double TransportErrors::*truth;
  const char* meaning;
};

constexpr std::array<ErrorKind, 7> kErrorKinds{
    {{"frobenius", "/frobenius", &TransportErrors::frobenius,
      "all of T; the bright direct light dominates it"},
     {"indirect", "/indirect", &TransportErrors::indirect,
      "light between lit pixels and other pixels: no direct light"},
     {"flood", "/flood", &TransportErrors::flood,
      "under all-positive light: shows a bias that random patterns average away"},
     {"relight, bar", "/relight/bar", &TransportErrors::relight_bar,
      "a vertical bar, an eighth of the width"},
     {"relight, random", "/relight/random", &TransportErrors::relight_random,
      "a random black-and-white pattern"},
     {"relight, natural", "/relight/natural", &TransportErrors::relight_natural, "a smooth textured picture"},
     {"bar, indirect", "/bar_indirect", &TransportErrors::bar_indirect, "the bar's light outside the bar"}}};

/// The errors of T on one kind of pixels.
struct ErrorsOn {
  const CaptureFacts& facts;
  std::string at;                         ///< JSON pointer of the capture's estimates: "" or "/camera"
  std::optional<TransportErrors> errors;  ///< against the truth
  std::string caption, file;

  std::optional<Sourced> estimate(const ErrorKind& kind) const {
    return count_at(facts, at + "/estimated_error" + kind.path);
  }
  /// Of the estimate, if it is in the file.
  std::optional<Sourced> uncertainty(const ErrorKind& kind) const {
    return uncertainty_at(facts, at, kind.path);
  }
  /// The reason that the capture gives, if it gives one.
  std::string why_not_given(const ErrorKind& kind) const {
    std::string key = std::string(kind.path).substr(1);
    std::replace(key.begin(), key.end(), '/', '.');
    const auto why = facts.text((at + "/estimated_error_not_given/" + key).c_str());
    return why ? "not given: " + *why : "not known";
  }
  bool estimated() const {
    return std::ranges::any_of(kErrorKinds,
                               [&](const ErrorKind& kind) { return estimate(kind).has_value(); });
  }
};

ErrorsOn on_cells(const Context& context) {
  return {context.facts, "", context.errors,
          context.has_own_pixels() ? "Errors on the projector's cells" : "Errors", "errors"};
}

ErrorsOn on_own_pixels(const Context& context) {
  const auto& errors = context.options.own_pixels->errors;
  return {context.facts, "/camera", errors ? std::optional(errors->value) : std::nullopt,
          "Errors on the camera's own pixels", "camera-errors"};
}

std::string estimate_cell(const ErrorsOn& on, const ErrorKind& kind) {
  const auto uncertainty = on.uncertainty(kind);
  const std::string estimate = sourced_text(on.estimate(kind), percent);
  if (estimate.empty()) return escape(on.why_not_given(kind));
  return uncertainty ? estimate + " ± " + sourced_text(uncertainty, percent) : estimate;
}

bool estimated(const Context& context) {
  return on_cells(context).estimated();
}

std::string error_table(const Context& context, const ErrorsOn& on) {
  const bool estimates = on.estimated();
  std::vector<std::string> head{"error"};
  if (estimates) head.emplace_back("estimated by the capture");
  if (on.errors) head.emplace_back("against the truth");
  head.emplace_back("meaning");
  std::vector<std::vector<std::string>> rows;
  Csv csv({"error", "estimated", "uncertainty", "against_truth"});
  for (const ErrorKind& kind : kErrorKinds) {
    std::vector<std::string> row{escape(kind.name)};
    if (estimates) row.push_back(estimate_cell(on, kind));
    const double truth = on.errors ? (*on.errors).*kind.truth : 0;
    if (on.errors) row.push_back(number(truth, "evaluate:" + on.at + "/error" + kind.path, percent(truth)));
    row.emplace_back(kind.meaning);
    rows.push_back(std::move(row));
    csv.add({kind.name, exact_or_empty(on.estimate(kind)), exact_or_empty(on.uncertainty(kind)),
             on.errors ? exact(truth) : std::string()});
  }
  const std::string heading = context.has_own_pixels() ? "<h3>" + escape(on.caption) + "</h3>\n" : "";
  return heading + number_table_html(on.caption, head, rows, Last::words) +
         save_row(csv.link(context.file(on.file), "errors"));
}

std::string intro(const Context& context) {
  std::string text =
      "Each error is ‖estimate − truth‖ / ‖truth‖. There are several, because each of them hides some "
      "faults.";
  if (estimated(context) || (context.has_own_pixels() && on_own_pixels(context).estimated()))
    text +=
        " The capture estimates them from photographs that it held out: this is all that a real rig can "
        "tell.";
  if (context.errors)
    text += " The truth is the exact transport of the simulated scene, without noise.";
  else
    text +=
        fmt::format(" The true transport of this scene is not known. {}", escape(context.options.no_truth));
  if (context.has_own_pixels())
    text +=
        " The pictures of this page are on the camera's own pixels. Its levels, slices and held-out "
        "photographs are on the projector's cells.";
  return paragraph(text);
}

/// Where the rows of the camera's pixels do not explain the photographs. Empty if the file does not tell it.
std::string chi_square_map(const Context& context) {
  const Image<float> chi_square = context.scene.camera->chi_square();
  if (chi_square.empty()) return {};
  constexpr float kBrightest = 9;
  Image<float> map(chi_square.grid());
  std::vector<float> known;
  for (int c = 0; c < chi_square.channels(); ++c)
    for (std::size_t i = 0; i < map.values().size(); ++i)
      map.values()[i] = std::max(map.values()[i], chi_square.plane(c)[i]);
  std::ranges::copy_if(map.values(), std::back_inserter(known), [](float one) { return one > 0; });
  if (known.empty()) return {};
  const auto above = std::ranges::count_if(known, [](float one) { return one > kBrightest; });
  const std::string caption = fmt::format(
      "<b>Chi-square of each pixel.</b> Mean of (photograph − row · light)² / variance over the held-out "
      "photographs. About 1: the row is as good as the photographs. Median: {}. More than {}: {} of the "
      "pixels. There the light comes from elsewhere than the cells foretell, or the scene has moved. 0: no "
      "row, or no "
      "photograph tells it.",
      short_number(median(known)), short_number(kBrightest),
      percent(static_cast<double>(above) / static_cast<double>(known.size())));
  return row_of({figure(false_colour(shrunk(map, kPictureSide), kBrightest),
                        {.alt = "chi-square of each pixel",
                         .caption_html = caption,
                         .scale_html = colour_scale("0", short_number(kBrightest) + " and more"),
                         .file = context.file("chi-square"),
                         .values = &map})},
                420);
}

/// The camera's own pixels first: the pictures of the page are theirs.
std::string error_tables(const Context& context) {
  if (!context.has_own_pixels()) return error_table(context, on_cells(context));
  return error_table(context, on_own_pixels(context)) + chi_square_map(context) +
         error_table(context, on_cells(context));
}

}  // namespace

std::string errors_section(const Context& context) {
  const bool own =
      context.has_own_pixels() && (context.options.own_pixels->errors || on_own_pixels(context).estimated());
  if (context.errors || estimated(context) || own)
    return section("errors", "Errors of the tensor",
                   intro(context) + error_tables(context) + error_curves(context));
  std::string text =
      fmt::format("The true transport of this scene is not known. {}", escape(context.options.no_truth));
  if (context.scene.held_out.empty())
    text += " The file contains no photograph to compare with, and no estimate of the error.";
  else
    text += " The held-out photographs below show its prediction error.";
  return section("errors", "Errors of the tensor",
                 paragraph(text + " So there is no curve of the error over patterns or seconds."));
}

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
