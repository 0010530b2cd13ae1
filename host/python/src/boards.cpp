// SPDX-License-Identifier: Apache-2.0
// Timed programs on trigger boards, by the C interface of the library.
#include "bindings.hpp"
#include "caller.hpp"
#include "symrig/symrig.h"

#include <atomic>
#include <memory>
#include <string>
#include <utility>

namespace symrig::python {
namespace {

void check_code(int code, const symrig_error& error) {
  if (code != 0) throw Failure{{static_cast<ErrorCode>(code), error.what, error.hint}};
}

/// A text that the library gave.
std::string taken(char* text) {
  const std::unique_ptr<char, void (*)(char*)> owned(text, symrig_free);
  return owned ? owned.get() : "";
}

struct Program {
  std::unique_ptr<symrig_program, void (*)(symrig_program*)> handle{nullptr, symrig_program_free};

  explicit Program(const std::string& path) {
    symrig_program* loaded = nullptr;
    symrig_error error{};
    check_code(symrig_program_load(path.c_str(), &loaded, &error), error);
    handle.reset(loaded);
  }
};

/// What a run calls while the board works.
struct Reporter {
  Progress progress;
};

int report_run(const symrig_progress* at, void* user) {
  const auto& reporter = *static_cast<const Reporter*>(user);
  const bool go_on = reporter.progress(
      {"program", static_cast<std::int64_t>(at->patterns), static_cast<std::int64_t>(at->patterns_asked)});
  return go_on ? 0 : 1;
}

class BoardInUse {
 public:
  BoardInUse(const std::string& uri, const Program* program) {
    symrig_board* opened = nullptr;
    symrig_error error{};
    int code = 0;
    {
      const py::gil_scoped_release unlocked;
      code = symrig_board_open(uri.c_str(), program == nullptr ? nullptr : program->handle.get(), &opened,
                               &error);
    }
    check_code(code, error);
    handle_.reset(opened);
  }

  void close() {
    const py::gil_scoped_release unlocked;
    handle_.reset();
  }

  std::string info() const {
    char* json = nullptr;
    symrig_error error{};
    check_code(symrig_board_info(open(), &json, &error), error);
    return taken(json);
  }

  std::string lint(const Program& program) const {
    char* json = nullptr;
    symrig_error error{};
    check_code(symrig_program_lint(program.handle.get(), open(), &json, &error), error);
    return taken(json);
  }

  void abort() const {
    symrig_error error{};
    check_code(symrig_board_abort(open(), &error), error);
  }

  void clear_fault() const {
    symrig_error error{};
    check_code(symrig_board_clear_fault(open(), &error), error);
  }

  /// (receipt as JSON or "", code, what, hint); code 0: the program has run to its end. If the callback
  /// raises, or Ctrl-C comes, the receipt is in last_receipt().
  py::tuple run(const Program& program, py::object progress) {
    symrig_board* const board = open();
    if (busy_.exchange(true))
      throw Failure{{ErrorCode::bad_argument, "another thread runs a program on the board",
                     "wait until it is done, or abort it"}};
    const std::shared_ptr<void> free(nullptr, [this](void*) { busy_ = false; });
    Caller caller(std::move(progress));
    Reporter reporter{caller.progress()};
    char* receipt = nullptr;
    symrig_error error{};
    const std::shared_ptr<void> keep(nullptr, [&](void*) { last_receipt_ = taken(receipt); });
    const int code = caller.run([&]() -> Result<int> {
      return symrig_board_run(board, program.handle.get(), report_run, &reporter, &receipt, &error);
    });
    return py::make_tuple(taken(std::exchange(receipt, nullptr)), code, std::string(error.what),
                          std::string(error.hint));
  }

  const std::string& last_receipt() const { return last_receipt_; }

 private:
  symrig_board* open() const {
    if (handle_) return handle_.get();
    throw Failure{{ErrorCode::bad_argument, "the board is closed", "open it again"}};
  }

  std::unique_ptr<symrig_board, void (*)(symrig_board*)> handle_{nullptr, symrig_board_close};
  std::atomic<bool> busy_ = false;
  std::string last_receipt_;
};

}  // namespace

void bind_boards(py::module_& module) {
  py::class_<Program>(module, "Program").def(py::init<const std::string&>());
  py::class_<BoardInUse>(module, "Board")
      .def(py::init<const std::string&, const Program*>())
      .def("info", &BoardInUse::info)
      .def("lint", &BoardInUse::lint)
      .def("run", &BoardInUse::run)
      .def("last_receipt", &BoardInUse::last_receipt)
      .def("abort", &BoardInUse::abort)
      .def("clear_fault", &BoardInUse::clear_fault)
      .def("close", &BoardInUse::close);
  module.def("error_name", [](int code) { return std::string(symrig_error_name(code)); });
}

}  // namespace symrig::python
