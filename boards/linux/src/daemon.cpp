// SPDX-License-Identifier: Apache-2.0
#include "daemon.hpp"

#include "process.hpp"
#include "symrig/protocol/line_config.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace symrig::board_linux {
namespace {

constexpr hal::Tick kPlayingPause =
    2 * kMillisecond;  // between two checks of the queue (poll_ticks depends on it)
constexpr hal::Tick kIdlePause = 100 * kMillisecond;    // a quarter of the player's usual patience
constexpr hal::Tick kLongSave = 60'000 * kMillisecond;  // a worn memory card
constexpr hal::Tick kPetPause = 500 * kMillisecond;

std::vector<hal::Line> lines_of(const BoardFile& file, const Abilities& can) {
  std::vector<hal::Line> lines;
  for (const BoardLine& line : file.lines) {
    const std::string& pin = line.pin.empty() ? line.gpio : line.pin;
    lines.push_back({line.name.c_str(), pin.c_str(), line.output,
                     line.output ? std::uint8_t{0} : hal::waits::all, !line.output,
                     line.output ? can.output_stamp : can.input_stamp});
  }
  return lines;
}

std::uint32_t outputs_of(const BoardFile& file) {
  std::uint32_t mask = 0;
  for (std::size_t k = 0; k < file.lines.size(); ++k)
    if (file.lines[k].output) mask |= 1U << k;
  return mask;
}

PlayerOptions player_options(const BoardFile& file, const Abilities& can, std::uint32_t outputs,
                             std::size_t depth, hal::Tick patience) {
  PlayerOptions options;
  options.promise = can.promise;
  options.depth = depth;
  options.output_mask = outputs;
  options.spin = can.spin;
  options.priority = file.priority;
  options.patience = patience;
  return options;
}

}  // namespace

Daemon::Daemon(Parts parts)
    : parts_(std::move(parts)),
      lines_(lines_of(parts_.file, parts_.abilities)),
      output_mask_(outputs_of(parts_.file)),
      settings_(
          parts_.file.state_folder / "settings", [this] { player_->excuse(kLongSave); },
          [this] { player_->feed(); }),
      faults_(parts_.file.run_folder / "fault"),
      safe_file_(parts_.file.run_folder / "safe-levels"),
      mark_(parts_.file.run_folder / "run"),
      led_(parts_.file.led),
      links_(std::move(parts_.transports)),
      program_(kProgramRecords * protocol::kRecordSize),
      events_(kEvents),
      marks_(kSegments) {
  describe();
  player_ = std::make_unique<Player>(
      *parts_.gpio, player_options(parts_.file, parts_.abilities, output_mask_, kSegments, parts_.patience));
  capture_.emplace(*player_);
  board_.emplace(
      hal::Board{traits_, clock_, *player_, *capture_, links_, faults_, *player_, led_, settings_, *this});
}

Daemon::~Daemon() = default;

void Daemon::describe() {
  const Abilities& can = parts_.abilities;
  traits_.name = parts_.file.name.c_str();
  traits_.unique_id = parts_.id.data();
  traits_.unique_id_size = static_cast<std::uint8_t>(parts_.id.size());
  traits_.lines = lines_.data();
  traits_.line_count = static_cast<std::uint8_t>(lines_.size());
  traits_.tick_hz = kTickHz;
  traits_.min_dwell = can.promise.min_dwell;
  traits_.wait_latency = can.promise.wait_latency;
  traits_.queue_segments = kSegments;
  traits_.refill_ticks = can.refill_ticks;
  traits_.poll_ticks = can.poll_ticks;
  traits_.lateness = can.promise.lateness;
}

void Daemon::start_core(hal::ResetCause cause) {
  cause_ = cause;
  core_.emplace(*board_, firmware::Memory{{program_.data(), program_.size()},
                                          events_.data(),
                                          kEvents,
                                          {marks_.data(), static_cast<std::uint32_t>(marks_.size())}});
  core_->boot();
  note_safe_levels();
}

/// A daemon has no boot loader: its package updates it.
void Daemon::reboot(bool) {
  reboot_asked_ = true;
}

