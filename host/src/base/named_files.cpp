// SPDX-License-Identifier: Apache-2.0
#include "base/named_files.hpp"

#include "base/file_place.hpp"
#include "symrig/base/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string>
#include <string_view>

namespace symrig::base {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostText = 1 << 24;

bool is_picture(const fs::path& path) {
  constexpr std::array<std::string_view, 4> kSuffixes{".png", ".exr", ".pfm", ".raw"};
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kSuffixes.begin(), kSuffixes.end(), suffix) != kSuffixes.end();
}

/// Position of the quote that ends the string which begins at `begin`, on the same line; npos if there is
/// none.
std::size_t closing_quote(std::string_view text, std::size_t begin) {
  for (std::size_t k = begin + 1; k < text.size() && text[k] != '\n'; ++k) {
    if (text[k] == text[begin]) return k;
    if (text[k] == '\\' && text[begin] == '"') ++k;
  }
  return std::string_view::npos;
}

/// All strings in quotes, without those in comments.
std::set<std::string> quoted(std::string_view text) {
  std::set<std::string> strings;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '#') k = std::min(text.find('\n', k), text.size() - 1);
    if (text[k] != '"' && text[k] != '\'') continue;
    const std::size_t end = closing_quote(text, k);
    if (end == std::string_view::npos) continue;
    strings.emplace(text.substr(k + 1, end - k - 1));
    k = end;
  }
  return strings;
}

}  // namespace

std::vector<fs::path> photographs_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  if (folder.empty()) return paths;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_picture(at->path())) paths.push_back(at->path());
  return paths;
}

std::vector<fs::path> files_named_in(const fs::path& settings) {
  const auto bytes = read_file(settings, kMostText);
  if (!bytes) return {};
  return files_named_in(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()),
                        folder_of(settings));
}

std::vector<fs::path> files_named_in(std::string_view text, const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const std::string& name : quoted(text)) {
    if (name.empty() || name.size() > 4096 || name.find('\0') != std::string::npos) continue;
    const fs::path path = folder / name;
    const auto place = place_of(path);
    if (place && place->regular()) paths.push_back(path);
  }
  return paths;
}

}  // namespace symrig::base
