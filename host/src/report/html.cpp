// SPDX-License-Identifier: Apache-2.0

#include "report/html.hpp"

#include "symrig/image/file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace symrig::report {

namespace {

/// One style for screen (light and dark), phone and paper. Colours by role; charts use the same names.
extern const std::string_view kPageStyle;

const std::string_view kPageStyle = R"(
:root { color-scheme: light dark; --paper: #fcfcfa; --ink: #1d2126; --soft: #56606b; --line: #d8dade; --card: #f1f2f0;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #ffffff; --accent: #b5452f; }
@media (prefers-color-scheme: dark) { :root { --paper: #15181c; --ink: #e6e8ea; --soft: #a3adb7; --line: #343a41;
  --card: #1e2328; --rank1: #5b9be0; --lowrank: #4cc3b2; --empty: #767d85; --scalar: #e8a450; --split: #15181c;
  --accent: #ef8a72; } }
@media print { :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --line: #bbb; --card: #fff;
  --rank1: #2f6fb5; --lowrank: #2a9d8f; --empty: #a9afb6; --scalar: #e0912f; --split: #fff; --accent: #b5452f; }
  figure, tr, .tile, svg { break-inside: avoid; } h2, h3 { break-after: avoid; } nav, .save, .skip { display: none; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0 auto; padding: 1.2rem clamp(0.9rem, 3vw, 2rem) 3rem; max-width: 76rem; background: var(--paper);
  color: var(--ink); font: 1rem/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; overflow-wrap: break-word; }
h1 { font-size: clamp(1.5rem, 4vw, 2rem); line-height: 1.2; margin: 0.2rem 0 0.3rem; }
h2 { font-size: 1.3rem; margin: 2.8rem 0 0.5rem; padding-top: 0.8rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 0.3rem; }
p { max-width: 46rem; margin: 0.4rem 0 0.9rem; }
a { color: var(--rank1); }
a:focus-visible, summary:focus-visible, .wide:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
.skip { position: absolute; left: -100rem; } .skip:focus { position: static; }
nav { display: flex; flex-wrap: wrap; gap: 0.2rem 1.1rem; margin: 0.6rem 0 1rem; font-size: 0.95rem; }
nav a { padding: 0.2rem 0; }
.lead, figcaption, .note { color: var(--soft); }
.note { font-size: 0.9rem; }
code, pre { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.9em; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(11rem, 46%), 1fr)); gap: 0.7rem;
  margin: 1.2rem 0 0.6rem; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.6rem 0.8rem; min-width: 0; }
.tile b { display: block; font-size: 1.35rem; line-height: 1.25; }
.tile span { display: block; font-size: 0.85rem; color: var(--soft); line-height: 1.35; }
.figures { display: grid; gap: 1.1rem; align-items: start; margin: 0.8rem 0 1.2rem; }
figure { margin: 0; min-width: 0; }
figure img { display: block; width: 100%; height: auto; max-height: 34rem; object-fit: contain; object-position: left;
  background: #000; border-radius: 0.2rem; image-rendering: pixelated; }
figcaption { font-size: 0.88rem; line-height: 1.4; margin-top: 0.35rem; }
.save { display: flex; flex-wrap: wrap; gap: 0.4rem; margin: 0.35rem 0 0; font-size: 0.8rem; }
.save a { border: 1px solid var(--line); border-radius: 0.3rem; padding: 0.1rem 0.55rem; background: var(--card);
  color: var(--ink); text-decoration: none; }
.save a:hover { border-color: var(--soft); }
.scale { display: flex; align-items: center; gap: 0.4rem; margin-top: 0.35rem; font-size: 0.82rem; color: var(--soft); }
.scale i { flex: 1; height: 0.7rem; border: 1px solid var(--line); print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
.scale em { flex: 1; font-style: normal; text-align: center; border: 1px solid var(--line); line-height: 1.3;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
table { border-collapse: collapse; font-size: 0.92rem; margin: 0.4rem 0 0.6rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: 0.25rem 0.9rem 0.25rem 0; border-bottom: 1px solid var(--line); vertical-align: top;
  overflow-wrap: normal; }
thead th { color: var(--soft); font-weight: 600; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
tbody th { font-weight: normal; }
td.words, th.words { text-align: left; min-width: 16rem; }
table.facts td, table.facts th { text-align: left; font-weight: normal; }
table.facts td { overflow-wrap: break-word; }
table.facts th { color: var(--soft); padding-right: 1.2rem; }
.wide { overflow-x: auto; max-width: 100%; } .wide tbody th, .wide td { white-space: nowrap; }
.wide td.words { white-space: normal; }
@media (max-width: 40rem) { .wide table { font-size: 0.8rem; } .wide th, .wide td, .wide tbody th { white-space: normal;
  padding: 0.15rem 0.25rem 0.15rem 0; hyphens: auto; } td.words, th.words { min-width: 0; } }
pre.wide { background: var(--card); border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.6rem; max-height: 30rem;
  overflow: auto; }
summary { cursor: pointer; }
svg { display: block; width: 100%; height: auto; max-width: 36rem; margin: 0.6rem 0; print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
svg text { fill: var(--ink); font: 12px system-ui, "DejaVu Sans", sans-serif; }
svg .soft { fill: var(--soft); } svg .axis { stroke: var(--line); } svg .halo { paint-order: stroke; stroke: var(--paper);
  stroke-width: 3px; }
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

std::string breakable(std::string_view text) {
  std::string html;
  for (const char c : text) {
    html += escape(std::string_view(&c, 1));
    if (std::string_view("/?&=,;:_-").find(c) != std::string_view::npos) html += "<wbr>";
  }
  return html;
}

std::string number(double value, std::string_view from, std::string_view text) {
  if (!std::isfinite(value)) return escape(text);
  return fmt::format(R"(<data value="{}" data-from="{}">{}</data>)", value, escape(from), escape(text));
}

std::string figure(const Picture& picture, const Framing& framing) {
  std::string links;
  if (!framing.file.empty()) {
    links = save_link(framing.file + ".png", "PNG", framing.alt, "image/png", encode_png(picture));
    if (framing.values != nullptr) links += exr_link(framing.file, framing.alt, *framing.values);
  }
  return fmt::format(
      "<figure><img src=\"{}\" alt=\"{}\" width=\"{}\" "
      "height=\"{}\">{}<figcaption>{}</figcaption>{}</figure>\n",
      data_uri(picture), escape(framing.alt), picture.grid().cols, picture.grid().rows, framing.scale_html,
      framing.caption_html, save_row(links));
}

std::string figure(const Picture& picture, std::string_view alt, std::string_view caption_html,
                   std::string_view scale_html) {
  return figure(picture, {.alt = std::string(alt),
                          .caption_html = std::string(caption_html),
                          .scale_html = std::string(scale_html)});
}

std::string row_of(const std::vector<std::string>& figures, int least) {
  // On a phone, small pictures stay two in a row, so that a picture and its truth are visible together.
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

std::string tile(std::string_view number_html, std::string_view meaning) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", number_html, escape(meaning));
}

std::string tiles(std::string_view tiles_html) {
  return tiles_html.empty() ? std::string() : fmt::format("<div class=\"tiles\">{}</div>\n", tiles_html);
}

std::string number_table(const std::vector<std::string>& head,
                         const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::vector<std::string>> rows_html = rows;
  for (auto& row : rows_html)
    for (std::string& cell : row) cell = escape(cell);
  return number_table_html("table", head, rows_html);
}

std::string number_table_html(std::string_view name, const std::vector<std::string>& head,
                              const std::vector<std::vector<std::string>>& rows_html, Last last) {
  // The keyboard can reach and scroll a wide table.
  std::string html = fmt::format(
      R"(<div class="wide" role="region" tabindex="0" aria-label="{}"><table><thead><tr>)", escape(name));
  const auto words = [&](std::size_t k, std::size_t columns) {
    return last == Last::words && k + 1 == columns ? " class=\"words\"" : "";
  };
  for (std::size_t k = 0; k < head.size(); ++k)
    html += fmt::format("<th scope=\"col\"{}>{}</th>", words(k, head.size()), escape(head[k]));
  html += "</tr></thead>\n<tbody>";
  for (const auto& row : rows_html) {
    html += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k)
      html += k == 0 ? "<th scope=\"row\">" + row[k] + "</th>"
                     : fmt::format("<td{}>{}</td>", words(k, row.size()), row[k]);
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

namespace {

/// Keeps a number and its percent sign on one line.
std::string with_number_spaces(std::string_view html) {
  std::string out;
  out.reserve(html.size());
  for (std::size_t i = 0; i < html.size(); ++i) {
    const bool between = html[i] == ' ' && i + 1 < html.size() && html[i + 1] == '%';
    out += between ? std::string_view("\xC2\xA0") : html.substr(i, 1);
  }
  return out;
}

}  // namespace

std::string navigation(const std::vector<std::pair<std::string, std::string>>& sections) {
  std::string html;
  for (const auto& [id, name] : sections)
    html += fmt::format("<a href=\"#{}\">{}</a>", escape(id), escape(name));
  return html.empty() ? html : "<nav aria-label=\"Sections\">" + html + "</nav>\n";
}

std::string page(std::string_view title, std::string_view body_html) {
  // The policy makes the browser enforce what the page promises: no script, and nothing is loaded.
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
      "'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style></head>\n<body>\n<main>\n{}</main>\n</body></html>\n",
      escape(title), kPageStyle, with_number_spaces(body_html));
}

namespace {

std::string cell(const std::string& text) {
  // A number may begin with a sign. Other text that begins like this could be read as a formula.
  const bool number = !text.empty() && text.find_first_not_of("+-.0123456789eE") == std::string::npos;
  const bool formula =
      !text.empty() && !number && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos;
  std::string plain;
  if (formula) plain.push_back('\'');
  plain.append(text);
  if (plain.find_first_of(",\"\r\n") == std::string::npos) return plain;
  std::string quoted;
  quoted.push_back('"');
  for (const char c : plain) quoted.append(c == '"' ? 2 : 1, c);
  quoted.push_back('"');
  return quoted;
}

}  // namespace

std::string file_stem(std::string_view text) {
  std::string stem;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
    if (plain)
      stem += c;
    else if (!stem.empty() && stem.back() != '-')
      stem += '-';
  }
  while (!stem.empty() && (stem.back() == '-' || stem.back() == '.')) stem.pop_back();
  stem.erase(0, std::min(stem.size(), stem.find_first_not_of(".-")));
  return stem.empty() ? "symrig" : stem.substr(0, 100);
}

std::string save_link(std::string_view file, std::string_view label, std::string_view what,
                      std::string_view media_type, std::span<const std::uint8_t> bytes) {
  return fmt::format(R"(<a download="{}" aria-label="Save {} as {}" href="data:{};base64,{}">Save {}</a>)",
                     escape(file), escape(what), escape(label), media_type, base64(bytes), escape(label));
}

std::string exr_link(std::string_view file, std::string_view what, const Image<float>& values) {
  const auto all = values.values();
  const bool finite = std::all_of(all.begin(), all.end(), [](float v) { return std::isfinite(v); });
  if (all.size() > kMostSavedValues || !finite) return {};
  const auto bytes = encode_exr(values);
  if (!bytes) return {};
  const auto* first = reinterpret_cast<const std::uint8_t*>(bytes->data());
  return save_link(fmt::format("{}.exr", file), "EXR", what, "image/x-exr", {first, bytes->size()});
}

void Csv::add(const std::vector<std::string>& row) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (k > 0) text_.push_back(',');
    text_.append(cell(row[k]));
  }
  text_ += "\r\n";
}

std::string Csv::link(std::string_view file, std::string_view what) const {
  const auto* first = reinterpret_cast<const std::uint8_t*>(text_.data());
  return save_link(fmt::format("{}.csv", file), "CSV", what, "text/csv;charset=utf-8", {first, text_.size()});
}

std::string exact(double number) {
  return std::isfinite(number) ? fmt::format("{}", number) : std::string();
}

std::string save_row(std::string_view links_html) {
  return links_html.empty() ? std::string() : fmt::format("<div class=\"save\">{}</div>\n", links_html);
}

}  // namespace symrig::report
