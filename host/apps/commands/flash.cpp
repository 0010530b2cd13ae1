// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/firmware_file.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

struct FlashArguments {
  std::string file, device, drive;
  double wait = 30;
  bool verify = false;
  bool again = false;
};

/// The board before the new firmware.
struct Known {
  DeviceUri uri;
  BoardInfo info;
};

std::string describe(const FlashArguments& arguments, const FirmwareFile& file) {
  return fmt::format(
      "{}: firmware {} for board '{}', sources {:016x}, {} of flash\n"
      "SHA-256 {}, equal to its manifest\n",
      arguments.file, file.manifest.version, file.manifest.board, file.manifest.firmware_hash,
      byte_size(static_cast<double>(file.image.bytes.size())), file.sha256);
}

/// Repeats `ask` until it succeeds or the time is over.
/// fails: the last error of `ask`, interrupted.
template <class T>
Result<T> wait_for(const char* what, double seconds, const std::function<Result<T>()>& ask) {
  const Stopwatch watch;
  Meter meter("flash", "seconds");
  const Progress progress = meter.progress();
  while (true) {
    Result<T> answer = ask();
    const double waited = watch.seconds();
    if (answer || waited >= seconds) return answer;
    progress({what, static_cast<std::int64_t>(waited), static_cast<std::int64_t>(std::ceil(seconds))});
    if (interrupted())
      return Error{ErrorCode::interrupted, "stopped while waiting for the board",
                   "run it again: a board in its boot loader waits without a time limit"};
    std::this_thread::sleep_for(100ms);
  }
}

/// The boot loader's drive of this board. Drives that were mounted before belong to other boards.
Result<fs::path> new_drive(const std::vector<fs::path>& before) {
  std::vector<fs::path> drives = boot_drives();
  std::erase_if(drives, [&](const fs::path& one) {
    return std::find(before.begin(), before.end(), one) != before.end();
  });
  if (drives.size() == 1) return drives.front();
  if (drives.empty())
    return Error{ErrorCode::timeout, "no drive RPI-RP2 has been mounted",
                 "mount it (lsblk -o NAME,LABEL shows it) and run this again with --drive PATH"};
  return Error{ErrorCode::bad_argument, fmt::format("{} drives RPI-RP2 are mounted", drives.size()),
               "name the board's with --drive PATH"};
}

Result<fs::path> find_drive(const FlashArguments& arguments, const std::vector<fs::path>& before) {
  const fs::path given = arguments.drive;
  return wait_for<fs::path>("waiting for its drive", arguments.wait, [&]() -> Result<fs::path> {
    if (given.empty()) return new_drive(before);
    SYMRIG_CHECK(check_boot_drive(given));
    return given;
  });
}

/// The board to flash; nullopt if there is no board but a boot loader's drive.
Result<std::optional<Known>> find_board(const FlashArguments& arguments) {
  const auto uri = choose_board(arguments.device);
  if (!uri) {
    const bool in_boot_loader = !arguments.drive.empty() || !boot_drives().empty();
    if (uri.error().code == ErrorCode::device_lost && in_boot_loader) return std::optional<Known>();
    return uri.error();
  }
  SYMRIG_TRY(const auto board, open_board(*uri));
  return std::optional(Known{*uri, board.info()});
}

/// Waits until the board no longer answers: it restarts some time after its reply.
Result<bool> left(const FlashArguments& arguments, const DeviceUri& uri) {
  constexpr BoardOptions kOneAnswer{.reply_timeout = 50ms, .attempts = 2};
  return wait_for<bool>("waiting for its restart", std::max(arguments.wait, 1.0), [&]() -> Result<bool> {
    if (!open_board(uri, kOneAnswer)) return true;
    return Error{ErrorCode::device_refused, "the board did not enter its boot loader",
                 "hold its BOOTSEL button while you plug it in, and run this again"};
  });
}

/// true: the board is in its boot loader. false: it runs this firmware already.
Result<bool> enter_boot_loader(const FlashArguments& arguments, const FirmwareFile& file,
                               const Known& known) {
  SYMRIG_CHECK(check_firmware_fits(file.manifest, known.info.board));
  if (known.info.firmware_hash == file.manifest.firmware_hash && !arguments.again) return false;
  {
    SYMRIG_TRY(auto board, open_board(known.uri));
    SYMRIG_CHECK(board.reboot(true));
  }
  return left(arguments, known.uri);
}

