// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/board/link.hpp"
#include "symrig/protocol/messages.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

namespace symrig {
namespace {

/// [bytes] of replies that a host has not read. With more, it is disconnected.
constexpr std::size_t kMostWaiting = std::size_t{1} << 20;
/// 256 kB: all that a socket keeps, so the end of a host that has left is seen before the next one is
/// answered.
constexpr int kReadsARound = 64;
/// Hosts that come while another one uses the board: how many at a time, and how long they may take to ask.
constexpr std::size_t kGuests = 8;
constexpr Nanoseconds kGuestTime{1'000'000'000};
/// A process that did not run for longer lets the board's clock stand still for the rest.
constexpr Nanoseconds kMostLag{1'000'000'000};

Result<DeviceUri> simulated_device(const std::string& device) {
  SYMRIG_TRY(DeviceUri uri, DeviceUri::parse(device));
  if (uri.transport == Transport::sim) return uri;
  return Error{ErrorCode::bad_argument, fmt::format("'{}' is no simulated board", device), "give sim:"};
}

}  // namespace

class BoardServer::ServedBoard {
 public:
  ServedBoard(std::unique_ptr<Link> board, board::ListeningPlace place)
      : board_(std::move(board)), place_(std::move(place)) {}
  ServedBoard(const ServedBoard&) = delete;
  ServedBoard& operator=(const ServedBoard&) = delete;
  ~ServedBoard() = default;

  void run(const std::function<bool()>& keep_going) {
    const Stopwatch watch;
    Nanoseconds begin = board_->now();
    while (keep_going()) {
      wait();
      const Nanoseconds lag = watch.elapsed() + begin - board_->now();
      if (lag > kMostLag) begin -= lag - kMostLag;
      // First the time, then the requests: the board stamps them with the time at which they came.
      follow(watch.elapsed() + begin);
      if (host_) take_requests();
      answer_guests();
      accept();
      follow(watch.elapsed() + begin);
      if (host_) send_replies();
    }
  }

 private:
  /// Until there is something to read, a millisecond at most.
  void wait() const {
    std::array<pollfd, 2> both{{{place_.fd(), POLLIN, 0}, {host_.get(), POLLIN, 0}}};
    ::poll(both.data(), host_ ? 2 : 1, 1);
  }

  /// A host that comes as another leaves may be seen first. So it is a guest for a round, after which it is
  /// clear whether the other one is still there.
  void accept() {
    if (guests_.size() == kGuests) return;
    if (Fd fd = place_.accept()) guests_.push_back({std::move(fd), {}, Deadline(kGuestTime)});
  }

  void answer_guests() {
    if (!host_ && !guests_.empty()) {
      host_ = std::move(guests_.front().fd);
      guests_.erase(guests_.begin());
    }
    std::erase_if(guests_, [](Guest& guest) {
      std::array<std::uint8_t, 1024> bytes{};
      const ssize_t count = ::recv(guest.fd.get(), bytes.data(), bytes.size(), 0);
      if (count < 0 && (errno == EAGAIN || errno == EINTR)) return guest.deadline.passed();
      if (count <= 0) return true;
      const protocol::ByteView answer = guest.busy.take({bytes.data(), static_cast<std::size_t>(count)});
      if (answer.size > 0) ::send(guest.fd.get(), answer.data, answer.size, MSG_NOSIGNAL);
      return answer.size > 0;
    });
  }

  void take_requests() {
    std::array<std::uint8_t, 4096> bytes{};
    for (int reads = 0; host_ && reads < kReadsARound; ++reads) {
      const ssize_t count = ::recv(host_.get(), bytes.data(), bytes.size(), 0);
      if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (count <= 0 || !board_->send(std::span(bytes).first(static_cast<std::size_t>(count)))) leave();
    }
  }

  /// Moves the board's clock on to this time.
  void follow(Nanoseconds until) {
    while (board_->now() < until) {
      const auto bytes = board_->receive(until - board_->now());
      if (!bytes) return;
      if (host_) replies_.insert(replies_.end(), bytes->begin(), bytes->end());
    }
  }

  void send_replies() {
    if (replies_.empty()) return;
    const ssize_t count = ::send(host_.get(), replies_.data(), replies_.size(), MSG_NOSIGNAL);
    if (count > 0) replies_.erase(replies_.begin(), replies_.begin() + count);
    if ((count < 0 && errno != EAGAIN && errno != EINTR) || replies_.size() > kMostWaiting) leave();
  }

  /// The board goes on, as a real one does: its keep-alive notices that the host is gone.
  void leave() {
    host_ = Fd();
    replies_.clear();
  }

  std::unique_ptr<Link> board_;
  board::ListeningPlace place_;
  Fd host_;
  std::vector<std::uint8_t> replies_;
  struct Guest {
    Fd fd;
    protocol::BusyAnswer busy;
    Deadline deadline;
  };
  std::vector<Guest> guests_;
};

BoardServer::BoardServer(std::unique_ptr<ServedBoard> served) : served_(std::move(served)) {}
BoardServer::BoardServer(BoardServer&&) noexcept = default;
BoardServer& BoardServer::operator=(BoardServer&&) noexcept = default;
BoardServer::~BoardServer() = default;

Result<BoardServer> BoardServer::open(const std::string& device, const std::string& place) {
  SYMRIG_TRY(const DeviceUri simulated, simulated_device(device));
  SYMRIG_TRY(board::ListeningPlace listening, board::ListeningPlace::open(place));
  SYMRIG_TRY(std::unique_ptr<Link> board, board::open_sim_device(simulated));
  return BoardServer(std::make_unique<ServedBoard>(std::move(board), std::move(listening)));
}

void BoardServer::run(const std::function<bool()>& keep_going) {
  served_->run(keep_going);
}

}  // namespace symrig
