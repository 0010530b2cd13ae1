// SPDX-License-Identifier: Apache-2.0

#include "ranks.hpp"

#include "petsc.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>
#include <mpi.h>

namespace symrig::mpi {

namespace {

/// MPI counts in int.
constexpr std::size_t kMostAtOnce = std::size_t{1} << 28;

template <class T>
void add_up_values(std::span<T> values, MPI_Datatype type, bool first) {
  for (std::size_t begin = 0; begin < values.size(); begin += kMostAtOnce) {
    T* const part = values.data() + begin;
    const int size = static_cast<int>(std::min(kMostAtOnce, values.size() - begin));
    MPI_Reduce(first ? MPI_IN_PLACE : part, first ? part : nullptr, size, type, MPI_SUM, 0, MPI_COMM_WORLD);
  }
}

std::string host_name() {
  std::array<char, MPI_MAX_PROCESSOR_NAME> name{};
  int size = 0;
  MPI_Get_processor_name(name.data(), &size);
  return {name.data(), static_cast<std::size_t>(size)};
}

}  // namespace

Ranks Ranks::world() {
  int rank = 0, count = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &count);
  return {rank, count};
}

void Ranks::broadcast_bytes(std::span<std::byte> bytes, int from) {
  for (std::size_t begin = 0; begin < bytes.size(); begin += kMostAtOnce)
    MPI_Bcast(bytes.data() + begin, static_cast<int>(std::min(kMostAtOnce, bytes.size() - begin)), MPI_BYTE,
              from, MPI_COMM_WORLD);
}

void Ranks::broadcast_text(std::string& text, int from) const {
  std::uint64_t size = text.size();
  broadcast_value(size, from);
  text.resize(size);
  broadcast(std::span(text.data(), text.size()), from);
}

void Ranks::add_up(std::span<float> values) const {
  add_up_values(values, MPI_FLOAT, first());
}

void Ranks::add_up(std::span<double> values) const {
  add_up_values(values, MPI_DOUBLE, first());
}

void Ranks::add_up_for_all(std::span<double> values) const {
  if (count_ == 1) return;
  for (std::size_t begin = 0; begin < values.size(); begin += kMostAtOnce)
    MPI_Allreduce(MPI_IN_PLACE, values.data() + begin,
                  static_cast<int>(std::min(kMostAtOnce, values.size() - begin)), MPI_DOUBLE, MPI_SUM,
                  MPI_COMM_WORLD);
}

void Ranks::hand_to_first(std::span<float> values, int from) const {
  if (from == 0 || (rank_ != 0 && rank_ != from)) return;
  constexpr int kTag = 1;
  for (std::size_t begin = 0; begin < values.size(); begin += kMostAtOnce) {
    const int size = static_cast<int>(std::min(kMostAtOnce, values.size() - begin));
    if (rank_ == from)
      MPI_Send(values.data() + begin, size, MPI_FLOAT, 0, kTag, MPI_COMM_WORLD);
    else
      MPI_Recv(values.data() + begin, size, MPI_FLOAT, from, kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  }
}

std::vector<std::uint64_t> Ranks::gather(std::uint64_t value) const {
  std::vector<std::uint64_t> all(first() ? static_cast<std::size_t>(count_) : 0);
  MPI_Gather(&value, 1, MPI_UINT64_T, all.data(), 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
  return all;
}

Result<void> Ranks::all(const Result<void>& mine) const {
  const int failed = mine ? count_ : rank_;
  int lowest = count_;
  MPI_Allreduce(&failed, &lowest, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  if (lowest == count_) return {};
  auto code = static_cast<std::uint16_t>(mine ? ErrorCode::io : mine.error().code);
  std::string what, hint;
  if (lowest == rank_) {
    what = lowest == 0 ? mine.error().what
                       : fmt::format("rank {} on {}: {}", rank_, host_name(), mine.error().what);
    hint = mine.error().hint;
  }
  broadcast_value(code, lowest);
  broadcast_text(what, lowest);
  broadcast_text(hint, lowest);
  return Error{static_cast<ErrorCode>(code), std::move(what), std::move(hint)};
}

Session::Session(int& argc, char**& argv) {
  int given = 0;  // threads other than this one never call MPI
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &given);
}

Session::~Session() {
  end_petsc();
  MPI_Finalize();
}

void meet() {
  MPI_Barrier(MPI_COMM_WORLD);
}

void abort_all(int exit_code) {
  MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::abort();
}

Together::~Together() {
  if (done_) return;
  write_standard_error(
      "symrig-mpi: a rank cannot go on (out of memory?); use more machines or a smaller scene\n");
  abort_all(exit_code(ErrorCode::limit));
}

Result<void> start_petsc() {
  PetscBool started = PETSC_FALSE;
  SYMRIG_CHECK(checked(PetscInitialized(&started), "PetscInitialized"));
  if (started == PETSC_TRUE) return {};
  PETSC_COMM_WORLD = MPI_COMM_SELF;
  SYMRIG_CHECK(checked(PetscOptionsSetValue(nullptr, "-no_signal_handler", "1"), "PetscOptionsSetValue"));
  SYMRIG_CHECK(checked(PetscOptionsSetValue(nullptr, "-skip_petscrc", "1"), "PetscOptionsSetValue"));
  SYMRIG_CHECK(checked(PetscInitializeNoArguments(), "PetscInitialize"));
  return checked(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr), "PetscPushErrorHandler");
}

void end_petsc() {
  PetscBool started = PETSC_FALSE;
  if (PetscInitialized(&started) == 0 && started == PETSC_TRUE) static_cast<void>(PetscFinalize());
}

Result<void> checked(PetscErrorCode code, const char* call) {
  if (code == 0) return {};
  return Error{ErrorCode::fault, fmt::format("{} of PETSc failed with code {}", call, static_cast<int>(code)),
               "report this with the scene and the command"};
}

Result<VecOwner> new_vec(PetscInt n) {
  Vec vec = nullptr;
  SYMRIG_CHECK(checked(VecCreateSeq(PETSC_COMM_SELF, n, &vec), "VecCreateSeq"));
  return VecOwner(vec);
}

}  // namespace symrig::mpi
