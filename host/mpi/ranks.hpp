// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig::mpi {

/// The processes that mpirun started, the *ranks*. Every call is made by all of them, in the same order. If a
/// rank dies in between, mpirun ends the others.
class Ranks {
 public:
  /// All of them. MPI must run (Session).
  static Ranks world();

  int rank() const { return rank_; }
  int count() const { return count_; }
  bool first() const { return rank_ == 0; }

  /// Everyone gets the values that rank `from` has.
  template <class T>
  void broadcast(std::span<T> values, int from = 0) const {
    broadcast_bytes(std::as_writable_bytes(values), from);
  }
  template <class T>
  void broadcast_value(T& value, int from = 0) const {
    broadcast(std::span(&value, 1), from);
  }
  /// On the first rank, what broadcast() is on the others: they get these values.
  template <class T>
  void send(std::span<const T> values) const {
    const auto bytes = std::as_bytes(values);
    // MPI reads there: its C interface has no const.
    broadcast_bytes({const_cast<std::byte*>(bytes.data()), bytes.size()}, 0);
  }
  void broadcast_text(std::string& text, int from = 0) const;

  /// The first rank gets Σ over the ranks, value by value, in place; the others keep theirs.
  /// error: ≤ (count() − 1) ε Σ |value|, ε = 2⁻²⁴ (2⁻⁵³ for double), in whatever order MPI adds.
  void add_up(std::span<float> values) const;
  void add_up(std::span<double> values) const;

  /// The same sum, on every rank.
  void add_up_for_all(std::span<double> values) const;

  /// The first rank gets the values that rank `from` has, in place; all others do nothing.
  void hand_to_first(std::span<float> values, int from) const;

  /// What each rank gives, in the order of the ranks; empty on all but the first.
  std::vector<std::uint64_t> gather(std::uint64_t value) const;

  /// The failure of the lowest rank that failed, on all ranks, or success. The text names the rank.
  Result<void> all(const Result<void>& mine) const;

 private:
  Ranks(int rank, int count) : rank_(rank), count_(count) {}
  static void broadcast_bytes(std::span<std::byte> bytes, int from);

  int rank_, count_;
};

/// MPI from its start to its end. Without mpirun there is one rank.
class Session {
 public:
  Session(int& argc, char**& argv);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();
};

/// Waits until all ranks are here.
void meet();

/// Ends all ranks at once: this one cannot go on.
[[noreturn]] void abort_all(int exit_code);

/// What the first rank asks of the others, which wait in help().
struct Request {
  enum Kind : std::int32_t { open, photographs, adjoint, refit, end } kind;
  std::int32_t number = 0;  ///< of patterns, or the exit code
};

/// From a request to the end of its work. Whoever leaves before done(), by an error or an exception, would
/// leave the other ranks waiting, so it ends them.
class Together {
 public:
  /// On the first rank.
  Together(const Ranks& ranks, Request request) { ranks.broadcast_value(request); }
  /// On a rank that has got a request.
  Together() = default;
  Together(const Together&) = delete;
  Together& operator=(const Together&) = delete;
  ~Together();
  void done() { done_ = true; }

 private:
  bool done_ = false;
};

}  // namespace symrig::mpi
