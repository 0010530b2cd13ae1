// SPDX-License-Identifier: Apache-2.0
#include "invocation.hpp"

#include "program.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <vector>

namespace symrig::apps {
namespace {

std::string& remembered() {
  static std::string line;
  return line;
}

bool plain(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("_./:=,+-@%").find(c) != std::string_view::npos;
}

std::string quoted(std::string_view word) {
  std::string out(word);
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return out;
  out.assign(1, '\'');
  for (const char c : word) {
    if (c == '\'')
      out.append("'\\''");
    else
      out.push_back(static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c);
  }
  out.push_back('\'');
  return out;
}

}  // namespace

std::string shell_line(std::span<const char* const> words) {
  std::string line;
  for (const char* word : words) {
    if (!line.empty()) line.push_back(' ');
    line.append(quoted(word));
  }
  return line;
}

void remember_command_line(int argc, const char* const* argv) {
  std::vector<const char*> words{program_name().c_str()};
  if (argc > 1) words.insert(words.end(), argv + 1, argv + argc);
  remembered() = shell_line(words);
}

Made made_now() {
  return {utc_now(), SYMRIG_VERSION, remembered()};
}

}  // namespace symrig::apps
