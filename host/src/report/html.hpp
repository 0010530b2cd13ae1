// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/picture.hpp"
#include "symrig/report/text.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Pieces of the page. Every argument that is text is escaped; arguments named html are put in as they are.
namespace symrig::report {

using text::byte_size, text::duration, text::grouped, text::percent, text::short_number;

std::string escape(std::string_view text);

/// A picture with its caption. Small pictures are enlarged with sharp pixels by the page's style.
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
/// Two columns: names and values (html).
std::string facts_table(const std::vector<std::pair<std::string, std::string>>& rows);
/// A table with a head; the first column is a row's name, the rest are numbers.
std::string number_table(const std::vector<std::string>& head,
                         const std::vector<std::vector<std::string>>& rows);

/// The whole page around its sections.
std::string page(std::string_view title, std::string_view body_html);

}  // namespace symrig::report
