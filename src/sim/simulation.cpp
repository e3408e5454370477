// SPDX-License-Identifier: BSD-3-Clause
#include "sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sim/distance.h"

namespace tld_follower::sim {
namespace {

constexpr int64_t kStepsPerSecond = 500;
constexpr int64_t kNanosecondsPerStep = 1000000000 / kStepsPerSecond;
constexpr int64_t kStepsPerTick = 5;
static_assert(Physics::kStep * kStepsPerSecond == 1.0);

// Two touches of the same object within this time belong to one episode.
constexpr int64_t kEpisodeGap = kStepsPerSecond / 5;

// The target's owner number in the list of contacts; other objects follow in their order.
constexpr size_t kTarget = 0;

// Frames that move, as the renderer counts them: the drone, the target's chassis and its wheels,
// and the models with a script.
enum Frame { kDroneFrame = 0, kChassisFrame = 1, kFirstWheelFrame = 2 };

}  // namespace

// Everything that a reset makes anew.
struct Simulation::State {
  State(const Simulation& simulation, const btTransform& spiri_pose, const btTransform& husky_pose)
      : physics(simulation.world_),
        spiri(simulation.config_.spiri, simulation.spiri_robot_, spiri_pose, &physics),
        husky(simulation.config_.husky, simulation.husky_robot_, husky_pose, &physics),
        sensors(simulation.config_.sensors, simulation.config_.seed, spiri.body(),
                simulation.world_.gravity),
        last_touch(size_t(physics.objects().size()) + 1, std::numeric_limits<int64_t>::min() / 2) {
    target.push_back(husky.chassis().rigid);
    for (const Husky::Wheel& wheel : husky.wheels()) target.push_back(wheel.body.rigid);
  }

  bool IsTarget(const btCollisionObject* object) const {
    return std::find(target.begin(), target.end(), object) != target.end();
  }

