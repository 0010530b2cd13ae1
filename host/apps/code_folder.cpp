// SPDX-License-Identifier: Apache-2.0
#include "code_folder.hpp"

#include <charconv>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Digits without a leading zero. The number may be too large for an int.
bool is_count(std::string_view text) {
  return !text.empty() && text.front() != '0' &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

Result<std::optional<Grid>> parse_projector(const std::string& text) {
  if (text.empty()) return std::optional<Grid>();
  const std::string_view all(text);
  const std::size_t cross = all.find('x');
  const std::string_view before = all.substr(0, cross);
  const std::string_view after = cross == std::string_view::npos ? std::string_view() : all.substr(cross + 1);
  const Grid grid{whole_number(before).value_or(0), whole_number(after).value_or(0)};
  if (grid.valid()) return std::optional<Grid>(grid);
  const char* why = is_count(before) && is_count(after) ? ": it is too large" : "";
  return Error{ErrorCode::bad_argument, fmt::format("--projector cannot be '{}'{}", text, why),
               "give ROWSxCOLUMNS, such as 768x1024"};
}

}  // namespace

CLI::Option* add_code_folder(CLI::App& command, CodeFolder& arguments) {
  command
      .add_option("--projector", arguments.projector,
                  "Size of the projector (default: from the number of photographs)")
      ->type_name("ROWSxCOLUMNS");
  command.add_flag("--mirrored", arguments.mirrored,
                   "The photographs show a rear projection, or were taken through a mirror");
  command.add_flag(
      "--unchecked", arguments.unchecked,
      "Decode a sequence even if its photographs contradict each other; the result may be wrong");
  return command.add_option("--from", arguments.folder, "Folder of Gray-code photographs (see below)")
      ->type_name("DIR");
}

Result<CodePhotographs> read_code_folder(const CodeFolder& arguments, const Progress& progress) {
  ReadCodeOptions options;
  SYMRIG_TRY(options.projector, parse_projector(arguments.projector));
  options.progress = progress;
  return read_gray_code_folder(arguments.folder, options);
}

DecodeOptions decode_options(const CodeFolder& arguments) {
  DecodeOptions options;
  options.check_sequence = !arguments.unchecked;
  options.mirrored = arguments.mirrored;
  return options;
}

std::string folder_name(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::path(folder).lexically_normal();
  return (path.has_filename() ? path.filename() : path.parent_path().filename()).string();
}

}  // namespace symrig::apps
