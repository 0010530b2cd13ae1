// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/links.hpp"

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace symrig::rig {

/// Bytes to and from one client of a PhotographServer. While it waits, others that connect are turned away;
/// during a greeting they wait, because nobody knows yet whether the client is a stranger.
class ClientTalk {
 public:
  /// turned_away: keeps the last client that was refused. All but `client` must outlive this.
  ClientTalk(Fd client, const board::ListeningPlace& place, Fd& turned_away,
             const std::function<bool()>& keep_going)
      : client_(std::move(client)), place_(place), turned_away_(turned_away), keep_going_(keep_going) {}

  /// The greeting begins, and must end within this time, however many bytes arrive meanwhile.
  void begin_greeting(Nanoseconds limit) { greeting_.emplace(limit); }
  void end_greeting() { greeting_.reset(); }
  /// How long it waits for a byte in either direction; none: as long as it takes.
  void set_patience(std::optional<Nanoseconds> patience) { patience_ = patience; }

  // Each is false if the client has gone, is silent for too long, or the server ends.
  bool receive(std::span<std::byte> into);
  /// Reads up to a line feed, which is left out. A line that has begun must end within ten seconds. Stops at
  /// `longest` bytes, so line.size() == longest means that the line is too long.
  bool receive_line(std::string& line, std::size_t longest);
  bool send(std::span<const std::byte> bytes);
  bool send(std::string_view text) { return send(std::as_bytes(std::span(text))); }

  /// The last word to the client: it gets this line, whatever it still sends.
  void dismiss(std::string_view line);

 private:
  bool wait(short events);
  void turn_others_away();

  Fd client_;
  const board::ListeningPlace& place_;
  Fd& turned_away_;
  const std::function<bool()>& keep_going_;
  std::optional<Nanoseconds> patience_;
  std::optional<Deadline> greeting_, line_;
};

/// Serves the clients of a place, one after the other, until keep_going() is false. While one is served,
/// others are turned away.
void serve_clients(const board::ListeningPlace& place, const std::function<bool()>& keep_going,
                   const std::function<void(ClientTalk& talk)>& serve);

}  // namespace symrig::rig
