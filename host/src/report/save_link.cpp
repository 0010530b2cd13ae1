// SPDX-License-Identifier: Apache-2.0
#include "report/save_link.hpp"

#include "report/html.hpp"
#include "symrig/image/encode.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
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
