// SPDX-License-Identifier: Apache-2.0
#include "player.hpp"

#include "clock.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <future>
#include <span>
#include <utility>

#include <poll.h>

namespace symrig::board_linux {
namespace {

constexpr std::size_t kEdgesAtOnce = 256;
constexpr int kReadsARound = 4;  // 1,024 edges: what the kernel keeps of a request

}  // namespace

Player::Player(Gpio& gpio, const PlayerOptions& options)
    : PlaybackEngine(*this, options.promise, options.depth),
      gpio_(gpio),
      options_(options),
      log_(options.captured, options.promise.input, gpio.edge_fds().size() <= 1),
      edges_(kEdgesAtOnce),
      edge_fds_(gpio.edge_fds().begin(), gpio.edge_fds().end()),
      fed_(monotonic_now()),
      round_(monotonic_now()) {}

Player::~Player() {
  stopping_ = true;
  nudge_.ring();
  if (thread_.joinable()) thread_.join();
}

std::string Player::begin() {
  if (!alarm_.ok() || !nudge_.ok() || !attention_.ok()) return "no timers or events: too many open files";
  feed();
  round_ = monotonic_now();
  std::promise<std::string> started;
  auto prompt = started.get_future();
  thread_ = std::thread([this, started = std::move(started)]() mutable {
    started.set_value(options_.priority > 0 ? run_first(options_.priority) : std::string());
    run();
  });
  return prompt.get();
}

void Player::push(const hal::Segment& segment) {
  locked([&] {
    playback_.push(segment);
    if (playback_.queued() * 2 > options_.depth) half_told_ = false;
  });
}

/// Makes a start that is due now at once, without waiting for the thread.
hal::Tick Player::start(hal::Tick tick) {
  const hal::Tick begin = PlaybackEngine::start(tick);
  nudge_.ring();
  return begin;
}

hal::Tick Player::now() const {
  return monotonic_now();
}

void Player::feed() {
  fed_ = monotonic_now();
}

void Player::excuse(hal::Tick time) {
  fed_ = monotonic_now() + time;
}

bool Player::take_starved() {
  return starved_.exchange(false);
}

/// Writes only lines that change, because chips set lines one after the other.
hal::Tick Player::put(std::uint32_t levels) {
  return drive(levels, shown_ ^ levels);
}

hal::Tick Player::put_all(std::uint32_t levels) {
  return drive(levels, UINT32_MAX);
}

/// Call with the lock held. The word was on the outputs at some moment between the two clock readings.
hal::Tick Player::drive(std::uint32_t levels, std::uint32_t lines) {
  const std::uint32_t wanted = levels & options_.output_mask;
  const hal::Tick before = monotonic_now();
  if (!gpio_.put(wanted, lines)) broken_ = errno;  // the main loop ends the daemon
  const hal::Tick after = monotonic_now();
  log_.add_changes(shown_ ^ wanted, wanted, before + (after - before) / 2);
  shown_ = wanted;
  return after;
}

std::uint32_t Player::inputs() {
  std::uint32_t levels = 0;
  if (!gpio_.inputs(levels)) broken_ = errno;
  return levels;
}

void Player::run() {
  while (!stopping_) {
    hal::Tick due = hal::kNever;
    {
      const PriorityLock lock(mutex_);
      due = playback_.due();
    }
    const hal::Tick hungry = fed_ + options_.patience;
    sleep_until(std::min(due == hal::kNever ? due : due - std::min(due, options_.spin), hungry));
    read_edges();
    play_on();
    watch_feeding();
    round_ = monotonic_now();
  }
}

/// Sleeps until `tick`, an edge, or a nudge.
void Player::sleep_until(hal::Tick tick) {
  std::array<pollfd, 2 + 32> fds{};
  std::size_t count = 1;  // the first is the alarm's
  fds.at(count++) = {nudge_.fd(), POLLIN, 0};
  for (const int fd : edge_fds_) fds.at(count++) = {fd, POLLIN, 0};
  alarm_.wait(tick, std::span(fds).first(count));
  if (fds[1].revents != 0) nudge_.quiet();
  constexpr short kGone = POLLERR | POLLHUP | POLLNVAL;
  for (std::size_t k = 2; k < count; ++k)
    if ((fds.at(k).revents & kGone) != 0) lose_chip(fds.at(k).fd);
}

/// A USB GPIO chip was unplugged. Its descriptor would always be readable.
void Player::lose_chip(int fd) {
  std::erase(edge_fds_, fd);
  broken_ = ENODEV;
  attention_.ring();
}

/// Watches the clock for the last microseconds before a word, because a sleep would end too late. It holds
/// the lock, so no other thread has it when the word is due. force() waits at most that long.
void Player::await_due() const {
  const hal::Tick due = playback_.due();
  const hal::Tick now = monotonic_now();
  if (due == hal::kNever || due > now + options_.spin) return;
  while (monotonic_now() < due) {
  }
}

/// As many edges as the kernel keeps, and no more: an input that chatters always has one more. The rest
/// follows in the next round, after the words that are due.
void Player::read_edges() {
  std::size_t count = edges_.size();
  for (int left = kReadsARound; left > 0 && count == edges_.size(); --left) {
    bool lost = false;
    count = gpio_.read_edges(edges_, lost);
    if (count > 0 || lost) take_edges(count, lost);
  }
}

void Player::take_edges(std::size_t count, bool lost) {
  const PriorityLock lock(mutex_);
  for (std::size_t k = 0; k < count; ++k) {
    const hal::CapturedEdge& edge = edges_[k];
    log_.add_input(edge);
    playback_.input(edge);
  }
  if (lost) {
    log_.lose();
    playback_.inputs_are(inputs());  // a trip may be among the lost edges
  }
  attention_.ring();
}

void Player::play_on() {
  const PriorityLock lock(mutex_);
  const std::uint64_t played = playback_.played();
  const bool was_idle = playback_.idle();
  const bool was_waiting = playback_.waiting();
  await_due();
  while (playback_.due() <= monotonic_now()) playback_.act(monotonic_now());
  const bool half_empty = !half_told_ && playback_.queued() * 2 <= options_.depth;
  half_told_ = half_told_ || half_empty;
  const bool ended = playback_.idle() && !was_idle;
  const bool moved = playback_.played() != played && log_.ready_at() != hal::kNever;
  const bool waited = was_waiting && !playback_.waiting();
  if (ended || moved || waited || half_empty || broken_ != 0) attention_.ring();
}

/// The dead-man switch: makes the outputs safe if the main loop is blocked.
void Player::watch_feeding() {
  if (monotonic_now() < fed_ + options_.patience) return;
  {
    const PriorityLock lock(mutex_);
    playback_.fall();
  }
  starved_ = true;
  feed();  // do not fall again at once
  attention_.ring();
}

std::uint32_t PinCapture::levels() const {
  const PriorityLock lock(player_.mutex_);
  return player_.shown_ | player_.inputs();
}

bool PinCapture::pop(hal::CapturedEdge& edge) {
  const PriorityLock lock(player_.mutex_);
  return player_.log_.pop(edge, monotonic_now());
}

bool PinCapture::take_overflow() {
  const PriorityLock lock(player_.mutex_);
  return player_.log_.take_overflow();
}

void PinCapture::watch(std::uint32_t lines) {
  const PriorityLock lock(player_.mutex_);
  player_.log_.watch(lines);
}

hal::Tick PinCapture::ready_at() const {
  const PriorityLock lock(player_.mutex_);
  return player_.log_.ready_at();
}

}  // namespace symrig::board_linux
