// SPDX-License-Identifier: Apache-2.0
// The top of the page: title, pictures and key numbers; and its end: how the file was made.

#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {

namespace {

std::string patterns_tile(const CaptureFacts& facts) {
  const auto patterns = count_at(facts, "/patterns");
  if (!patterns) return {};
  const auto brute = count_at(facts, "/patterns_brute_force");
  std::string meaning = "patterns";
  if (brute && patterns->value > 0)
    meaning += fmt::format("; one pixel at a time would need {}, {}× as many", grouped(brute->value),
                           short_number(brute->value / patterns->value));
  return tile(sourced_text(patterns, grouped), meaning);
}

bool simulated(const CaptureFacts& facts) {
  return facts.text("/scene").value_or("").starts_with("sim:");
}

std::string time_tile(const CaptureFacts& facts) {
  const auto rig = count_at(facts, "/rig_seconds");
  if (!rig) return {};
  const auto frames = count_at(facts, "/frames");
  return tile(
      sourced_text(rig, duration),
      std::string(simulated(facts) ? "simulated capture time, on the rig's clock" : "on the rig's clock") +
          (frames ? fmt::format(" ({} frames)", grouped(frames->value)) : std::string()));
}

std::string size_tile(const TransportTensor& tensor) {
  const auto bytes = static_cast<double>(tensor.bytes());
  return tile(number(bytes, "inspect:/tensor_bytes", byte_size(bytes)),
              fmt::format("tensor in memory; T as a full matrix: {}", byte_size(tensor.dense_bytes())));
}

/// Tiles of a fit: the number of photographs, and the worst prediction of a held-out one.
std::string photographs_tiles(const Context& context) {
  std::string html;
  if (const auto count = count_at(context.facts, "/photographs"))
    html += tile(sourced_text(count, grouped), "photographs");
  const auto worst = std::max_element(
      context.held_out.begin(), context.held_out.end(),
      [](const HeldOutError& a, const HeldOutError& b) { return a.relative() < b.relative(); });
  if (worst == context.held_out.end()) return html;
  return html + tile(number(worst->relative(),
                            fmt::format("evaluate:/held_out/{}/relative", worst - context.held_out.begin()),
                            percent(worst->relative())),
                     "of mean white: rms error of the worst held-out photograph");
}

/// The same of the camera's own pixels.
std::string own_error_tiles(const Context& context) {
  if (const auto& errors = context.options.own_pixels->errors)
    return tile(number(errors->value.frobenius, "evaluate:/camera/error/frobenius",
                       percent(errors->value.frobenius)),
                "error of T on the camera's pixels (relative, Frobenius), against the truth") +
           tile(number(errors->value.indirect, "evaluate:/camera/error/indirect",
                       percent(errors->value.indirect)),
                "error of the indirect light alone, against the truth");
  const auto estimate = count_at(context.facts, "/camera/estimated_error/frobenius");
  return estimate
             ? tile(sourced_text(estimate, percent),
                    "error of T on the camera's pixels (relative, Frobenius), as the capture estimated it")
             : std::string();
}

/// The main error: against the truth if that is known, else as the capture estimated it.
std::string error_tiles(const Context& context) {
  if (context.has_own_pixels()) return own_error_tiles(context);
  if (context.errors)
    return tile(number(context.errors->frobenius, "evaluate:/error/frobenius",
                       percent(context.errors->frobenius)),
                "error of T (relative, Frobenius), against the truth") +
           tile(number(context.errors->indirect, "evaluate:/error/indirect",
                       percent(context.errors->indirect)),
                "error of the indirect light alone, against the truth");
  const auto estimate = count_at(context.facts, "/estimated_error/frobenius");
  return estimate ? tile(sourced_text(estimate, percent),
                         "error of T (relative, Frobenius), as the capture estimated it")
                  : std::string();
}

std::string stop_tile(const CaptureFacts& facts) {
  const auto end = facts.text("/stopped_by");
  return end && *end != "done" ? tile(escape(*end), "the budget that ended the capture early")
                               : std::string();
}

Result<std::string> shown(const Context& context, const Image<float>& light, const std::string& name,
                          const std::string& caption) {
  SYMRIG_TRY(const Image<float> seen, context.picture(light));
  const float white = white_level(seen);
  return figure(
      photograph(shrunk(seen, kPictureSide), white),
      {.alt = name,
       .caption_html = fmt::format("<b>{}</b> White: radiance {}.", escape(caption), short_number(white)),
       .file = context.file(file_stem(name)),
       .values = &seen});
}

}  // namespace

