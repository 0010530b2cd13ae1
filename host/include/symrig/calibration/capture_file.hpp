// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/camera/pixel_format.hpp"
#include "symrig/hdr/response.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// `[raw]` of a capture file: how files without a header of their own lie on the disk, as a V4L2 driver wrote
/// them.
struct RawLayout {
  const PixelFormat* format = nullptr;
  Grid size;
  std::size_t stride = 0;  ///< bytes from one row to the next; 0: as many as a row needs
  int bits = 0;            ///< significant ones of a sample; 0: the format's
  bool high_justified = false;
};

/// `[[photograph]]` of a capture file.
struct CapturedPhotograph {
  std::string file;         ///< relative to the capture file
  int pattern = 0;          ///< index into the Gray-code sequence (GrayCode)
  Nanoseconds exposure{0};  ///< 0: not told
  int line = 0;             ///< in the capture file
};

/// `[sensor]` of a capture file: frames that tell what the camera is (docs/sensor.md).
struct SensorFiles {
  struct Level {
    std::vector<std::string> files;
  };
  struct Still {
    std::string file;
    Nanoseconds exposure{0};
  };

  int bits = 0;                   ///< of a code; 0: told by [raw]
  std::vector<std::string> dark;  ///< lens capped
  std::vector<Level> flat;        ///< `[[sensor.flat]]`: frames of one smooth light each
  std::vector<Still> bracket;     ///< `[[sensor.bracket]]`: exposures of one still scene
};

/// A capture folder as its capture.toml describes it: docs/howto-photographs.md.
struct CaptureFile {
  std::string path;  ///< for messages
  std::optional<Grid> projector;
  double pedestal = 0;  ///< value of a pixel without light, taken off before exposures are compared
  std::optional<RawLayout> raw;
  std::optional<ResponseCurve> response;  ///< of a camera that is not linear: codes become light by it
  std::optional<SensorFiles> sensor;
  std::vector<CapturedPhotograph>
      photographs;  ///< in the order they were taken; empty: all pictures of the folder
};

/// "white", "black", "columns 3", "rows 0 complement" → its index in the sequence; nullopt: none.
std::optional<int> code_pattern(const GrayCode& code, std::string_view name);

/// fails: not_found, io; bad_format: "capture.toml:12: key: what; what is legal".
Result<CaptureFile> read_capture_file(const std::filesystem::path& path);
Result<CaptureFile> parse_capture_file(std::string_view text, const std::string& name);

/// One picture of a capture folder: .raw by the layout, anything else by its content (read_image). value =
/// code / largest code, or what the capture's response makes of the code (EXR and PFM hold light already). A
/// mosaic stays one: each pixel is decoded by itself. fails: as read_image; bad_format
/// (the file's size is not what the layout says), bad_argument (no layout).
Result<Image<float>> read_captured(const std::filesystem::path& file, const CaptureFile& capture);

/// The photographs of a capture, in the order of the sequence. Photographs of one pattern with several
/// exposures become one: Σ (y − pedestal) over those that are not saturated, over Σ exposure, which is the
/// inverse-variance weight of shot noise; a pixel that all of them saturate gets 1. units: as the shortest
/// exposure saw it. fails: bad_value (a pattern without a photograph, exposures told for some only),
/// size_mismatch, as read_captured.
Result<CodePhotographs> read_capture(const std::filesystem::path& folder, const CaptureFile& capture,
                                     const ReadCodeOptions& options = {});

}  // namespace symrig
