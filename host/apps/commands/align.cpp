// SPDX-License-Identifier: Apache-2.0

#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "rig.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/rig/rig_file.hpp"
#include "terminal_line.hpp"

#include <memory>
#include <optional>

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace symrig::apps {

namespace {

/// Single keys from the terminal behind standard input, without Enter. The terminal is as before afterwards.
/// Without a terminal there are no keys.
class Keyboard {
 public:
  Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  ~Keyboard();

  /// The next key that was pressed, or nothing. Does not wait.
  std::optional<char> key();

 private:
  struct Before;
  std::unique_ptr<Before> before_;  // none: no terminal
};

struct Keyboard::Before {
  termios settings;
};

Keyboard::Keyboard() {
  // A job in the background must not change the terminal: the system would stop it.
  if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp()) return;
  termios settings{};
  if (tcgetattr(STDIN_FILENO, &settings) != 0) return;
  before_ = std::make_unique<Before>(Before{settings});
  // Ctrl-C stays a signal.
  settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  tcsetattr(STDIN_FILENO, TCSANOW, &settings);
}

Keyboard::~Keyboard() {
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &before_->settings);
}

std::optional<char> Keyboard::key() {
  if (!before_) return std::nullopt;
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char pressed = 0;
  if (poll(&input, 1, 0) != 1 || (input.revents & POLLIN) == 0 || read(STDIN_FILENO, &pressed, 1) != 1)
    return std::nullopt;
  return pressed;
}

/// The rig is good enough when it was so this often, one after the other: a hand may still be at a screw.
constexpr int kGoodUpdates = 2;
constexpr const char* kKeys = "keys: r draws what is left over of the map, q ends\n";

struct AlignArguments {
  std::string rig, json;
  std::int64_t updates = 0;
};

/// Measures, shows, and looks at the keys.
class Aligning {
 public:
  Aligning(Probe& rig, int cell, const AlignArguments& arguments)
      : rig_(rig),
        cell_(cell),
        arguments_(arguments),
        page_(arguments.json != "-" && isatty(STDOUT_FILENO) == 1) {}

  /// fails: as the rig; interrupted; io.
  Result<void> run() {
    Result<void> light;
    for (int good = 0; !ended_ && good < kGoodUpdates;) {
      light = update();
      if (!light && (light.error().code != ErrorCode::wrong_light || count_ == arguments_.updates)) break;
      if (!light) SYMRIG_CHECK(say(light.error()));
      good = light && all_good(last_->findings) && arguments_.updates == 0 ? good + 1 : 0;
      if (count_ == arguments_.updates) break;
    }
    if (!light && light.error().code != ErrorCode::wrong_light) return light;
    // The updates that were measured are not lost by the last one.
    if (light || !lines_.empty()) SYMRIG_CHECK(write_json());
    if (!light) return light;
    return ended_ ? Result<void>() : good_enough();
  }

 private:
  Result<void> update() {
    if (interrupted())
      return Error{ErrorCode::interrupted, "stopped before the rig was good enough", "run it again"};
    ++count_;
    SYMRIG_TRY(Alignment alignment, measure_alignment(rig_));
    std::optional<AlignmentUpdate> before = std::move(last_);
    auto findings = judge(alignment);
    last_ = {rig_.describe(), count_, watch_.seconds(), std::move(alignment), std::move(findings), cell_};
    press_keys();
    return show(before ? &*before : nullptr);
  }

  /// fails: limit (what is not good enough).
  Result<void> good_enough() const {
    const std::string missed = missed_goals(last_->findings);
    if (missed.empty()) return {};
    return Error{ErrorCode::limit, "the rig is not good enough for a capture: " + missed,
                 "move what the lines above say"};
  }

  /// A cap on the lens, or a hand in the light, ends nothing: the next update may see the stripes.
  Result<void> say(const Error& error) {
    press_keys();
    if (arguments_.json == "-") return {};
    if (page_) SYMRIG_CHECK(write_standard_output("\033[H\033[J"));
    return print(fmt::format("update {}: {}\n{}", count_, error.line(), page_ ? kKeys : ""));
  }

  void press_keys() {
    while (const auto key = keyboard_.key()) {
      if (*key == 'q') ended_ = true;
      if (*key == 'r') draws_ = !draws_;
    }
  }

  Result<void> show(const AlignmentUpdate* before) {
    if (arguments_.json == "-") return write_standard_output(alignment_json(*last_));
    if (!arguments_.json.empty()) lines_ += alignment_json(*last_);
    if (!page_) return print(alignment_line(*last_));
    std::string text = alignment_page(*last_, before) + kKeys;
    if (draws_ && last_->alignment.seen)
      text += left_over_picture(last_->alignment, terminal_columns(STDOUT_FILENO));
    SYMRIG_CHECK(write_standard_output("\033[H\033[J"));
    return print(text);
  }

  Result<void> write_json() {
    return arguments_.json == "-" ? Result<void>() : write_text(arguments_.json, lines_);
  }

  Probe& rig_;
  int cell_;
  const AlignArguments& arguments_;
  bool page_, draws_ = false, ended_ = false;
  Keyboard keyboard_;
  Stopwatch watch_;
  std::int64_t count_ = 0;  // of updates
  std::optional<AlignmentUpdate> last_;
  std::string lines_;  // of JSON
};

/// Projector pixels along the side of a cell, if a rig file says so.
Result<int> cell_of(const std::string& rig) {
  if (!is_rig_file(rig)) return 0;
  SYMRIG_TRY(const RigDescription file, read_rig_file(rig, RigUse::one_pair));
  return file.projector.placement.cell;
}

Result<void> run(const AlignArguments& arguments) {
  if (arguments.rig.empty())
    return Error{ErrorCode::bad_argument, "--rig is missing", "see symrig align --help"};
  if (arguments.updates < 0)
    return Error{ErrorCode::bad_argument, fmt::format("--updates {} is negative", arguments.updates),
                 "give a number of updates, or 0 to go on until the rig is good enough"};
  JobFiles files = rig_files(arguments.rig);
  SYMRIG_CHECK(files.writes("--json", arguments.json, FileFormat::json).check());
  SYMRIG_TRY(const int cell, cell_of(arguments.rig));
  SYMRIG_TRY(const OpenedRig opened, open_bare_rig(arguments.rig, kAlignmentExposures));
  return Aligning(*opened.probe, cell, arguments).run();
}

}  // namespace

Job add_align(CLI::App& command) {
  const auto arguments = std::make_shared<AlignArguments>();
  command.add_option("--rig", arguments->rig, "Rig to align")->type_name("RIG");
  takes_number<std::int64_t>(command
                                 .add_option("--updates", arguments->updates,
                                             "End after this many updates; 0: when the rig is good enough")
                                 ->capture_default_str()
                                 ->type_name("N"));
  command
      .add_option("--json", arguments->json, "Also write the numbers as lines of JSON; - is standard output")
      ->type_name("FILE");
  command.footer(
      "Example:\n"
      "  symrig align --rig rig.toml\n"
      "  symrig align --rig 'sim:vgroove-white?size=64x64&camera=304x304&turn=1.5&zoom=0.78&fine=4' "
      "--updates 1\n"
      "\n"
      "For the person at the screws. It measures again and again, with a few patterns each time, how camera "
      "and\n"
      "projector sit, and says what to move. It ends when the rig is good enough for a capture.\n\n" +
      rig_help() + "\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
