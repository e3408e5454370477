// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/filtered_cloud_node.h"

#include <pcl_conversions/pcl_conversions.h>

#include <boost/make_shared.hpp>
#include <exception>

#include "stereo/conversions_node.h"
#include "stereo/parameters_node.h"

namespace tld_follower::stereo {

FilteredCloud::FilteredCloud(ros::NodeHandle handle, const ros::NodeHandle& filter_handle,
                             const std::function<void()>& changed) {
  reconfigure_server_ = StartReconfigure<tld_follower::CloudFilterConfig>(
      filter_handle, [this](tld_follower::CloudFilterConfig* config) {
        const std::lock_guard<std::mutex> lock(mutex_);
        parameters_ = ToParameters(*config);
      });
  const auto on_change = [changed](const ros::SingleSubscriberPublisher&) { changed(); };
  publisher_ =
      handle.advertise<sensor_msgs::PointCloud2>("points2_filtered", 1, on_change, on_change);
  worker_ = std::thread(&FilteredCloud::Work, this);
}

FilteredCloud::~FilteredCloud() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  worker_.join();
}

void FilteredCloud::Offer(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest_ = cloud;
  }
  changed_.notify_one();
}

void FilteredCloud::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || newest_; });
    if (stop_) return;
    const auto cloud = std::move(newest_);
    newest_.reset();
    const CloudFilterParameters parameters = parameters_;
    lock.unlock();
    try {
      Publish(*cloud, parameters);
    } catch (const std::exception& error) {
      warn_(std::string("no filtered cloud: ") + error.what());
    }
    lock.lock();
  }
}

void FilteredCloud::Publish(const sensor_msgs::PointCloud2& cloud,
                            const CloudFilterParameters& parameters) {
  const auto filtered =
      FilterCloud(cloud.data.data(), static_cast<size_t>(cloud.width) * cloud.height, parameters);
  auto message = boost::make_shared<sensor_msgs::PointCloud2>();
  pcl::toROSMsg(filtered, *message);
  message->header = cloud.header;  // PCL's own stamp has microseconds only.
  publisher_.publish(message);
}

}  // namespace tld_follower::stereo
