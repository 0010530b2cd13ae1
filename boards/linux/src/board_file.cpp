// SPDX-License-Identifier: Apache-2.0
#include "board_file.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <span>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace symrig::board_linux {
namespace {

constexpr std::size_t kMaxLines = 32;
constexpr std::size_t kMaxOutputs = 28;
constexpr std::size_t kLineName = 23;  // limit of the wire (symrig.options)
constexpr std::size_t kPinName = 15;
constexpr std::size_t kBoardName = 23;
constexpr std::uint64_t kMaxFile = 1U << 20U;

/// Reads the keys of one table. Keeps the first error.
class Keys {
 public:
  Keys(const toml::table& table, std::string place, std::optional<Error>& error)
      : table_(table), place_(std::move(place)), error_(error) {}

  void only(std::span<const std::string_view> known) {
    for (const auto& [key, value] : table_)
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(fmt::format("{}: unknown key '{}'", place_, key.str()),
             fmt::format("known keys: {}", fmt::join(known, ", ")));
  }
  template <class T>
  void read(std::string_view key, T& out, std::string_view kind) {
    const auto node = table_[key];
    if (!node) return;
    if (const auto value = node.value<T>())
      out = *value;
    else
      fail(fmt::format("{}: '{}' is not {}", place_, key, kind), "");
  }
  void text(std::string_view key, std::string& out, std::size_t longest) {
    read(key, out, "a text");
    if (out.size() > longest)
      fail(fmt::format("{}: '{}' is longer than {} characters", place_, key, longest), "shorten it");
  }
  std::int64_t number(std::string_view key, std::int64_t otherwise, std::int64_t low, std::int64_t high) {
    std::int64_t value = otherwise;
    read(key, value, "a whole number");
    if (value < low || value > high)
      fail(fmt::format("{}: '{}' is {}, not within {} to {}", place_, key, value, low, high), "");
    return value;
  }
  void fail_value(std::string_view key, std::string_view value, std::string_view legal) {
    fail(fmt::format("{}: '{}' is '{}'", place_, key, value), fmt::format("legal values: {}", legal));
  }
  void fail(std::string what, std::string hint) {
    if (!error_) error_ = Error{ErrorCode::bad_format, std::move(what), std::move(hint)};
  }

 private:
  const toml::table& table_;
  std::string place_;
  std::optional<Error>& error_;
};

class Reader {
 public:
  explicit Reader(std::string source) : source_(std::move(source)) {}

  Result<BoardFile> read(const toml::table& root) {
    Keys keys(root, source_, error_);
    constexpr std::array<std::string_view, 6> kKnown{"board", "output",   "input",
                                                     "link",  "realtime", "folder"};
    keys.only(kKnown);
    table(root, "board", [this](Keys& in) { board(in); });
    table(root, "link", [this](Keys& in) { link(in); });
    table(root, "realtime", [this](Keys& in) { realtime(in); });
    table(root, "folder", [this](Keys& in) { folder(in); });
    if (root.contains("output") || root.contains("input")) file_.lines.clear();
    lines(root, "output", true);
    lines(root, "input", false);
    check_lines(keys);
    if (error_) return *error_;
    return file_;
  }

 private:
  template <class Read>
  void table(const toml::table& root, std::string_view name, Read read) {
    if (!root.contains(name)) return;
    const toml::table* found = root[name].as_table();
    static const toml::table kNone;
    Keys keys(found != nullptr ? *found : kNone, fmt::format("{}: [{}]", source_, name), error_);
    if (found == nullptr) return keys.fail(fmt::format("{}: '{}' is not a table", source_, name), "");
    read(keys);
  }

  void board(Keys& keys) {
    constexpr std::array<std::string_view, 3> kKnown{"name", "id", "led"};
    keys.only(kKnown);
    keys.text("name", file_.name, kBoardName);
    keys.text("id", file_.id, 32);
    keys.text("led", file_.led, 200);
    if (file_.id.size() % 2 != 0 || file_.id.find_first_not_of("0123456789abcdef") != std::string::npos)
      keys.fail(fmt::format("{}: [board]: 'id' is not hexadecimal", source_), "give pairs of 0-9 and a-f");
  }

  void link(Keys& keys) {
    constexpr std::array<std::string_view, 5> kKnown{"usb", "unix", "serial", "baud", "tcp"};
    keys.only(kKnown);
    BoardLinks& links = file_.links;
    links.unix_socket.clear();
    keys.text("usb", links.usb, 200);
    keys.text("unix", links.unix_socket, 107);
    keys.text("serial", links.serial, 200);
    links.baud = static_cast<std::uint32_t>(keys.number("baud", links.baud, 1'200, 4'000'000));
    std::string tcp;
    keys.text("tcp", tcp, 200);
    if (!tcp.empty() && !split_address(tcp))
      keys.fail(fmt::format("{}: [link]: tcp '{}' is not ADDRESS:PORT", source_, tcp),
                "for example 127.0.0.1:7700");
  }

  bool split_address(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos || colon == 0) return false;
    const std::string port = text.substr(colon + 1);
    if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos)
      return false;
    const unsigned long number = std::stoul(port);
    file_.links.tcp_host = text.substr(0, colon);
    file_.links.tcp_port = static_cast<std::uint16_t>(number);
    return number >= 1 && number <= 65'535;
  }

