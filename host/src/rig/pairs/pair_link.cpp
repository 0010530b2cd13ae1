// SPDX-License-Identifier: Apache-2.0

#include "symrig/rig/pair_link.hpp"

#include "rig/pairs/pair_words.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/links.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <poll.h>
#include <sys/socket.h>

namespace symrig::rig {

namespace {

constexpr std::size_t kProofBytes = kProofDigits / 2;

std::string hexadecimal(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

Result<std::string> random_challenge() {
  std::array<unsigned char, kProofBytes> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) == 1) return hexadecimal(bytes);
  return Error{ErrorCode::io, "the system gives no random bytes for a challenge", "try again"};
}

std::string proof_of(std::string_view secret, Prover prover, std::string_view of_pair,
                     std::string_view of_host) {
  const std::string text =
      fmt::format("{} {} {} {}", kPairGreeting, prover == Prover::host ? "host" : "pair", of_pair, of_host);
  std::array<unsigned char, kProofBytes> proof{};
  unsigned int size = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how OpenSSL takes bytes
  const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
  const bool made = HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), bytes, text.size(),
                         proof.data(), &size) != nullptr;
  return made && size == proof.size() ? hexadecimal(proof) : std::string();
}

bool same_proof(std::string_view one, std::string_view other) {
  return one.size() >= kProofDigits && one.size() == other.size() &&
         CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

bool is_challenge(std::string_view text) {
  return text.size() == kProofDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace symrig::rig

namespace symrig {

namespace {

constexpr std::uint64_t kLongestSecret = 4096;
constexpr std::size_t kShortestSecret = 16;  // bytes: nobody guesses as many random ones

bool others_can_read(const std::string& file) {
  using std::filesystem::perms;
  std::error_code failed;
  const auto status = std::filesystem::status(file, failed);
  return !failed && (status.permissions() & (perms::group_all | perms::others_all)) != perms::none;
}

}  // namespace

Result<std::string> read_pair_secret(const std::string& file) {
  SYMRIG_TRY(const auto bytes, read_file(file, kLongestSecret));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): text of a file
  std::string secret(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  secret.erase(secret.find_last_not_of("\r\n") + 1);
  if (others_can_read(file))
    return Error{ErrorCode::bad_value, fmt::format("{}: other users can read this secret", file),
                 fmt::format("run: chmod 600 {}", file)};
  if (secret.size() >= kShortestSecret) return secret;
  return Error{
      ErrorCode::bad_value,
      fmt::format("{}: the secret has {} bytes, but needs at least {}", file, secret.size(), kShortestSecret),
      "write a random one: openssl rand -hex 32"};
}

namespace {

constexpr Nanoseconds kConnectTime{10'000'000'000};
constexpr Nanoseconds kGreetingPatience{20'000'000'000};
constexpr Nanoseconds kAnswerPatience{600'000'000'000};  // a pair may compute for long
constexpr Nanoseconds kGlanceAtPair{100'000'000};        // how often keep_waiting is asked
constexpr std::size_t kQuotedAnswer = 200;

bool would_block() {
  return errno == EAGAIN || errno == EINTR;
}

Result<Fd> connect_pair(const DeviceUri& uri) {
  auto fd = uri.transport == Transport::unix_socket ? board::connect_unix(uri.place)
                                                    : board::connect_tcp(uri.place, uri.port, kConnectTime);
  if (!fd && fd.error().code == ErrorCode::device_lost)
    return Error{fd.error().code, fd.error().what, "check that `symrig serve --pair` runs there"};
  return fd;
}

}  // namespace

/// The socket, without the greeting.
class PairLink::Talk {
 public:
  Talk(Fd fd, std::string place, KeepWaiting keep_waiting)
      : fd_(std::move(fd)), place_(std::move(place)), keep_waiting_(std::move(keep_waiting)) {}

  const std::string& place() const { return place_; }
  void set_patience(Nanoseconds patience) { patience_ = patience; }

  /// A pair that speaks before it was asked complains: then the rest is not sent.
  Result<void> send(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      SYMRIG_TRY(const short ready, wait(POLLIN | POLLOUT));
      if ((ready & POLLIN) != 0) return complaint();
      const ssize_t sent = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0 && !would_block()) return lost();
      if (sent > 0) bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
    return {};
  }

  Result<void> receive(std::span<std::byte> into) {
    while (!into.empty()) {
      const ssize_t got = ::recv(fd_.get(), into.data(), into.size(), 0);
      if (got == 0 || (got < 0 && !would_block())) return lost();
      if (got > 0) into = into.subspan(static_cast<std::size_t>(got));
      if (got < 0) SYMRIG_CHECK(wait(POLLIN));
    }
    return {};
  }

  /// A line, without its end. "error: ..." and "busy: ..." are errors.
  Result<std::string> receive_line() {
    std::string line;
    while (line.size() < rig::kLongestPairLine) {
      std::byte one{};
      SYMRIG_CHECK(receive({&one, 1}));
      if (static_cast<char>(one) == '\n') return checked(std::move(line));
      line += static_cast<char>(one);
    }
    return garbage(line);
  }

  Error garbage(std::string_view answer) const {
    return {ErrorCode::protocol,
            fmt::format("{} answers '{}', which is no answer of a pair", place_,
                        printable_line(answer.substr(0, kQuotedAnswer))),
            "see docs/pair-protocol.md"};
  }

 private:
  Error lost() const {
    return {ErrorCode::device_lost, fmt::format("{} has closed the connection", place_),
            "check that `symrig serve --pair` still runs there"};
  }

  Result<std::string> checked(std::string line) const {
    constexpr std::string_view kError = "error: ", kBusy = "busy: ", kLost = "lost: ";
    const std::string text = printable_line(line);
    if (line.starts_with(kBusy))
      return Error{ErrorCode::device_lost, fmt::format("{} answers '{}'", place_, text),
                   "end the other host"};
    if (line.starts_with(kLost))
      return Error{ErrorCode::device_lost, fmt::format("{}: {}", place_, text.substr(kLost.size()))};
    if (!line.starts_with(kError)) return line;
    return Error{ErrorCode::device_refused,
                 fmt::format("{} refuses: {}", place_, text.substr(kError.size()))};
  }

  Result<void> complaint() {
    SYMRIG_TRY(const std::string line, receive_line());
    return garbage(line);
  }

  /// Which of `events` have come.
  Result<short> wait(short events) const {
    const Deadline deadline(patience_);
    for (;;) {
      pollfd one{fd_.get(), events, 0};
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(std::min(deadline.left(), kGlanceAtPair));
      if (::poll(&one, 1, static_cast<int>(left.count())) > 0) return one.revents;
      if (keep_waiting_ && !keep_waiting_())
        return Error{ErrorCode::interrupted, fmt::format("stopped while {} worked", place_)};
      if (deadline.passed())
        return Error{ErrorCode::timeout,
                     fmt::format("{} moved no byte for {:.3g} s", place_, seconds(patience_)),
                     "check the pair's computer and the network"};
    }
  }

  Fd fd_;
  std::string place_;
  KeepWaiting keep_waiting_;
  Nanoseconds patience_ = kGreetingPatience;
};

namespace {

/// The value of "KEY=VALUE" in a line of such words.
std::string word_of(std::string_view line, std::string_view key) {
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, end);
    if (word.size() > key.size() && word.starts_with(key) && word[key.size()] == '=')
      return std::string(word.substr(key.size() + 1));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return {};
}

}  // namespace

PairLink::PairLink(std::unique_ptr<Talk> talk) : talk_(std::move(talk)) {}
PairLink::~PairLink() = default;

Result<std::unique_ptr<PairLink>> PairLink::open(const PairAddress& address, KeepWaiting keep_waiting) {
  const std::string place = address.uri.text();
  const bool tcp = address.uri.transport == Transport::tcp;
  if (!tcp && address.uri.transport != Transport::unix_socket)
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is no place of a pair", place),
                 "give tcp:HOST:PORT or unix:PATH"};
  std::string secret;
  if (!address.secret.empty()) {
    SYMRIG_TRY(secret, read_pair_secret(address.secret));
  }
  if (tcp && secret.empty())
    return Error{ErrorCode::bad_argument, fmt::format("{} needs a shared secret", place),
                 "give the file with the secret of its server"};
  SYMRIG_TRY(Fd fd, connect_pair(address.uri));
  std::unique_ptr<PairLink> link(
      new PairLink(std::make_unique<Talk>(std::move(fd), place, std::move(keep_waiting))));
  Talk& talk = *link->talk_;
  SYMRIG_TRY(const std::string own, rig::random_challenge());
  SYMRIG_CHECK(link->send(fmt::format("{} challenge={}\n", rig::kPairGreeting, own)));
  SYMRIG_TRY(const std::string greeting, talk.receive_line());
  const std::string challenge = word_of(greeting, "challenge");
  if (greeting == "open" && !secret.empty())
    return Error{ErrorCode::device_refused, fmt::format("{} asks for no secret, but you give one", place),
                 "start its server with the secret, or give none"};
  if (greeting != "open" && !rig::is_challenge(challenge)) return talk.garbage(greeting);
  if (greeting != "open" && secret.empty())
    return Error{ErrorCode::device_refused, fmt::format("{} asks for the shared secret", place),
                 "give the file with the secret of its server"};
  if (greeting != "open")
    SYMRIG_CHECK(
        link->send(fmt::format("proof={}\n", rig::proof_of(secret, rig::Prover::host, challenge, own))));
  SYMRIG_TRY(link->facts_, talk.receive_line());
  if (greeting != "open" &&
      !rig::same_proof(link->fact("proof"), rig::proof_of(secret, rig::Prover::pair, challenge, own)))
    return Error{ErrorCode::device_refused,
                 fmt::format("{} does not prove that it knows the shared secret", place),
                 "check who answers at this address"};
  if (link->fact("version") != "1" || link->fact("kind").empty()) return talk.garbage(link->facts_);
  talk.set_patience(kAnswerPatience);
  return link;
}

std::string PairLink::fact(std::string_view key) const {
  return word_of(facts_, key);
}

const std::string& PairLink::place() const {
  return talk_->place();
}

Result<void> PairLink::send(std::span<const std::byte> bytes) {
  return talk_->send(bytes);
}

Result<std::string> PairLink::receive_line() {
  return talk_->receive_line();
}

Result<void> PairLink::receive(std::span<std::byte> into) {
  return talk_->receive(into);
}

}  // namespace symrig