/// Checks that the board runs the new firmware.
Result<void> compare(const FirmwareFile& file, const BoardInfo& now) {
  if (now.firmware_hash == file.manifest.firmware_hash && now.firmware_version == file.manifest.version)
    return {};
  return Error{
      ErrorCode::device_refused,
      fmt::format("the board came back with firmware {} ({:016x}), not {} ({:016x})", now.firmware_version,
                  now.firmware_hash, file.manifest.version, file.manifest.firmware_hash),
      "hold its BOOTSEL button while you plug it in, and run this again"};
}

Result<void> check_return(const FlashArguments& arguments, const FirmwareFile& file,
                          const std::optional<Known>& known) {
  if (arguments.wait == 0) return print("copied; --wait 0: the firmware on the board is not checked\n");
  SYMRIG_TRY(const auto board, wait_for<Board>("waiting for its return", arguments.wait, [&] {
               return known ? open_board(known->uri) : open_board(arguments.device);
             }));
  SYMRIG_CHECK(compare(file, board.info()));
  return print(fmt::format("{} {} runs firmware {} ({:016x}), the same as the file\n", board.info().board,
                           board.info().unique_id, board.info().firmware_version,
                           board.info().firmware_hash));
}

Result<void> flash(const FlashArguments& arguments, const FirmwareFile& file) {
  SYMRIG_TRY(const auto known, find_board(arguments));
  std::vector<fs::path> before;
  if (known) {
    before = boot_drives();
    SYMRIG_TRY(const bool leaving, enter_boot_loader(arguments, file, *known));
    if (!leaving)
      return print(fmt::format("{} {} already runs this firmware; --again writes it again\n",
                               known->info.board, known->info.unique_id));
  }
  SYMRIG_TRY(const fs::path drive, find_drive(arguments, before));
  SYMRIG_CHECK(copy_to_boot_drive(arguments.file, drive));
  return check_return(arguments, file, known);
}

/// Checks that the copy does not replace the file that it is copied from.
Result<void> check_drive(const FlashArguments& arguments) {
  const fs::path copy = fs::path(arguments.drive) / "symrig.uf2";
  std::error_code none;
  if (arguments.drive.empty() || !fs::exists(copy, none)) return {};
  return JobFiles().reads("FILE", arguments.file).writes("--drive", copy, FileFormat::program).check();
}

/// Refuses options of the board with --verify, which reads only the files.
Result<void> check_flash_effects(const CLI::App& command, const FlashArguments& arguments) {
  const std::string why = "with --verify, which reads only the files";
  const std::array<Idle, 4> options{{{"--device", arguments.verify, why},
                                     {"--drive", arguments.verify, why},
                                     {"--wait", arguments.verify, why},
                                     {"--again", arguments.verify, why}}};
  return check_effects(command, options);
}

Result<void> run(const CLI::App& command, const FlashArguments& arguments) {
  if (!(arguments.wait >= 0 && arguments.wait <= 3600))
    return Error{ErrorCode::bad_argument, fmt::format("--wait {} is not between 0 and 3600", arguments.wait),
                 "give seconds: 30 are enough for most systems to mount a drive"};
  SYMRIG_CHECK(check_flash_effects(command, arguments));
  SYMRIG_TRY(const FirmwareFile file, read_firmware(arguments.file));
  if (arguments.verify) return print(describe(arguments, file));
  SYMRIG_CHECK(check_drive(arguments));
  return flash(arguments, file);
}

}  // namespace

Job add_flash(CLI::App& command) {
  const auto arguments = std::make_shared<FlashArguments>();
  command.add_option("file", arguments->file, "Firmware file; its manifest FILE.json is in the same folder")
      ->required()
      ->type_name("FILE.uf2");
  add_device(command, arguments->device);
  command
      .add_option("--drive", arguments->drive,
                  "Folder where the boot loader's drive RPI-RP2 is or will be mounted")
      ->type_name("PATH");
  command
      .add_option("--wait", arguments->wait,
                  "Seconds to wait for the drive, and again for the board; 0: do not wait")
      ->capture_default_str()
      ->type_name("S");
  command.add_flag("--verify", arguments->verify, "Only check the files; needs no board");
  command.add_flag("--again", arguments->again, "Write the firmware even if the board already runs it");
  command.footer(
      std::string(
          "Example:\n"
          "  symrig flash symrig-pico.uf2\n"
          "\n"
          "Checks the file, restarts the board in its boot loader, and copies the file to the drive that "
          "appears. Then it\n"
          "waits for the board and compares version and hash. If the board does not run symrig's firmware "
          "yet, hold its\n"
          "BOOTSEL button while you plug it in.\n") +
      kDeviceHelp + "\n" + kExitCodes);
  takes_number<double>(command.get_option("--wait"));
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
