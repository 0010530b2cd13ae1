// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/internal/dlp_link.hpp"
#include "symrig/projector/internal/driver.hpp"
#include "symrig/projector/internal/planes.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace symrig::projector::dlp {

/// The keys of `[projector]` that the drivers of DLP controllers share.
struct PlaneKeys {
  std::string controller;      ///< "/dev/hidraw0"; empty: the only one of its kind
  DrmProjectorOptions screen;  ///< the screen whose cable feeds the controller
  int latency = 1;
  PlaneOrder order;
};

/// Reads them: docs/rig-file.md. `keys` and `planes` hold the defaults. Adds errors to the table's context.
void read_plane_keys(base::TableReader& table, PlaneKeys& keys, PlaneOptions& planes);
/// A delay of a trigger output in microseconds, `least` to `most`.
void read_delay(base::TableReader& table, std::string_view key, double least, double most,
                Nanoseconds& value);
/// Adds an error if the frame trigger does not come before the trigger of plane 0.
void check_delays(base::TableReader& table, const PlaneOptions& planes);
/// A duration in whole microseconds, as the controllers take it.
void read_microseconds(base::TableReader& table, std::string_view key, std::optional<std::uint32_t>& value);

/// A screen and a DLP controller that a rig file selects.
class PlaneSource : public ProjectorSource {
 public:
  PlaneSource(const ControllerKind& kind, std::string_view driver, PlaneKeys keys)
      : kind_(kind), driver_(driver), keys_(std::move(keys)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override;
  Pacing pacing() const override { return Pacing::host; }
  bool shows_planes() const override { return true; }
  std::string identity(const Placement& placement) const override;

 private:
  virtual const PlaneOptions& planes() const = 0;
  /// As PlaneProjector::Begin.
  virtual Result<std::unique_ptr<PlaneSequence>> begin(std::unique_ptr<HidTransport> transport,
                                                       const PictureSource& source) const = 0;

  ControllerKind kind_;
  std::string_view driver_;
  PlaneKeys keys_;
};

/// A source whose controller is driven by a `Sequence`: Sequence::begin(Controller, source, options).
template <class Sequence, class Controller, class Options>
class PlaneSourceOf final : public PlaneSource {
 public:
  PlaneSourceOf(const ControllerKind& kind, std::string_view driver, PlaneKeys keys, const Options& options)
      : PlaneSource(kind, driver, std::move(keys)), options_(options) {}

 private:
  const PlaneOptions& planes() const override { return options_; }
  Result<std::unique_ptr<PlaneSequence>> begin(std::unique_ptr<HidTransport> transport,
                                               const PictureSource& source) const override {
    SYMRIG_TRY(auto begun, Sequence::begin(Controller(std::move(transport)), source, options_));
    return std::unique_ptr<PlaneSequence>(std::move(begun));
  }

  Options options_;
};

}  // namespace symrig::projector::dlp
