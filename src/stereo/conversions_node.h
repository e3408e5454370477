// SPDX-License-Identifier: BSD-3-Clause
// Messages of ROS as the stereo core wants them, and back.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tld_follower/CloudFilterConfig.h>
#include <tld_follower/StereoConfig.h>

#include "stereo/camera.h"
#include "stereo/cloud_filter.h"
#include "stereo/image.h"
#include "stereo/matcher.h"

namespace tld_follower::stereo {

/// The message's bytes as an image of `type`, shared: nothing may write to them. Throws
/// std::invalid_argument if there are none, too few, or 16-bit numbers in foreign byte order.
cv::Mat ToMat(const sensor_msgs::Image& image, int type);

/// The calibration in pixels of the image: full-resolution camera_info, moved to the region of
/// interest and divided by the binning.
Calibration ToCalibration(const sensor_msgs::CameraInfo& info);

MatcherParameters ToParameters(const tld_follower::StereoConfig& config);
CloudFilterParameters ToParameters(const tld_follower::CloudFilterConfig& config);

/// An image message with a copy of the pixels (CV_8UC1 or CV_8UC3).
sensor_msgs::ImagePtr ToMessage(const Texture& texture, const std_msgs::Header& header);

}  // namespace tld_follower::stereo
