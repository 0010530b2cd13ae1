// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/job/capture_job.hpp"
#include "symrig/viewer/server.hpp"

#include <memory>
#include <string>

namespace symrig {

/// The page of a capture: while it runs, and of its scene afterwards (docs/howto-view.md). It is served on a
/// thread of its own. The capture hands copies over, and waits for nobody who looks at them: a status at most
/// ten times a second, a photograph at most twice, and the tensor so far after each level.
class CapturePage {
 public:
  /// Serves from now on.
  /// fails: bad_value (neither 1 nor 3 channels), io (the port is in use).
  static Result<CapturePage> open(const OpenedRig& rig, ViewOptions options);
  CapturePage(CapturePage&&) noexcept;
  CapturePage& operator=(CapturePage&&) noexcept;
  /// Ends the serving.
  ~CapturePage();

  /// "http://127.0.0.1:PORT/SECRET/"
  std::string address() const;
  /// The same job; it also tells this page how far it is. Page and rig must outlive the job.
  CaptureJob watched(CaptureJob job, const OpenedRig& rig) const;
  /// From now on, as long as this lives, the page shows the captured scene.
  void complete(const CaptureOutcome& outcome) const;
  /// The page now says why there is no scene. line: the message of the command, in one line. If somebody
  /// watches, this waits until the page has asked, five seconds at most.
  void fail(std::string line) const;

 private:
  class ServedScene;
  explicit CapturePage(std::unique_ptr<ServedScene> served);
  std::unique_ptr<ServedScene> served_;
};

}  // namespace symrig
