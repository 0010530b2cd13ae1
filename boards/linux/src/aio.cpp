// SPDX-License-Identifier: Apache-2.0
#include "aio.hpp"

#include <bit>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace symrig::board_linux {

Result<AioQueue> AioQueue::make(unsigned transfers) {
  aio_context_t context = 0;
  Fd bell(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!bell || ::syscall(SYS_io_setup, transfers, &context) != 0)
    return Error{ErrorCode::io, fmt::format("no asynchronous input and output ({})", std::strerror(errno)),
                 "raise fs.aio-max-nr"};
  return AioQueue(context, std::move(bell));
}

AioQueue::AioQueue(AioQueue&& other) noexcept
    : context_(std::exchange(other.context_, 0)), bell_(std::move(other.bell_)) {}

AioQueue::~AioQueue() {
  if (context_ != 0) ::syscall(SYS_io_destroy, context_);
}

bool AioQueue::submit(Transfer& transfer, int fd, std::size_t size, bool input) {
  transfer.request = {};
  transfer.request.aio_data = std::bit_cast<std::uintptr_t>(&transfer);
  transfer.request.aio_fildes = static_cast<std::uint32_t>(fd);
  transfer.request.aio_lio_opcode = input ? IOCB_CMD_PREAD : IOCB_CMD_PWRITE;
  transfer.request.aio_buf = std::bit_cast<std::uintptr_t>(transfer.buffer.data());
  transfer.request.aio_nbytes = size;
  transfer.request.aio_flags = IOCB_FLAG_RESFD;
  transfer.request.aio_resfd = static_cast<std::uint32_t>(bell_.get());
  std::array<iocb*, 1> list{&transfer.request};
  transfer.input = input;
  transfer.busy = ::syscall(SYS_io_submit, context_, 1L, list.data()) == 1;
  return transfer.busy;
}

std::span<const Completed> AioQueue::completed() {
  std::array<io_event, 32> events{};
  timespec none{};
  const long count =
      ::syscall(SYS_io_getevents, context_, 0L, static_cast<long>(events.size()), events.data(), &none);
  std::size_t taken = 0;
  for (long k = 0; k < count; ++k) {
    const io_event& event = events.at(static_cast<std::size_t>(k));
    auto* const transfer = std::bit_cast<Transfer*>(static_cast<std::uintptr_t>(event.data));
    transfer->busy = false;
    completed_.at(taken++) = {transfer, event.res};
  }
  return std::span(completed_).first(taken);
}

void AioQueue::quiet() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(bell_.get(), &count, sizeof count);
}

}  // namespace symrig::board_linux
