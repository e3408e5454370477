// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/views.h"

namespace tld_follower::stereo {

void CameraViews::Set(const cv::Mat& raw, Encoding encoding, const Calibration& calibration) {
  raw_ = To8Bit(raw, &eight_bit_buffer_);
  encoding_ = encoding;
  calibration_ = calibration;
  for (auto* view : {&grey_, &colour_, &rectified_grey_, &rectified_colour_}) view->reset();
}

const Texture& CameraViews::Grey() {
  if (!grey_) grey_ = Texture{ToGrey(raw_, encoding_, &grey_buffer_)};
  return *grey_;
}

const Texture& CameraViews::Colour() {
  if (encoding_ == Encoding::kMono) return Grey();
  if (!colour_) colour_ = ToTexture(raw_, encoding_, &colour_buffer_);
  return *colour_;
}

const Texture& CameraViews::RectifiedGrey() {
  if (!rectified_grey_) {
    rectified_grey_ = Texture{grey_rectifier_.Rectify(Grey().pixels, calibration_)};
  }
  return *rectified_grey_;
}

const Texture& CameraViews::RectifiedColour() {
  if (encoding_ == Encoding::kMono) return RectifiedGrey();
  if (!rectified_colour_) {
    const Texture& colour = Colour();
    rectified_colour_ =
        Texture{colour_rectifier_.Rectify(colour.pixels, calibration_), colour.red_first};
  }
  return *rectified_colour_;
}

}  // namespace tld_follower::stereo
