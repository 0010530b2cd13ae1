// SPDX-License-Identifier: Apache-2.0

#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
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

std::optional<Sourced> estimate_of(const Context& context, const ErrorKind& kind) {
  return count_at(context.facts, std::string("/estimated_error") + kind.path);
}

/// The uncertainty of the estimate, if it is in the file.
std::optional<Sourced> uncertainty_of(const Context& context, const ErrorKind& kind) {
  return uncertainty_at(context.facts, kind.path);
}

/// The reason that the capture gives, if it gives one.
std::string why_not_given(const Context& context, const ErrorKind& kind) {
  std::string key = std::string(kind.path).substr(1);
  std::replace(key.begin(), key.end(), '/', '.');
  const auto why = context.facts.text(("/estimated_error_not_given/" + key).c_str());
  return why ? "not given: " + *why : "not known";
}

std::string estimate_cell(const Context& context, const ErrorKind& kind) {
  const auto uncertainty = uncertainty_of(context, kind);
  const std::string estimate = sourced_text(estimate_of(context, kind), percent);
  if (estimate.empty()) return escape(why_not_given(context, kind));
  return uncertainty ? estimate + " ± " + sourced_text(uncertainty, percent) : estimate;
}

bool estimated(const Context& context) {
  return std::ranges::any_of(kErrorKinds,
                             [&](const ErrorKind& kind) { return estimate_of(context, kind).has_value(); });
}

std::string error_table(const Context& context) {
  const bool estimates = estimated(context);
  std::vector<std::string> head{"error"};
  if (estimates) head.emplace_back("estimated by the capture");
  if (context.errors) head.emplace_back("against the truth");
  head.emplace_back("meaning");
  std::vector<std::vector<std::string>> rows;
  Csv csv({"error", "estimated", "uncertainty", "against_truth"});
  for (const ErrorKind& kind : kErrorKinds) {
    std::vector<std::string> row{escape(kind.name)};
    if (estimates) row.push_back(estimate_cell(context, kind));
    const double truth = context.errors ? (*context.errors).*kind.truth : 0;
    if (context.errors)
      row.push_back(number(truth, std::string("evaluate:/error") + kind.path, percent(truth)));
    row.emplace_back(kind.meaning);
    rows.push_back(std::move(row));
    csv.add({kind.name, exact_or_empty(estimate_of(context, kind)),
             exact_or_empty(uncertainty_of(context, kind)), context.errors ? exact(truth) : std::string()});
  }
  return number_table_html("Errors", head, rows, Last::words) +
         save_row(csv.link(context.file("errors"), "errors"));
}

std::string intro(const Context& context) {
  std::string text =
      "Each error is ‖estimate − truth‖ / ‖truth‖. There are several, because each of them hides some "
      "faults.";
  if (estimated(context))
    text +=
        " The capture estimates them from photographs that it held out: this is all that a real rig can "
        "tell.";
  if (context.errors)
    text += " The truth is the exact transport of the simulated scene, without noise.";
  else
    text +=
        fmt::format(" The true transport of this scene is not known. {}", escape(context.options.no_truth));
  return paragraph(text);
}

}  // namespace

std::string errors_section(const Context& context) {
  if (context.errors || estimated(context))
    return section("errors", "Errors of the tensor",
                   intro(context) + error_table(context) + error_curves(context));
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
