// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"

#include "report/page_style.hpp"
#include "report/save_link.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
namespace {

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

}  // namespace symrig::report
