// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/stereo_node.h"

#include <malloc.h>
#include <pcl_conversions/pcl_conversions.h>
#include <ros/master.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <boost/bind/bind.hpp>
#include <exception>
#include <map>
#include <opencv2/core/utility.hpp>
#include <sstream>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;
using XmlRpc::XmlRpcValue;
constexpr double kCheckPeriod = 5;  // [s of wall-clock time]
constexpr std::chrono::seconds kSameWarningPeriod{10};
constexpr uint32_t kNewestOnly = 1;  // A queue of more would only make pairs older under load.

// Shares the message's bytes; OpenCV has no constant views, nothing writes to this one.
cv::Mat ToMat(const Image& image, Encoding encoding) {
  const size_t row = static_cast<size_t>(image.width) * Channels(encoding);
  if (row == 0 || image.height == 0) throw std::invalid_argument("the image is empty");
  if (image.step < row || image.data.size() < static_cast<size_t>(image.step) * image.height) {
    throw std::invalid_argument("the image has fewer bytes than its size and encoding ask for");
  }
  return cv::Mat(image.height, image.width, CV_8UC(Channels(encoding)),
                 const_cast<uint8_t*>(image.data.data()), image.step);
}

// The calibration in pixels of the image: full-resolution camera_info, moved to the region of
// interest and divided by the binning.
Calibration ToCalibration(const CameraInfo& info) {
  const double bin_x = std::max(1u, info.binning_x), bin_y = std::max(1u, info.binning_y);
  const auto& roi = info.roi;
  const cv::Matx33d window(1 / bin_x, 0, -(roi.x_offset / bin_x), 0, 1 / bin_y,
                           -(roi.y_offset / bin_y), 0, 0, 1);
  Calibration calibration;
  calibration.size = cv::Size(static_cast<int>((roi.width ? roi.width : info.width) / bin_x),
                              static_cast<int>((roi.height ? roi.height : info.height) / bin_y));
  calibration.distortion_model = info.distortion_model;
  calibration.d = info.D;
  calibration.k = window * cv::Matx33d(info.K.data());
  // Drivers of rectified cameras often leave R empty.
  const bool has_r = std::any_of(info.R.begin(), info.R.end(), [](double r) { return r != 0; });
  calibration.r = has_r ? cv::Matx33d(info.R.data()) : cv::Matx33d::eye();
  calibration.p = window * cv::Matx34d(info.P.data());
  return calibration;
}

MatcherParameters ToParameters(const tld_follower::StereoConfig& config) {
  MatcherParameters parameters;
  parameters.algorithm = static_cast<Algorithm>(config.stereo_algorithm);
  parameters.prefilter_cap = config.prefilter_cap;
  parameters.correlation_window_size = config.correlation_window_size;
  parameters.min_disparity = config.min_disparity;
  parameters.disparity_range = config.disparity_range;
  parameters.uniqueness_ratio = config.uniqueness_ratio;
  parameters.texture_threshold = config.texture_threshold;
  parameters.speckle_size = config.speckle_size;
  parameters.speckle_range = config.speckle_range;
  parameters.full_dp = config.fullDP;
  parameters.p1 = config.P1;
  parameters.p2 = config.P2;
  parameters.disp12_max_diff = config.disp12MaxDiff;
  return parameters;
}

[[noreturn]] void Fail(const std::string& name, const std::string& what) {
  throw std::invalid_argument("parameter ~" + name + " must be " + what);
}

// `type` is what T is called in XML-RPC: roscpp itself takes a fraction as a whole number.
template <typename T>
T ReadParameter(const ros::NodeHandle& handle, const std::string& name, const std::string& what,
                XmlRpcValue::Type type, const T& fallback) {
  XmlRpcValue value;
  if (!handle.getParam(name, value)) return fallback;
  if (value.getType() != type) Fail(name, what);
  return static_cast<T&>(value);
}

int ReadQueueSize(const ros::NodeHandle& handle) {
  const std::string what = "a whole number, 1 or more";
  const int size = ReadParameter(handle, "queue_size", what, XmlRpcValue::TypeInt, 5);
  if (size < 1) Fail("queue_size", what);
  return size;
}