Result<void> Daemon::run(int stop) {
  const Emergency emergency(*parts_.gpio);
  const std::string slow = player_->begin();
  if (!slow.empty()) log_line("the player may be late: " + slow);
  if (parts_.file.priority > 1) run_first(parts_.file.priority - 1);  // the player reported any failure
  start_core(mark_.begin());
  Result<void> ended = serve(stop);
  player_->force(core_->safe_levels());
  if (ended) mark_.end_well();
  return ended;
}

Result<void> Daemon::serve(int stop) {
  notify_manager("READY=1");
  while (!wait_for_work(stop)) SYMRIG_CHECK(turn());
  notify_manager("STOPPING=1");
  return {};
}

Result<void> Daemon::turn() {
  links_.serve(clock_.now());
  SYMRIG_CHECK(check_player());
  if (player_->take_starved()) {
    log_line("the daemon was blocked for too long: outputs were made safe, the board restarts");
    start_core(hal::ResetCause::watchdog);
  }
  core_->poll();
  if (std::exchange(reboot_asked_, false)) start_core(hal::ResetCause::request);
  note_safe_levels();
  tell_holder();
  tell_fault();
  pet_manager();
  return {};
}

hal::Tick Daemon::next_work() const {
  const hal::Tick now = clock_.now();
  if (core_->busy()) return now;
  const hal::Tick pause = player_->idle() ? kIdlePause : kPlayingPause;
  return std::min({core_->next_deadline(), capture_->ready_at(), now + pause});
}

/// true: the daemon should end.
bool Daemon::wait_for_work(int stop) {
  fds_.assign(1, {});  // the alarm's
  fds_.push_back({stop, POLLIN, 0});
  fds_.push_back({player_->attention_fd(), POLLIN, 0});
  links_.watch(fds_);
  alarm_.wait(next_work(), fds_);
  if (fds_[2].revents != 0) player_->quiet_attention();
  return fds_[1].revents != 0;
}

Result<void> Daemon::check_player() const {
  if (const int error = player_->broken(); error != 0)
    return Error{ErrorCode::device_lost, fmt::format("a GPIO line failed ({})", std::strerror(error)),
                 "check the chip and its driver (gpioinfo, kernel log)"};
  const hal::Tick last = player_->last_round();
  // The player's state is unknown now. The signal handler of abort() makes the lines safe without it.
  if (clock_.now() > last + 5 * parts_.patience) std::abort();
  return {};
}

void Daemon::note_safe_levels() {
  const std::uint32_t safe = core_->safe_levels() & output_mask_;
  Emergency::set_safe(safe);
  if (noted_safe_ == safe) return;
  noted_safe_ = safe;
  if (!safe_file_.save(safe)) log_line("cannot write the safe levels to the run folder");
}

void Daemon::tell_holder() {
  std::string holder = links_.holder();
  if (holder == told_holder_) return;
  log_line(holder.empty() ? "host disconnected (" + told_holder_ + ")" : "host connected (" + holder + ")");
  told_holder_ = std::move(holder);
}

void Daemon::tell_fault() {
  const hal::FaultRecord& fault = core_->fault();
  if (fault.code == told_fault_) return;
  told_fault_ = fault.code;
  if (fault.code != 0)
    log_line(fmt::format("fault {} (argument {}): outputs are safe until a host clears it", fault.code,
                         fault.arg));
}

void Daemon::pet_manager() {
  const hal::Tick now = clock_.now();
  if (now < petted_ + kPetPause) return;
  petted_ = now;
  notify_manager("WATCHDOG=1");
}

std::uint32_t kept_safe_levels(const BoardFile& file) {
  const SafeLevelsFile in_force(file.run_folder / "safe-levels");
  if (const auto levels = in_force.load()) return *levels & outputs_of(file);
  const SettingsFile settings(file.state_folder / "settings");
  const std::vector<hal::Line> lines = lines_of(file, {});
  hal::BoardTraits traits;
  traits.lines = lines.data();
  traits.line_count = static_cast<std::uint8_t>(lines.size());
  protocol::BoardConfig config;
  firmware::Label label;
  return firmware::load_config(settings, traits, config, label) ? config.safe_levels() : 0;
}

}  // namespace symrig::board_linux
