// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/picture.hpp"
#include "symrig/report/text.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Pieces of the page. Every argument that is text is escaped; arguments named html are put in as they are.
namespace symrig::report {

using text::byte_size, text::duration, text::grouped, text::percent, text::short_number;

std::string escape(std::string_view text);
/// Escaped, with places where a line may break: after the punctuation of paths, addresses and commands.
std::string breakable(std::string_view text);

/// A number with its unrounded value and where it comes from, so that scripts and tests can find both.
/// from: "capture:", "inspect:" or "evaluate:" and a JSON pointer into what that command writes with --json.
std::string number(double value, std::string_view from, std::string_view text);

/// What stands around a picture.
struct Framing {
  std::string alt, caption_html;
  std::string scale_html = {};
  std::string file = {};  ///< what the saved files are called, without suffix; empty: no buttons
  const Image<float>* values = nullptr;  ///< what an OpenEXR file of it holds; nullptr: none
};

/// A picture with its caption. Small pictures are enlarged with sharp pixels by the page's style.
std::string figure(const Picture& picture, const Framing& framing);
std::string figure(const Picture& picture, std::string_view alt, std::string_view caption_html,
                   std::string_view scale_html = {});
/// Figures side by side; as many in a row as fit, each at least `least` CSS pixels wide.
std::string row_of(const std::vector<std::string>& figures, int least);
/// The colours of false_colour with a label at the dark and at the bright end.
std::string colour_scale(std::string_view dark, std::string_view bright);
/// Greys of levels 0..deepest with their numbers.
std::string level_scale(int deepest);

std::string section(std::string_view id, std::string_view heading, std::string_view body_html);
std::string paragraph(std::string_view html);
/// One number with what it means, for a row of them.
std::string tile(std::string_view number_html, std::string_view meaning);
std::string tiles(std::string_view tiles_html);
/// Two columns: names and values (html).
std::string facts_table(const std::vector<std::pair<std::string, std::string>>& rows);
/// What the last column of a table holds.
enum class Last : std::uint8_t { number, words };
/// A table with a head; the first column is a row's name, the rest are numbers. name: for who hears the page.
std::string number_table(const std::vector<std::string>& head,
                         const std::vector<std::vector<std::string>>& rows);
std::string number_table_html(std::string_view name, const std::vector<std::string>& head,
                              const std::vector<std::vector<std::string>>& rows_html,
                              Last last = Last::number);

/// Links to sections: id and name of each.
std::string navigation(const std::vector<std::pair<std::string, std::string>>& sections);

/// The whole page around its sections.
std::string page(std::string_view title, std::string_view body_html);

}  // namespace symrig::report