std::string ReadTransport(const ros::NodeHandle& handle,
                          const image_transport::ImageTransport& transport) {
  const std::string plugins = "image_transport/";
  std::string names;
  const auto name = ReadParameter<std::string>(
      handle, "image_transport", "the name of an image transport", XmlRpcValue::TypeString, "raw");
  for (const std::string& plugin : transport.getLoadableTransports()) {
    if (plugin == plugins + name) return name;
    names += (names.empty() ? "" : ", ") + plugin.substr(plugins.size());
  }
  Fail("image_transport",
       "one of the transports installed here (" + names + "), not '" + name + "'");
}

bool IsNumber(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeInt || value.getType() == XmlRpcValue::TypeDouble;
}

double ToNumber(XmlRpcValue value) {
  return value.getType() == XmlRpcValue::TypeInt ? static_cast<int&>(value)
                                                 : static_cast<double&>(value);
}

bool AreEqual(const XmlRpcValue& a, const XmlRpcValue& b) {
  return IsNumber(a) && IsNumber(b) ? ToNumber(a) == ToNumber(b) : a == b;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

StereoNode::StereoNode(ros::NodeHandle handle, ros::NodeHandle private_handle)
    : handle_(handle),
      transport_(handle),
      hints_(ReadTransport(private_handle, transport_), ros::TransportHints().tcpNoDelay(),
             private_handle),
      queue_size_(ReadQueueSize(private_handle)),
      approximate_sync_(ReadParameter(private_handle, "approximate_sync", "true or false",
                                      XmlRpcValue::TypeBoolean, false)) {
  MakeSynchroniser();
  images_[0].registerCallback([this](const ros::MessageEvent<const Image>& m) { OnMessage<0>(m); });
  infos_[0].registerCallback(
      [this](const ros::MessageEvent<const CameraInfo>& m) { OnMessage<1>(m); });
  images_[1].registerCallback([this](const ros::MessageEvent<const Image>& m) { OnMessage<2>(m); });
  infos_[1].registerCallback(
      [this](const ros::MessageEvent<const CameraInfo>& m) { OnMessage<3>(m); });

  StartReconfigure(private_handle);
  const auto changed = [this](const ros::SingleSubscriberPublisher&) { SubscribeWhileNeeded(); };
  disparity_publisher_ =
      handle_.advertise<stereo_msgs::DisparityImage>("disparity", kNewestOnly, changed, changed);
  cloud_publisher_ =
      handle_.advertise<sensor_msgs::PointCloud2>("points2", kNewestOnly, changed, changed);
  input_timer_ = handle_.createWallTimer(ros::WallDuration(kCheckPeriod),
                                         [this](const ros::WallTimerEvent&) { CheckInputs(); });
}

// The server silently puts what is in force in the place of values that are out of range or of a
// wrong type; whoever set them is told.
void StereoNode::StartReconfigure(const ros::NodeHandle& private_handle) {
  std::map<std::string, XmlRpcValue> asked;
  for (const auto& description : tld_follower::StereoConfig::__getParamDescriptions__()) {
    XmlRpcValue value;
    if (private_handle.getParam(description->name, value)) asked[description->name] = value;
  }
  reconfigure_server_.emplace(private_handle);
  reconfigure_server_->setCallback(
      [this](tld_follower::StereoConfig& config, uint32_t) { OnReconfigure(&config); });
  std::ostringstream changes;
  for (auto& [name, value] : asked) {
    XmlRpcValue in_force;
    private_handle.getParam(name, in_force);
    if (AreEqual(value, in_force)) continue;
    changes << (changes.tellp() > 0 ? ", " : "") << "~" << name << " " << in_force << " for "
            << value;
  }
  if (changes.tellp() > 0) {
    ROS_WARN_STREAM("parameters out of range or of a wrong type; in force are " << changes.str());
  }
}

void StereoNode::MakeSynchroniser() {
  using namespace boost::placeholders;
  if (approximate_sync_) {
    synchroniser_ = std::make_unique<Approximate>(static_cast<uint32_t>(queue_size_));
  } else {
    synchroniser_ = std::make_unique<Exact>(static_cast<uint32_t>(queue_size_));
  }
  std::visit(
      [this](auto& synchroniser) {
        synchroniser->registerCallback(boost::bind(&StereoNode::OnPair, this, _1, _2, _3, _4));
      },
      synchroniser_);
}

template <int kInput, typename Message>
void StereoNode::OnMessage(const ros::MessageEvent<const Message>& event) {
  const ros::Time stamp = event.getConstMessage()->header.stamp;
  // After a jump back in time (a bag that starts over, a reset simulation) messages that wait for
  // their partners would crowd out all new ones.
  if (stamp < newest_[kInput]) {
    MakeSynchroniser();
    newest_ = {};
  }
  newest_[kInput] = stamp;
  ++received_[kInput];
  std::visit([&event](auto& synchroniser) { synchroniser->template add<kInput>(event); },
             synchroniser_);
}

void StereoNode::SubscribeWhileNeeded() {
  const bool needed =
      disparity_publisher_.getNumSubscribers() + cloud_publisher_.getNumSubscribers() > 0;
  if (needed == subscribed_) return;
  subscribed_ = needed;
  received_ = {};
  pairs_ = 0;
  if (!needed) {
    MakeSynchroniser();  // Forgets what waits for a partner.
    for (auto& image : images_) image.unsubscribe();
    for (auto& info : infos_) info.unsubscribe();
    return;
  }
  images_[0].subscribe(transport_, "left/image_raw", kNewestOnly, hints_);
  infos_[0].subscribe(handle_, "left/camera_info", kNewestOnly, hints_.getRosHints());
  images_[1].subscribe(transport_, "right/image_raw", kNewestOnly, hints_);
  infos_[1].subscribe(handle_, "right/camera_info", kNewestOnly, hints_.getRosHints());
  input_timer_.stop();  // A whole period from now on.
  input_timer_.start();
}

void StereoNode::OnReconfigure(tld_follower::StereoConfig* config) {
  matcher_.SetParameters(ToParameters(*config));
  // The client is shown what is in force.
  config->prefilter_size |= 1;
  config->correlation_window_size = matcher_.parameters().correlation_window_size;
  config->disparity_range = matcher_.parameters().disparity_range;
}

void StereoNode::Eye::Read(const Image& image, const CameraInfo& info) try {
  calibration = ToCalibration(info);
  encoding = ParseEncoding(image.encoding);
  raw = ToMat(image, encoding);
  rectified_grey = grey_rectifier_.Rectify(ToGrey(raw, encoding, &grey_), calibration);
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(name + " camera: " + error.what());
}

Texture StereoNode::Eye::RectifiedTexture() {
  if (encoding == Encoding::kMono) return {rectified_grey};
  Texture texture = ToTexture(raw, encoding, &texture_);
  texture.pixels = texture_rectifier_.Rectify(texture.pixels, calibration);
  return texture;
}

void StereoNode::OnPair(const ImagePtr& left_image, const InfoPtr& left_info,
                        const ImagePtr& right_image, const InfoPtr& right_info) {
  ++pairs_;
  try {
    left_.Read(*left_image, *left_info);
    right_.Read(*right_image, *right_info);
    const auto geometry = StereoGeometry::From(left_.calibration, right_.calibration);
    const cv::Mat& disparity = matcher_.Match(left_.rectified_grey, right_.rectified_grey);
    if (cloud_publisher_.getNumSubscribers() > 0) {
      PublishCloud(disparity, geometry, left_image->header);
    }
    if (disparity_publisher_.getNumSubscribers() > 0) {
      PublishDisparity(disparity, geometry, left_image->header);
    }
  } catch (const std::exception& error) {
    Warn(std::string("no disparity for this pair: ") + error.what());
  }
}

void StereoNode::PublishDisparity(const cv::Mat& disparity, const StereoGeometry& geometry,
                                  const std_msgs::Header& header) {
  auto& message = disparity_message_;
  message.header = message.image.header = header;
  message.image.height = disparity.rows;
  message.image.width = disparity.cols;
  message.image.encoding = sensor_msgs::image_encodings::TYPE_32FC1;
  message.image.step = disparity.cols * sizeof(float);
  message.image.data.resize(static_cast<size_t>(message.image.step) * disparity.rows);
  cv::Mat pixels(disparity.size(), CV_32FC1, message.image.data.data(), message.image.step);
  ToPixels(disparity, geometry.offset, &pixels);

  const auto& parameters = matcher_.parameters();
  message.f = static_cast<float>(geometry.fx);
  message.T = static_cast<float>(geometry.baseline);
  message.min_disparity = static_cast<float>(parameters.min_disparity - geometry.offset);
  message.max_disparity = message.min_disparity + parameters.disparity_range - 1;
  message.delta_d = 1.0f / kSteps;
  const cv::Rect window = matcher_.ValidWindow(disparity.size());
  message.valid_window.x_offset = window.x;
  message.valid_window.y_offset = window.y;
  message.valid_window.width = window.width;
  message.valid_window.height = window.height;
  disparity_publisher_.publish(message);
}

void StereoNode::PublishCloud(const cv::Mat& disparity, const StereoGeometry& geometry,
                              const std_msgs::Header& header) {
  // The bytes move from the last message to PCL and back: no copy, no new memory.
  pcl::PCLPointCloud2 cloud;
  pcl_conversions::moveToPCL(cloud_message_, cloud);
  cloud_maker_.Make(disparity, matcher_.parameters().min_disparity, left_.RectifiedTexture(),
                    geometry, &cloud);
  pcl_conversions::moveFromPCL(cloud, cloud_message_);
  cloud_message_.header = header;  // PCL's own stamp has microseconds only.
  cloud_publisher_.publish(cloud_message_);
}

void StereoNode::CheckInputs() {
  const ros::Time now = ros::Time::now();
  const bool clock_stands = ros::Time::isSimTime() && !now.isZero() && now == last_check_;
  last_check_ = now;
  const auto received = received_;
  const int pairs = pairs_;
  received_ = {};
  pairs_ = 0;
  // A simulation at pause owes no images.
  if (!subscribed_ || pairs > 0 || clock_stands) return;

  const std::array<std::string, 4> topics{images_[0].getTopic(), infos_[0].getTopic(),
                                          images_[1].getTopic(), infos_[1].getTopic()};
  const std::array<uint32_t, 4> publishers{
      images_[0].getNumPublishers(), infos_[0].getSubscriber().getNumPublishers(),
      images_[1].getNumPublishers(), infos_[1].getSubscriber().getNumPublishers()};
  std::vector<std::string> unpublished, silent;
  for (size_t i = 0; i < topics.size(); ++i) {
    if (received[i] == 0) (publishers[i] == 0 ? unpublished : silent).push_back(topics[i]);
  }
  if (!unpublished.empty()) {
    Warn("no disparity: nobody publishes " + Joined(unpublished) +
         " (are the cameras running, and in the namespace " + handle_.getNamespace() + "?)");
  } else if (!silent.empty()) {
    Warn("no disparity: nothing arrives on " + Joined(silent) + " (check with: rostopic hz)");
  } else {
    Warn("no disparity: images and camera_info arrive, but none of them pair up; " +
         std::string(approximate_sync_
                         ? "their stamps are too far apart for queue_size"
                         : "their stamps must be identical, else set approximate_sync"));
  }
}

void StereoNode::Warn(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (text == last_warning_ && now - last_warning_time_ < kSameWarningPeriod) return;
  last_warning_ = text;
  last_warning_time_ = now;
  ROS_WARN_STREAM(text);
}

}  // namespace tld_follower::stereo

int main(int argc, char** argv) {
  ros::init(argc, argv, "stereo_image_proc");
  // Clouds come and go at frame rate: keep their pages instead of asking the kernel for new ones.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  cv::setNumThreads(1);  // The machine's other cores belong to the other nodes.
  ros::start();          // Or the end of the node's last handle would silence the message below.
  try {
    tld_follower::stereo::StereoNode node(ros::NodeHandle(), ros::NodeHandle("~"));
    ros::spin();
  } catch (const std::exception& problem) {
    ROS_FATAL("%s", problem.what());
    return 1;
  }
  return 0;
}
