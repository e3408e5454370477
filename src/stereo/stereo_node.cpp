// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/stereo_node.h"

#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/image_encodings.h>

#include <exception>
#include <stdexcept>

#include "stereo/conversions_node.h"
#include "stereo/parameters_node.h"

namespace tld_follower::stereo {
namespace {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;
constexpr uint32_t kNewestOnly = 1;

}  // namespace

StereoNode::StereoNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle)
    : handle_(handle),
      transport_(handle),
      input_(handle, private_handle,
             [this](const Image::ConstPtr& left_image, const CameraInfo::ConstPtr& left_info,
                    const Image::ConstPtr& right_image, const CameraInfo::ConstPtr& right_info) {
               OnPair(left_image, left_info, right_image, right_info);
             }) {
  reconfigure_server_ = StartReconfigure<tld_follower::StereoConfig>(
      private_handle, [this](tld_follower::StereoConfig* config) { OnReconfigure(config); });

  const std::lock_guard<std::mutex> lock(advertising_);
  const auto changed = [this] { SubscribeWhileNeeded(); };
  const auto on_change = [changed](const ros::SingleSubscriberPublisher&) { changed(); };
  for (Camera* camera : {&left_, &right_}) {
    camera->topics.emplace(&transport_, camera->name, changed);
  }
  disparity_publisher_ = handle_.advertise<stereo_msgs::DisparityImage>("disparity", kNewestOnly,
                                                                        on_change, on_change);
  filtered_cloud_.emplace(handle_, ros::NodeHandle(private_handle, "filter"), changed);
  cloud_publisher_ =
      handle_.advertise<sensor_msgs::PointCloud2>("points2", kNewestOnly, on_change, on_change);
}

bool StereoNode::CloudIsNeeded() const {
  return cloud_publisher_.getNumSubscribers() > 0 || filtered_cloud_->IsNeeded();
}

bool StereoNode::DisparityIsNeeded() const {
  return disparity_publisher_.getNumSubscribers() > 0 || CloudIsNeeded();
}

void StereoNode::SubscribeWhileNeeded() {
  const std::lock_guard<std::mutex> lock(advertising_);
  input_.Subscribe(DisparityIsNeeded() || left_.topics->AreNeeded() || right_.topics->AreNeeded());
}

void StereoNode::OnReconfigure(tld_follower::StereoConfig* config) {
  matcher_.SetParameters(ToParameters(*config));
  // The client is shown what is in force.
  config->prefilter_size |= 1;
  config->correlation_window_size = matcher_.parameters().correlation_window_size;
  config->disparity_range = matcher_.parameters().disparity_range;
}

void StereoNode::Camera::Read(const Image::ConstPtr& image, const CameraInfo& info) try {
  const PixelFormat format = ParseEncoding(image->encoding);
  views.Set(ToMat(*image, format.type), format.encoding, ToCalibration(info));
  topics->Publish(image, &views);
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(name + " camera: " + error.what());
}

const cv::Mat& StereoNode::Camera::RectifiedGrey() try {
  return views.RectifiedGrey().pixels;
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(name + " camera: " + error.what());
}

void StereoNode::OnPair(const Image::ConstPtr& left_image, const CameraInfo::ConstPtr& left_info,
                        const Image::ConstPtr& right_image,
                        const CameraInfo::ConstPtr& right_info) try {
  left_.Read(left_image, *left_info);
  right_.Read(right_image, *right_info);
  if (!DisparityIsNeeded()) return;
  const cv::Mat& left = left_.RectifiedGrey();
  const cv::Mat& right = right_.RectifiedGrey();
  const auto geometry = StereoGeometry::From(left_.views.calibration(), right_.views.calibration());
  const cv::Mat& disparity = matcher_.Match(left, right);
  if (CloudIsNeeded()) PublishCloud(disparity, geometry, left_image->header);
  if (disparity_publisher_.getNumSubscribers() > 0) {
    PublishDisparity(disparity, geometry, left_image->header);
  }
} catch (const std::exception& error) {
  warn_(std::string("no disparity for this pair: ") + error.what());
}

void StereoNode::PublishDisparity(const cv::Mat& disparity, const StereoGeometry& geometry,
                                  const std_msgs::Header& header) {
  const auto message = disparities_.Take();
  message->header = message->image.header = header;
  message->image.height = disparity.rows;
  message->image.width = disparity.cols;
  message->image.encoding = sensor_msgs::image_encodings::TYPE_32FC1;
  message->image.step = disparity.cols * sizeof(float);
  message->image.data.resize(static_cast<size_t>(message->image.step) * disparity.rows);
  cv::Mat pixels(disparity.size(), CV_32FC1, message->image.data.data(), message->image.step);
  ToPixels(disparity, geometry.offset, &pixels);

  const auto& parameters = matcher_.parameters();
  message->f = static_cast<float>(geometry.fx);
  message->T = static_cast<float>(geometry.baseline);
  message->min_disparity = static_cast<float>(parameters.min_disparity - geometry.offset);
  message->max_disparity = message->min_disparity + parameters.disparity_range - 1;
  message->delta_d = 1.0f / kSteps;
  const cv::Rect window = matcher_.ValidWindow(disparity.size());
  message->valid_window.x_offset = window.x;
  message->valid_window.y_offset = window.y;
  message->valid_window.width = window.width;
  message->valid_window.height = window.height;
  disparity_publisher_.publish(message);
}

void StereoNode::PublishCloud(const cv::Mat& disparity, const StereoGeometry& geometry,
                              const std_msgs::Header& header) {
  const auto message = clouds_.Take();
  // The bytes move from the old message to PCL and back: no copy, no new memory.
  pcl::PCLPointCloud2 cloud;
  pcl_conversions::moveToPCL(*message, cloud);
  cloud_maker_.Make(disparity, matcher_.parameters().min_disparity, left_.views.RectifiedColour(),
                    geometry, &cloud);
  pcl_conversions::moveFromPCL(cloud, *message);
  message->header = header;  // PCL's own stamp has microseconds only.
  if (cloud_publisher_.getNumSubscribers() > 0) cloud_publisher_.publish(message);
  if (filtered_cloud_->IsNeeded()) filtered_cloud_->Offer(message);
}

}  // namespace tld_follower::stereo