  void realtime(Keys& keys) {
    constexpr std::array<std::string_view, 4> kKnown{"priority", "awake", "lock_memory", "lateness_us"};
    keys.only(kKnown);
    file_.priority = static_cast<int>(keys.number("priority", file_.priority, 0, 98));
    file_.lateness_us = static_cast<std::uint32_t>(keys.number("lateness_us", 0, 0, 100'000));
    keys.read("awake", file_.awake, "true or false");
    keys.read("lock_memory", file_.lock_memory, "true or false");
  }

  void folder(Keys& keys) {
    constexpr std::array<std::string_view, 2> kKnown{"state", "run"};
    keys.only(kKnown);
    std::string state = file_.state_folder;
    std::string run = file_.run_folder;
    keys.text("state", state, 200);
    keys.text("run", run, 80);
    file_.state_folder = state;
    file_.run_folder = run;
  }

  void lines(const toml::table& root, std::string_view kind, bool output) {
    if (!root.contains(kind)) return;
    const toml::array* list = root[kind].as_array();
    if (list == nullptr) {
      error_ = Error{ErrorCode::bad_format, fmt::format("{}: '{}' is not a list of tables", source_, kind),
                     fmt::format("write [[{}]]", kind)};
      return;
    }
    for (const toml::node& node : *list) {
      static const toml::table kNone;
      const toml::table* found = node.as_table();
      Keys keys(found != nullptr ? *found : kNone, fmt::format("{}: [[{}]]", source_, kind), error_);
      constexpr std::array<std::string_view, 4> kKnown{"name", "gpio", "pin", "bias"};
      keys.only(std::span(kKnown).first(output ? 3 : 4));
      BoardLine line;
      line.output = output;
      keys.text("name", line.name, kLineName);
      line.gpio = line.name;
      keys.text("gpio", line.gpio, 63);
      keys.text("pin", line.pin, kPinName);
      bias(keys, line.bias);
      if (line.name.empty()) keys.fail(fmt::format("{}: [[{}]] without a name", source_, kind), "add a name");
      file_.lines.push_back(line);
    }
  }

  static void bias(Keys& keys, Bias& out) {
    constexpr std::array<std::string_view, 4> kNames{"as-is", "up", "down", "off"};
    std::string name(kNames[0]);
    keys.text("bias", name, 8);
    const auto* const found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end())
      return keys.fail_value("bias", name, fmt::format("{}", fmt::join(kNames, ", ")));
    out = static_cast<Bias>(found - kNames.begin());
  }

  void check_lines(Keys& keys) {
    std::set<std::string> names;
    std::set<std::string> gpios;
    for (const BoardLine& line : file_.lines) {
      if (!names.insert(line.name).second)
        keys.fail(fmt::format("{}: two lines are called '{}'", source_, line.name), "rename one");
      if (!gpios.insert(line.gpio).second)
        keys.fail(fmt::format("{}: GPIO line '{}' appears twice", source_, line.gpio),
                  "choose another GPIO line for one of them");
    }
    const std::size_t outputs = std::count_if(file_.lines.begin(), file_.lines.end(),
                                              [](const BoardLine& line) { return line.output; });
    if (outputs == 0 || outputs > kMaxOutputs || file_.lines.size() > kMaxLines)
      keys.fail(fmt::format("{}: {} outputs and {} inputs", source_, outputs, file_.lines.size() - outputs),
                fmt::format("a board has 1 to {} outputs, and at most {} lines", kMaxOutputs, kMaxLines));
  }

  std::string source_;
  BoardFile file_ = default_board();
  std::optional<Error> error_;
};

}  // namespace

BoardFile default_board() {
  BoardFile board;
  for (const char* name :
       {"projector_trigger", "camera_trigger", "lamp_enable", "laser_enable", "aux0", "aux1"})
    board.lines.push_back({name, name, "", true, Bias::as_is});
  for (const char* name : {"vsync", "camera_strobe", "camera_strobe_b", "interlock", "in_a", "in_b"})
    board.lines.push_back({name, name, "", false, Bias::as_is});
  board.links.unix_socket = board.run_folder / "board.sock";
  return board;
}

Result<BoardFile> parse_board_file(std::string_view text, const std::string& source) {
  SYMRIG_CHECK(check_toml_nesting(text, source));
  try {
    return Reader(source).read(toml::parse(text));
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::bad_format,
                 fmt::format("{}:{}: {}", source, error.source().begin.line, error.description()),
                 "docs/board-linux.md has a complete example"};
  }
}

Result<BoardFile> read_board_file(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMaxFile));
  std::string text(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), text.begin(),
                 [](std::byte one) { return static_cast<char>(one); });
  return parse_board_file(text, path.string());
}

namespace {

void append_crc(std::vector<std::uint8_t>& out, const std::vector<std::uint8_t>& bytes) {
  const std::uint32_t crc = protocol::crc32c({bytes.data(), bytes.size()});
  for (unsigned shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(crc >> shift));
}

}  // namespace

Result<std::vector<std::uint8_t>> unique_id(const BoardFile& file) {
  std::vector<std::uint8_t> id;
  for (std::size_t k = 0; k + 1 < file.id.size(); k += 2)
    id.push_back(static_cast<std::uint8_t>(std::stoul(file.id.substr(k, 2), nullptr, 16)));
  if (!id.empty()) return id;
  const auto machine = read_file("/etc/machine-id", 4096);
  if (!machine || machine->size() < 16)
    return Error{ErrorCode::not_found, "this machine has no /etc/machine-id", "set [board] id in board.toml"};
  std::vector<std::uint8_t> seed(file.name.begin(), file.name.end());
  std::transform(machine->begin(), machine->end(), std::back_inserter(seed),
                 [](std::byte one) { return static_cast<std::uint8_t>(one); });
  append_crc(id, seed);
  seed.push_back(1);  // for the second four bytes
  std::reverse(seed.begin(), seed.end());
  append_crc(id, seed);
  return id;
}

std::string hexadecimal(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace symrig::board_linux
