// SPDX-License-Identifier: Apache-2.0
#include "manual/argument.hpp"

#include "options.hpp"
#include "symrig/board/link.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <sstream>
#include <string_view>

namespace symrig::apps {
namespace {

using Words = std::vector<std::string>;

Words rig_words() {
  Words words;
  for (const std::string_view scene : scene_names()) words.push_back("sim:" + std::string(scene));
  words.insert(words.end(), {"exec:", "dense:"});
  return words;
}

Words light_words() {
  Words words;
  for (const BuiltInLight& light : built_in_lights()) words.emplace_back(light.name);
  return words;
}

Words board_words() {
  const auto schemes = device_schemes();
  return {schemes.begin(), schemes.end()};
}

/// What the type names of the help mean. A name that is not here, such as N, takes what nobody can list.
struct Type {
  std::string_view name;
  Value value;
  Words (*words)();
};
constexpr Type kTypes[] = {
    {"RIG", Value::file, rig_words},        {"IMAGE", Value::file, light_words},
    {"URI|FILE", Value::file, board_words}, {"URI|SERIAL", Value::other, board_words},
    {"URI", Value::other, board_words},     {"DIR", Value::folder, nullptr},
    {"FOLDER", Value::folder, nullptr},     {"PATH", Value::folder, nullptr},
    {"FILE", Value::file, nullptr},         {"OUT", Value::file, nullptr},
    {"VCD", Value::file, nullptr},
};

/// "scan.toml|scan.symprog": toml and symprog. None if one of the alternatives names no suffix.
Words suffixes_of(const std::string& type) {
  Words suffixes;
  std::istringstream alternatives(type);
  for (std::string one; std::getline(alternatives, one, '|');) {
    const std::size_t dot = one.rfind('.');
    if (dot == std::string::npos) return {};
    suffixes.push_back(one.substr(dot + 1));
  }
  return suffixes;
}

void set_value(Argument& argument) {
  const std::string& type = argument.type;
  argument.list = type.ends_with(",...");
  argument.value = Value::other;
  const auto* const known =
      std::find_if(std::begin(kTypes), std::end(kTypes), [&](const Type& one) { return one.name == type; });
  if (known != std::end(kTypes)) {
    argument.value = known->value;
    if (known->words != nullptr && argument.words.empty()) argument.words = known->words();
  } else if (type.find('.') != std::string::npos && !argument.list) {
    argument.value = Value::file;
    if (argument.positional()) argument.suffixes = suffixes_of(type);
  }
}

Argument argument_of(const CLI::Option& option) {
  Argument argument;
  for (const std::string& name : option.get_snames()) argument.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) argument.names.push_back("--" + name);
  argument.about = option.get_description();
  argument.required = option.get_required();
  if (option.get_items_expected_max() == 0) return argument;
  argument.type = option.get_type_name();
  argument.standard = option.get_default_str();
  argument.words = words_of(option);
  set_value(argument);
  return argument;
}

}  // namespace

std::vector<Argument> arguments_of(const CLI::App& command) {
  std::vector<Argument> arguments;
  for (const CLI::Option* option : command.get_options()) arguments.push_back(argument_of(*option));
  std::stable_partition(arguments.begin(), arguments.end(),
                        [](const Argument& argument) { return argument.positional(); });
  return arguments;
}

}  // namespace symrig::apps
