// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/sections.hpp"

#include <array>

#include <fmt/format.h>

namespace symrig::report {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

std::string against_truth(const TransportErrors& e) {
  const auto row = [](const char* name, double error, const char* meaning) {
    return std::pair<std::string, std::string>(name, fmt::format("<b>{}</b> {}", percent(error), meaning));
  };
  const Rows rows{
      row("frobenius", e.frobenius, "of T as a whole; the bright direct light dominates it"),
      row("indirect", e.indirect,
          "of the transport between lit cells and other cells: no direct light in it"),
      row("flood", e.flood, "under all-positive light: shows a bias that random tests average away"),
      row("relight, bar", e.relight_bar, "a vertical bar, an eighth of the width"),
      row("relight, random", e.relight_random, "a random black-and-white pattern"),
      row("relight, natural", e.relight_natural, "a smooth textured picture"),
      row("bar, indirect", e.bar_indirect, "the bar, seen only outside it"),
  };
  return paragraph(
             "Each is ‖estimate − truth‖ / ‖truth‖ against the exact transport of the "
             "simulated scene, noise-free. "
             "Several, because each hides something.") +
         facts_table(rows);
}

/// The same errors as the capture itself estimated them; empty if it did not.
std::string own_estimate(const CaptureFacts& facts) {
  constexpr std::array<std::pair<const char*, const char*>, 7> kNames{
      {{"frobenius", "/estimated_error/frobenius"},
       {"indirect", "/estimated_error/indirect"},
       {"flood", "/estimated_error/flood"},
       {"relight, bar", "/estimated_error/relight/bar"},
       {"relight, random", "/estimated_error/relight/random"},
       {"relight, natural", "/estimated_error/relight/natural"},
       {"bar, indirect", "/estimated_error/bar_indirect"}}};
  Rows rows;
  for (const auto& [name, path] : kNames)
    if (const auto error = facts.number(path)) rows.emplace_back(name, percent(*error));
  if (rows.empty()) return {};
  return "<h3>As the capture estimated them</h3>" +
         paragraph("From photographs that it held out: this is all that a real rig can tell.") +
         facts_table(rows);
}

}  // namespace

std::string errors_section(const Context& context) {
  const std::string estimate = own_estimate(context.facts);
  if (context.errors) return section("errors", "Errors", against_truth(*context.errors) + estimate);
  if (!estimate.empty()) return section("errors", "Errors", estimate);
  if (!context.scene.held_out.empty()) return {};
  return section("errors", "Errors",
                 paragraph(fmt::format("The true transport of this scene is not known. {}",
                                       escape(context.options.no_truth))));
}

}  // namespace symrig::report
