"""/NODE: one box for every left image, found by Tracking-Learning-Detection."""

import os
import threading

import cv2
import rospy
from sensor_msgs.msg import Image, PointCloud2, RegionOfInterest
from std_srvs.srv import SetBool, SetBoolResponse

from tld_follower.box import Box
from tld_follower.msg import BoundingBox
from tld_follower.nodes.by_stamp import ByStamp
from tld_follower.nodes.conversions import box_message, cloud_points, grey_image, image_array
from tld_follower.nodes.memory import keep_memory
from tld_follower.nodes.newest import Newest
from tld_follower.nodes.requests import Requests
from tld_follower.nodes.settings import checked, fatal_if_wrong
from tld_follower.srv import ModelFile, ModelFileResponse
from tld_follower.tld import storage
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.stereo_view import StereoTracker, View
from tld_follower.tld.tracker import Tracker, warm_up

GREEN, WHITE = (0, 220, 0), (255, 255, 255)
# How long an image waits for its cloud or its twin, and these for an image still queued [s of ROS time].
PAIR_WAIT, PAIR_AGE = 0.1, 0.5


def parse_box(text):
    """Read `x,y,width,height` in pixels; an empty text is no box."""
    if not str(text).strip():
        return None
    try:
        x, y, width, height = map(float, str(text).strip("[]() ").split(","))
    except ValueError as error:
        raise ValueError(f"init_box must be x,y,width,height in pixels, not {text!r}") from error
    return Box(x, y, width, height)


def model_path(text):
    """Return the path of a model file; ValueError unless it is absolute."""
    if not os.path.isabs(text):
        raise ValueError(f"the path of a model must be absolute, not {text!r}")
    return text


def depth_map(cloud):
    """Return the depth [m] of each pixel, from a sensor_msgs/PointCloud2."""
    return cloud_points(cloud)[:, :, 2]