std::string exact_or_empty(const std::optional<Sourced>& number) {
  return number ? exact(number->value) : std::string();
}

std::string sourced_text(const std::optional<Sourced>& sourced, std::string (*text)(double)) {
  if (!sourced) return {};
  const std::string shown_text = text(sourced->value);
  return sourced->from.empty() ? escape(shown_text)
                               : number(sourced->value, "capture:" + sourced->from, shown_text);
}

std::string headline(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  std::string text = escape(fmt::format("Light transport from a {} projector to a {} camera, {} channel{}",
                                        to_string(tensor.projector_grid()), to_string(tensor.camera_grid()),
                                        tensor.channels(), tensor.channels() == 1 ? "" : "s"));
  if (context.scene.camera)
    text += escape(fmt::format("; pictures of the camera's own {} pixels",
                               to_string(context.scene.camera->camera_grid())));
  if (const std::string missing = missing_pixels(context.scene); !missing.empty())
    text += "; pictures of the projector's cells, not of the camera's own pixels: " + breakable(missing);
  if (const auto scene = context.facts.text("/scene")) text += "; scene " + breakable(*scene);
  if (const auto algorithm = context.facts.text("/algorithm")) text += "; algorithm " + breakable(*algorithm);
  return fmt::format("<h1>{}</h1>\n<p class=\"lead\">{}.</p>\n", breakable(context.options.title), text);
}

Result<std::string> scene_pictures(const Context& context) {
  const Grid projector = context.tensor().projector_grid();
  SYMRIG_TRY(std::string flood, shown(context, Image<float>(projector, 1, 1.0F), "flood-lit",
                                      "Flood-lit: every projector pixel on."));
  SYMRIG_TRY(std::string bar,
             shown(context, bar_pattern(projector), "relit by a vertical bar", "Relit by a vertical bar."));
  SYMRIG_TRY(std::string letters,
             shown(context, letters_pattern(projector), "relit by letters", "Relit by letters."));
  return R"(<section id="scene" aria-label="The scene">)" +
         row_of({std::move(flood), std::move(bar), std::move(letters)}, 300) + "</section>\n";
}

std::string key_numbers(const Context& context) {
  return tiles(patterns_tile(context.facts) + time_tile(context.facts) + size_tile(context.tensor()) +
               photographs_tiles(context) + error_tiles(context) + stop_tile(context.facts));
}

namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

void add_text(Rows& rows, const CaptureFacts& facts, const char* path, const char* name) {
  if (const auto text = facts.text(path); text && !text->empty()) rows.emplace_back(name, breakable(*text));
}

void add_command(Rows& rows, const std::string& command, const char* name) {
  if (!command.empty()) rows.emplace_back(name, "<code>" + breakable(command) + "</code>");
}

}  // namespace

std::string made_section(const Context& context) {
  Rows rows;
  add_text(rows, context.facts, "/scene", "Scene");
  add_text(rows, context.facts, "/date", "Captured");
  add_text(rows, context.facts, "/version", "By symrig");
  add_command(rows, context.facts.text("/command_line").value_or(""), "Command");
  const Made& made = context.options.made;
  if (!made.date.empty()) rows.emplace_back("This page", escape(made.date));
  if (!made.version.empty()) rows.emplace_back("By symrig (page)", escape(made.version));
  add_command(rows, made.command_line, "Command (page)");
  const std::string json =
      "<details><summary>All that the capture wrote about itself</summary><pre class=\"wide\" "
      "tabindex=\"0\">" +
      escape(context.facts.json().dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) +
      "</pre></details>\n";
  return section("made", "How it was made", (rows.empty() ? std::string() : facts_table(rows)) + json);
}

}  // namespace symrig::report
