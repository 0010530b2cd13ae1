// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
namespace {

// One style for screen (light and dark), phone and paper. Colours by role; charts use the same names.
constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --paper: #fcfcfa; --ink: #1d2126; --soft: #5b6570; --line: #d8dade; --card: #f1f2f0;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #ffffff; --accent: #b5452f; }
@media (prefers-color-scheme: dark) { :root { --paper: #15181c; --ink: #e6e8ea; --soft: #9aa4ae; --line: #343a41;
  --card: #1e2328; --rank1: #5b9be0; --lowrank: #4cc3b2; --empty: #767d85; --scalar: #e8a450; --split: #15181c;
  --accent: #ef8a72; } }
@media print { :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --line: #bbb; --card: #fff;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #fff; --accent: #b5452f; }
  figure, tr, .tile, svg { break-inside: avoid; } h2 { break-after: avoid; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem clamp(0.8rem, 3vw, 2rem) 3rem; max-width: 72rem; background: var(--paper);
  color: var(--ink); font: 1rem/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0.4rem 0 0.2rem; }
h2 { font-size: 1.2rem; margin: 2.4rem 0 0.4rem; padding-top: 0.6rem; border-top: 1px solid var(--line); }
p { max-width: 46rem; margin: 0.4rem 0 0.9rem; }
.lead, figcaption, .note { color: var(--soft); }
.note { font-size: 0.9rem; }
code { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.9em; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)); gap: 0.7rem; margin: 1.2rem 0 0.6rem; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.6rem 0.8rem; }
.tile b { display: block; font-size: 1.35rem; line-height: 1.25; }
.tile span { display: block; font-size: 0.85rem; color: var(--soft); line-height: 1.35; }
.figures { display: grid; gap: 1rem; align-items: start; margin: 0.8rem 0 1.2rem; }
figure { margin: 0; }
figure img { display: block; width: 100%; height: auto; max-height: 34rem; object-fit: contain; object-position: left;
  background: #000; image-rendering: pixelated; }
figcaption { font-size: 0.88rem; line-height: 1.4; margin-top: 0.35rem; }
.scale { display: flex; align-items: center; gap: 0.4rem; margin-top: 0.35rem; font-size: 0.82rem; color: var(--soft); }
.scale i { flex: 1; height: 0.7rem; border: 1px solid var(--line); print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
.scale em { flex: 1; font-style: normal; text-align: center; border: 1px solid var(--line); line-height: 1.3;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
table { border-collapse: collapse; font-size: 0.92rem; margin: 0.6rem 0 1rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: 0.25rem 0.8rem 0.25rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th:first-child, td:first-child { text-align: left; }
table.facts td, table.facts th { text-align: left; font-weight: normal; }
table.facts th { color: var(--soft); padding-right: 1.2rem; overflow-wrap: normal; }
.wide { overflow-x: auto; } .wide table { overflow-wrap: normal; } .wide td:first-child { white-space: nowrap; }
svg { display: block; width: 100%; height: auto; max-width: 36rem; margin: 0.6rem 0; print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
svg text { fill: var(--ink); font: 12px system-ui, "DejaVu Sans", sans-serif; }
svg .soft { fill: var(--soft); } svg .axis { stroke: var(--line); }
.legend { display: flex; flex-wrap: wrap; gap: 0.2rem 1rem; font-size: 0.88rem; }
.legend i { display: inline-block; width: 0.85rem; height: 0.85rem; margin-right: 0.35rem; vertical-align: -0.1rem;
  border: 1px solid var(--line); print-color-adjust: exact; -webkit-print-color-adjust: exact; }
footer { margin-top: 3rem; border-top: 1px solid var(--line); padding-top: 0.6rem; font-size: 0.88rem; color: var(--soft); }
)";

std::string css(Rgb c) {
  return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else
      out += c;
  }
  return out;
}

std::string figure(const Picture& picture, std::string_view alt, std::string_view caption_html,
                   std::string_view scale_html) {
  return fmt::format(
      "<figure><img src=\"{}\" alt=\"{}\" width=\"{}\" "
      "height=\"{}\">{}<figcaption>{}</figcaption></figure>\n",
      data_uri(picture), escape(alt), picture.grid().cols, picture.grid().rows, scale_html, caption_html);
}

std::string row_of(const std::vector<std::string>& figures, int least) {
  // On a phone, small pictures stay two in a row, so that a picture and its truth are seen together.
  const char* narrow = least < 300 ? "46%" : "100%";
  std::string html = fmt::format(
      "<div class=\"figures\" style=\"grid-template-columns:repeat(auto-fill,minmax(min({}px,{}),1fr))\">\n",
      least, narrow);
  for (const std::string& one : figures) html += one;
  return html + "</div>\n";
}

std::string colour_scale(std::string_view dark, std::string_view bright) {
  std::string stops;
  for (int k = 0; k <= 16; ++k) stops += fmt::format("{}{}", k == 0 ? "" : ",", css(colour_of(k / 16.0)));
  return fmt::format(
      "<div class=\"scale\">{}<i style=\"background:linear-gradient(to right,{})\"></i>{}</div>",
      escape(dark), stops, escape(bright));
}

std::string level_scale(int deepest) {
  std::string html = "<div class=\"scale\">level ";
  for (int level = 0; level <= deepest; ++level) {
    const Rgb grey = level_grey(level, deepest);
    html += fmt::format("<em style=\"background:{};color:{}\">{}</em>", css(grey),
                        grey[0] > 128 ? "#000" : "#fff", level);
  }
  return html + "</div>";
}

std::string section(std::string_view id, std::string_view heading, std::string_view body_html) {
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", escape(id), escape(heading),
                     body_html);
}

std::string paragraph(std::string_view html) {
  return fmt::format("<p>{}</p>\n", html);
}

std::string facts_table(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string html = "<table class=\"facts\">\n";
  for (const auto& [name, value] : rows)
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(name), value);
  return html + "</table>\n";
}

std::string number_table(const std::vector<std::string>& head,
                         const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"wide\"><table><tr>";
  for (const std::string& cell : head) html += "<th scope=\"col\">" + escape(cell) + "</th>";
  html += "</tr>\n";
  for (const auto& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escape(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string page(std::string_view title, std::string_view body_html) {
  std::string body(body_html);
  constexpr std::string_view kNumberSpace = "\xC2\xA0%";  // a number and its percent sign stay on one line
  for (std::size_t at = body.find(" %"); at != std::string::npos; at = body.find(" %", at))
    body.replace(at, 2, kNumberSpace);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style></head>\n<body>\n{}</body></html>\n",
      escape(title), kStyle, body);
}

}  // namespace symrig::report