class TrackerNode:
    """Feeds images to a `Tracker` in one worker thread and publishes what it finds.

    A new target is learnt from the newest image at once; /NODE/target (latched) says that it was.
    """

    def __init__(self):
        settings = dict(rospy.get_param("~", {}))
        seed = checked(settings.pop("seed", 0), "seed", int, lambda value: value >= 0)
        every_frame = checked(settings.pop("every_frame", False), "every_frame", bool)
        use_depth = checked(settings.pop("use_depth", False), "use_depth", bool)
        use_right = checked(settings.pop("use_right_camera", False), "use_right_camera", bool)
        self._request = parse_box(settings.pop("init_box", ""))
        model = checked(settings.pop("model", ""), "model", str)
        if model and self._request:
            raise ValueError("parameters model and init_box both give a target")
        self._parameters = Parameters.from_dict(settings)
        self._tracker = Tracker(self._parameters, seed=seed)
        self._stereo = StereoTracker(self._tracker)
        self._work = Newest(every=every_frame)
        self._requests = Requests(self._work.wake)
        self._every_frame = every_frame
        self._request_lock = threading.Lock()
        self._clouds = ByStamp(PAIR_AGE) if use_depth else None
        self._rights = ByStamp(PAIR_AGE) if use_right else None
        self._image = None
        self._depth = None
        self._right = None
        self._targets = 0
        self._stamp = rospy.Time()
        if model:
            self._restore(self._read_model(model))
        warm_up()

        self._boxes = rospy.Publisher("/pointA", BoundingBox, queue_size=10, tcp_nodelay=True)
        self._view = rospy.Publisher("~view", Image, queue_size=1)
        self._target = rospy.Publisher("~target", RegionOfInterest, queue_size=1, latch=True)
        rospy.Subscriber("~init", RegionOfInterest, self._init, queue_size=1)
        if use_depth:
            rospy.Subscriber("/stereo/points2", PointCloud2, self._clouds.put, queue_size=1, tcp_nodelay=True)
        if use_right:
            rospy.Subscriber(
                "/stereo/right/image_raw", Image, self._rights.put, queue_size=1, tcp_nodelay=True
            )
        rospy.Subscriber(
            "/stereo/left/image_raw",
            Image,
            self._work.put,
            queue_size=None if every_frame else 1,
            tcp_nodelay=True,
        )
        rospy.Service("~learning", SetBool, self._switch_learning)
        rospy.Service("~save_model", ModelFile, self._save_model)
        rospy.Service("~load_model", ModelFile, self._load_model)

    def _switch_learning(self, request):
        def switch():
            self._tracker.learning = request.data

        self._requests.ask(switch)
        message = f"learning is {'on' if request.data else 'off'}"
        rospy.loginfo(message)
        return SetBoolResponse(success=True, message=message)

    def _save_model(self, request):
        """Write the model as it is between two frames; no frame waits for the disk."""
        try:
            path = model_path(request.path)
            storage.save(path, self._requests.ask(self._tracker.model), self._parameters)
        except (ValueError, RuntimeError, OSError) as error:
            rospy.logerr(f"model not saved: {error}")
            return ModelFileResponse(success=False, message=str(error))
        return ModelFileResponse(success=True, message=f"saved to {path}")

    def _load_model(self, request):
        try:
            model = self._read_model(request.path)
            self._requests.ask(lambda: self._restore(model))
        except (ValueError, OSError) as error:
            rospy.logerr(f"model not loaded: {error}")
            return ModelFileResponse(success=False, message=str(error))
        return ModelFileResponse(success=True, message=f"loaded {request.path}")

    def _read_model(self, path):
        try:
            return storage.load(model_path(path), self._parameters)
        except OSError as error:
            raise ValueError(f"the model cannot be read: {error}") from error

    def _restore(self, model):
        """Search for the target of a model; the one before is kept where images are of another size."""
        if self._image is not None and self._image.shape != model.image[::-1]:
            (width, height), (rows, columns) = model.image, self._image.shape
            raise ValueError(
                f"the model was learnt in images of {width}x{height}, the camera gives {columns}x{rows}"
            )
        self._tracker.restore(model)
        self._stereo.forget()
        self._targets += 1
        rospy.loginfo("target %d: from a model of %d templates", self._targets, self._tracker.templates)

    def _init(self, region):
        with self._request_lock:
            self._request = Box(region.x_offset, region.y_offset, region.width, region.height)
        self._work.wake()  # learn from the newest image without waiting for the next

    def run(self):
        """Process images until ROS shuts down."""
        while not rospy.is_shutdown():
            message = self._work.take(timeout=0.5)
            self._requests.serve()
            if message is not None:
                self._process(message)
            elif self._image is not None:
                self._learn_requested()

    def _process(self, message):
        stamp = message.header.stamp
        if stamp and stamp < self._stamp:
            back = (self._stamp - stamp).to_sec()
            rospy.logwarn_throttle(5.0, f"time jumped back by {back:.3f} s; going on")
        self._stamp = stamp
        box, confidence = None, 0.0
        try:
            grey = grey_image(message)
            self._image = grey
            self._right = self._paired(self._rights, stamp, grey_image, "right image")
            self._depth = self._paired(self._clouds, stamp, depth_map, "point cloud")
            shown = self._learn_requested()
            if shown is not None:
                box, confidence = shown, 1.0
            elif self._tracker.initialised:
                result = self._stereo.update(grey, self._depth, self._right)
                box, confidence = result.box, result.confidence
        except ValueError as error:
            rospy.logerr_throttle_identical(5.0, f"image skipped: {error}")
            self._boxes.publish(box_message(None, 0.0, stamp, self._targets))
            return
        self._boxes.publish(box_message(box, confidence, stamp, self._targets))
        if self._view.get_num_connections():
            self._publish_view(message, box, confidence)

    def _paired(self, source, stamp, read, name):
        """Return what else came of the image of a stamp, as `read` gives it; None without it."""
        if source is None:
            return None
        message = source.wait(stamp, PAIR_WAIT, lambda: self._work.waiting and not self._every_frame)
        if message is None:
            rospy.logwarn_throttle_identical(5.0, f"no {name} for an image: going on without")
            return None
        try:
            pixels = read(message)
            if pixels.shape != self._image.shape:
                (height, width), (rows, columns) = self._image.shape, pixels.shape
                raise ValueError(f"{columns}x{rows} pixels for an image of {width}x{height}")
        except ValueError as error:
            rospy.logerr_throttle_identical(5.0, f"{name} ignored: {error}")
            return None
        return pixels

    def _learn_requested(self):
        """Learn the requested target from the newest image; return its box, or None without a request."""
        with self._request_lock:
            box, self._request = self._request, None
        if box is None:
            return None
        try:
            self._stereo.init(self._image, box, self._depth, self._right)
        except ValueError as error:
            rospy.logerr(f"target refused: {error}")
            return None
        box = box.clip(self._image.shape[1], self._image.shape[0])
        self._targets += 1
        rospy.loginfo(
            "target %d: x %g, y %g, %g x %g pixels", self._targets, box.x, box.y, box.width, box.height
        )
        self._target.publish(
            RegionOfInterest(
                x_offset=round(box.x), y_offset=round(box.y), width=round(box.width), height=round(box.height)
            )
        )
        return box

    def _publish_view(self, message, box, confidence):
        """Publish the image with the box drawn in, in colour."""
        if message.encoding in ("rgb8", "bgr8"):
            pixels, encoding = image_array(message).copy(), message.encoding
        else:
            pixels, encoding = cv2.cvtColor(self._image, cv2.COLOR_GRAY2BGR), "bgr8"
        if box is None:
            text = "lost" if self._targets else "waiting for a target"
        else:
            text = f"{confidence:.2f}{' right camera' if self._stereo.view is View.RIGHT else ''}"
            corner = (round(box.x), round(box.y))
            cv2.rectangle(pixels, corner, (round(box.x + box.width), round(box.y + box.height)), GREEN, 2)
        cv2.putText(
            pixels, text, (8, pixels.shape[0] - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.6, WHITE, 1, cv2.LINE_AA
        )
        view = Image(header=message.header, encoding=encoding, data=pixels.tobytes())
        view.height, view.width, view.step = pixels.shape[0], pixels.shape[1], pixels.shape[1] * 3
        self._view.publish(view)


def main():
    """Run the node until ROS shuts down."""
    cv2.setNumThreads(1)  # the other cores belong to the other nodes
    keep_memory()
    rospy.init_node("NODE")
    with fatal_if_wrong():
        node = TrackerNode()
    node.run()