  Physics physics;
  Spiri spiri;
  Husky husky;
  Sensors sensors;
  std::vector<const btCollisionObject*> target;
  std::vector<int64_t> last_touch;  // Step of the last contact with each owner.
  uint32_t collisions = 0;
};

Simulation::Simulation(const SimulationConfig& config, const WarningSink& warn)
    : config_(config),
      resources_(Resources::ForWorld(config.world_file)),
      world_(LoadWorld(config.world_file, resources_, warn)),
      spiri_robot_(LoadRobot(world_.Robot("spiri").file)),
      husky_robot_(LoadRobot(world_.Robot("husky").file)),
      image_noise_(config.image_noise, config.seed) {
  config_.camera.Check();
  if (!(config_.frame_rate >= 1 && config_.frame_rate <= 250)) {
    throw std::invalid_argument("the frame rate must be 1 to 250 Hz");
  }
  Reset();
  renderer_ = std::make_unique<Renderer>(config_.camera, world_, MakeScene(), resources_, warn);
}

Simulation::~Simulation() = default;

void Simulation::Reset() {
  state_ = std::make_unique<State>(*this, RobotPose("spiri", config_.spiri_place),
                                   RobotPose("husky", config_.husky_place));
  step_ = 0;
  frame_ = 0;
}

btTransform Simulation::RobotPose(const std::string& name,
                                  const std::optional<Placement>& place) const {
  const btTransform& pose = world_.Robot(name).pose;
  if (!place) return pose;
  return btTransform(btQuaternion(btVector3(0, 0, 1), btScalar(place->yaw)),
                     btVector3(btScalar(place->x), btScalar(place->y), pose.getOrigin().z()));
}

Scene Simulation::MakeScene() const {
  Scene scene;
  int moving_frame = kFirstWheelFrame + int(state_->husky.wheels().size());
  for (const Model& model : world_.models) {
    const int frame = model.script.empty() ? -1 : moving_frame++;
    for (const Visual& visual : model.visuals) scene.visuals.push_back({visual, frame, false});
    for (const Collision& shape : model.collisions) scene.shadows.push_back({shape, frame});
  }
  const auto add = [&scene](const RobotLink& link, const RobotLink& carrier, int frame,
                            bool target) {
    const btTransform to_carrier = carrier.pose.inverse();
    for (Visual visual : link.visuals) {
      visual.pose = to_carrier * visual.pose;
      scene.visuals.push_back({std::move(visual), frame, target});
    }
    for (Collision shape : link.collisions) {
      shape.pose = to_carrier * shape.pose;
      scene.shadows.push_back({std::move(shape), frame});
    }
  };
  for (const RobotLink& link : spiri_robot_.links) {
    add(link, spiri_robot_.links.front(), kDroneFrame, false);
  }
  for (const RobotLink& link : husky_robot_.links) {
    if (!link.moving) add(link, husky_robot_.links.front(), kChassisFrame, true);
  }
  int frame = kFirstWheelFrame;
  for (const Husky::Wheel& wheel : state_->husky.wheels()) {
    const RobotLink& link = husky_robot_.MovedBy(wheel.joint);
    add(link, link, frame++, true);
  }
  return scene;
}

int64_t Simulation::FrameStep(uint64_t frame) const {
  return std::llround(double(frame) / config_.frame_rate * kStepsPerSecond);
}

Moment Simulation::Advance() {
  Moment moment;
  while (!moment.tick && !moment.frame) {
    state_->spiri.Actuate(time());
    state_->husky.Actuate(time());
    ++step_;
    state_->physics.Step(time());
    state_->husky.Measure();
    CountContacts();
    moment.tick = step_ % kStepsPerTick == 0;
    moment.slow_tick = step_ % (2 * kStepsPerTick) == 0;
    moment.frame = step_ == FrameStep(frame_ + 1);
    if (moment.tick) state_->sensors.Sample(double(kStepsPerTick) / kStepsPerSecond);
    if (moment.frame) ++frame_;
  }
  return moment;
}

int64_t Simulation::time_ns() const { return step_ * kNanosecondsPerStep; }

void Simulation::CountContacts() {
  const btCollisionObject* drone = state_->spiri.body().rigid;
  state_->physics.ForEachContact(drone, [this](const btCollisionObject* other) {
    const size_t owner =
        state_->IsTarget(other) ? kTarget : size_t(other->getWorldArrayIndex()) + 1;
    const bool is_new = step_ - state_->last_touch[owner] > kEpisodeGap;
    state_->last_touch[owner] = step_;
    if (is_new && state_->spiri.flying()) ++state_->collisions;
  });
}

void Simulation::Render(StereoImages* images, TargetMask* mask) {
  const btTransform drone = state_->spiri.body().Pose();
  std::vector<btTransform> frames{drone, state_->husky.chassis().Pose()};
  for (const Husky::Wheel& wheel : state_->husky.wheels()) frames.push_back(wheel.body.Pose());
  for (const Model& model : world_.models) {
    if (!model.script.empty()) frames.push_back(model.PoseAt(time()));
  }
  renderer_->Render(drone * config_.camera.Mount(), frames, images, mask);
  image_noise_.Add(frame_, Eye::kLeft, &images->left);
  image_noise_.Add(frame_, Eye::kRight, &images->right);
}

Truth Simulation::Measure() const {
  Truth truth;
  truth.collisions = state_->collisions;
  truth.distance = truth.clearance = std::numeric_limits<double>::infinity();
  const btRigidBody* drone = state_->spiri.body().rigid;
  const btVector3 eye =
      (state_->spiri.body().Pose() * config_.camera.Mount() * config_.camera.Optical(Eye::kLeft))
          .getOrigin();
  for (const btCollisionObject* part : state_->target) {
    truth.distance = std::min(truth.distance, Distance(eye, *part));
  }
  const btCollisionObjectArray& objects = state_->physics.objects();
  for (int i = 0; i < objects.size(); ++i) {
    if (objects[i] == drone) continue;
    truth.clearance =
        std::min(truth.clearance,
                 Distance(*drone->getCollisionShape(), drone->getWorldTransform(),
                          *objects[i]->getCollisionShape(), objects[i]->getWorldTransform()));
  }
  return truth;
}

Spiri& Simulation::spiri() { return state_->spiri; }
Husky& Simulation::husky() { return state_->husky; }
const Spiri& Simulation::spiri() const { return state_->spiri; }
const Husky& Simulation::husky() const { return state_->husky; }
const Sensors& Simulation::sensors() const { return state_->sensors; }
double Simulation::ReadRange() { return state_->sensors.ReadRange(state_->physics); }

}  // namespace tld_follower::sim
