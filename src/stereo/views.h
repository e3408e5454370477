// SPDX-License-Identifier: BSD-3-Clause
// What image_proc makes of a camera's raw image.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "stereo/camera.h"
#include "stereo/image.h"

namespace tld_follower::stereo {

/// Grey and colour images of one camera, as they are and rectified; each is made when it is first
/// asked for. What a view returns is valid until the next Set(); it shares the raw image's pixels
/// where nothing had to be done.
class CameraViews {
 public:
  /// Takes the next raw image. Its pixels are shared, not copied: they must live as long as views
  /// of it are used.
  void Set(const cv::Mat& raw, Encoding encoding, const Calibration& calibration);

  const Texture& Grey();
  const Texture& Colour();  ///< The grey one for a camera without colour.
  /// These two throw std::invalid_argument as Rectifier does.
  const Texture& RectifiedGrey();
  const Texture& RectifiedColour();

  const Calibration& calibration() const { return calibration_; }

 private:
  cv::Mat raw_;
  Encoding encoding_ = Encoding::kMono;
  Calibration calibration_;
  std::optional<Texture> grey_, colour_, rectified_grey_, rectified_colour_;
  // Outlive a frame, so that no frame asks for new memory.
  cv::Mat eight_bit_buffer_, grey_buffer_, colour_buffer_;
  Rectifier grey_rectifier_, colour_rectifier_;
};

}  // namespace tld_follower::stereo
