// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/hdr/response.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// `[raw]` of a capture file: the layout of files without a header, as a V4L2 driver wrote them.
struct RawLayout {
  const PixelFormat* format = nullptr;
  Grid size;
  std::size_t stride = 0;  ///< bytes from one row to the next; 0: no padding
  int bits = 0;            ///< significant bits of a sample; 0: those of the format
  bool high_justified = false;
};

/// `[[photograph]]` of a capture file.
struct CapturedPhotograph {
  std::string file;         ///< relative to the capture file
  int pattern = 0;          ///< index into the Gray-code sequence (GrayCode)
  Nanoseconds exposure{0};  ///< 0: not given
  int line = 0;             ///< in the capture file
};

/// `[sensor]` of a capture file: frames that measure the sensor (docs/sensor.md).
struct SensorFiles {
  struct Level {
    std::vector<std::string> files;
    Nanoseconds exposure{0};  ///< with a scene only
  };
  struct Still {
    std::string file;
    Nanoseconds exposure{0};
  };

  int bits = 0;                    ///< bits of a code in a picture; 0: those of [raw], or of the picture
  bool scene = false;              ///< light = "scene": SceneTransfer measures; else measure_sensor()
  std::vector<std::string> dark;   ///< lens capped; without a scene
  std::vector<Level> dark_levels;  ///< `[[sensor.dark]]`, with a scene: pairs of frames
  std::vector<Level> flat;         ///< `[[sensor.flat]]`: each the frames of one light; with a scene, pairs
  std::vector<Still> bracket;      ///< `[[sensor.bracket]]`: exposures of one still scene
};

/// A capture folder as its capture.toml describes it: docs/howto-photographs.md.
struct CaptureFile {
  std::string path;  ///< for messages
  std::optional<Grid> projector;
  double pedestal = 0;  ///< value of a pixel without light, subtracted before exposures are compared
  std::optional<RawLayout> raw;
  std::optional<ResponseCurve> response;  ///< converts codes to light, for a camera that is not linear
  std::optional<SensorFiles> sensor;
  std::vector<CapturedPhotograph>
      photographs;  ///< in the order of the exposures; empty: all pictures of the folder
};

/// The index of a pattern in the sequence by its name: "white", "black", "columns 3", "rows 0 complement".
/// nullopt: no such pattern.
std::optional<int> code_pattern(const GrayCode& code, std::string_view name);

/// fails: not_found, io; bad_format ("capture.toml:12: key: what; what is legal").
Result<CaptureFile> read_capture_file(const std::filesystem::path& path);
Result<CaptureFile> parse_capture_file(std::string_view text, const std::string& name);

/// Reads one picture of a capture folder: .raw by the layout, any other file by its content (read_image).
/// value = code / largest code, or the light that the capture's response gives for the code (EXR and PFM
/// already contain light). A mosaic stays a mosaic: each pixel is decoded alone.
/// fails: as read_image; bad_format (the file's size differs from the layout), bad_argument (no layout),
/// bad_value (a picture has codes beyond the bits of [sensor]).
Result<Image<float>> read_captured(const std::filesystem::path& file, const CaptureFile& capture);

/// The photographs of a capture, in the order of the sequence. Several exposures of one pattern become one
/// photograph: Σ (y − pedestal) over the unsaturated ones, divided by Σ exposure. This is the
/// inverse-variance weight of shot noise. A pixel that is saturated in all of them keeps the value of the
/// shortest one. Saturated: at the largest code, or at the value where white's longer exposures stay although
/// the shorter ones expect more.
/// units: those of the shortest exposure. If the file names no complement, the complements are derived; if it
/// names no pattern of one axis, the sequence is that of the other axis alone.
/// fails: bad_value (a pattern without a photograph, exposures given for some only), size_mismatch, as
/// read_captured.
Result<CodePhotographs> read_capture(const std::filesystem::path& folder, const CaptureFile& capture,
                                     const ReadCodeOptions& options = {});

}  // namespace symrig
