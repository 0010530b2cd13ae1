// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"

#include <algorithm>
#include <array>

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

}  // namespace symrig::report
