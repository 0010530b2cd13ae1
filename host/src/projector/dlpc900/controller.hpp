// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/controller.hpp"
#include "projector/dlp/signal.hpp"
#include "projector/dlpc900/table.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace symrig::projector::dlpc900 {

/// What the controller shows (DLPU018J, "Display Mode Selection").
enum class DisplayMode : std::uint8_t {
  video = 0,
  stored_patterns = 1,
  video_patterns = 2,
  loaded_patterns = 3
};
std::string_view name_of(DisplayMode mode);

/// The table that is used: its entries, and how many patterns are shown.
struct Counts {
  int entries = 0;
  std::uint32_t shown = 0;  ///< 0: the sequence repeats
  bool operator==(const Counts&) const = default;
};

/// A DLPC900, command by command. Each call fails as dlp::Dialogue does.
class Controller : public dlp::Controller {
 public:
  explicit Controller(std::unique_ptr<dlp::HidTransport> transport,
                      Nanoseconds patience = Nanoseconds{1'000'000'000})
      : dlp::Controller(std::move(transport), 6, patience) {}

  /// The number of its kind of mirrors: mirrors_of().
  Result<std::uint8_t> mirrors();
  /// The rate comes from the pixel clock and the totals of lines and pixels.
  Result<dlp::Signal> signal();
  Result<DisplayMode> display_mode();
  Result<void> set_display_mode(DisplayMode mode);
  Result<std::uint8_t> receiver();
  Result<void> set_receiver(std::uint8_t receiver);
  Result<Counts> counts();
  Result<void> set_counts(const Counts& counts);
  /// The entries become effective with set_counts().
  Result<void> set_table(const std::vector<TableEntry>& entries);
  /// number: 1 or 2.
  Result<TriggerOut> trigger_out(int number);
  Result<void> set_trigger_out(int number, const TriggerOut& out);
};

/// The controller has locked to the signal at its input (main status, bit 3).
constexpr bool is_locked(const dlp::Status& status) {
  return (status.main & 0x08U) != 0;
}

}  // namespace symrig::projector::dlpc900
