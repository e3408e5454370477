// SPDX-License-Identifier: BSD-3-Clause
#include "sim/robot.h"

#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

btTransform ToBullet(const urdf::Pose& pose) {
  const auto& q = pose.rotation;
  const auto& p = pose.position;
  return btTransform(btQuaternion(btScalar(q.x), btScalar(q.y), btScalar(q.z), btScalar(q.w)),
                     btVector3(btScalar(p.x), btScalar(p.y), btScalar(p.z)));
}

Geometry ReadGeometry(const urdf::Geometry* geometry, const std::string& link) {
  if (geometry == nullptr) throw std::runtime_error("link '" + link + "' has an empty geometry");
  Geometry result;
  switch (geometry->type) {
    case urdf::Geometry::BOX: {
      const auto& dim = static_cast<const urdf::Box*>(geometry)->dim;
      result.type = Geometry::Type::kBox;
      result.size = {btScalar(dim.x), btScalar(dim.y), btScalar(dim.z)};
      break;
    }
    case urdf::Geometry::CYLINDER: {
      const auto* cylinder = static_cast<const urdf::Cylinder*>(geometry);
      result.type = Geometry::Type::kCylinder;
      result.size = {btScalar(cylinder->radius), btScalar(cylinder->radius),
                     btScalar(cylinder->length)};
      break;
    }
    case urdf::Geometry::SPHERE: {
      const btScalar radius = btScalar(static_cast<const urdf::Sphere*>(geometry)->radius);
      result.type = Geometry::Type::kSphere;
      result.size = {radius, radius, radius};
      break;
    }
    case urdf::Geometry::MESH: {
      const auto* mesh = static_cast<const urdf::Mesh*>(geometry);
      result.type = Geometry::Type::kMesh;
      result.mesh = mesh->filename;
      result.size = {btScalar(mesh->scale.x), btScalar(mesh->scale.y), btScalar(mesh->scale.z)};
      break;
    }
  }
  return result;
}

void ReadInertial(const urdf::Link& link, RobotLink* result) {
  if (!link.inertial) return;
  const urdf::Inertial& inertial = *link.inertial;
  if (inertial.ixy != 0 || inertial.ixz != 0 || inertial.iyz != 0) {
    throw std::runtime_error("link '" + link.name +
                             "' has products of inertia; turn its inertial frame instead");
  }
  result->mass = inertial.mass;
  result->inertia = {btScalar(inertial.ixx), btScalar(inertial.iyy), btScalar(inertial.izz)};
  result->centre_of_mass = result->pose * ToBullet(inertial.origin);
}

RobotLink ReadLink(const urdf::Link& link, const btTransform& parent_pose) {
  RobotLink result;
  result.name = link.name;
  result.pose = parent_pose;
  if (const auto& joint = link.parent_joint) {
    result.joint = joint->name;
    result.moving = joint->type != urdf::Joint::FIXED;
    if (result.moving && joint->type != urdf::Joint::CONTINUOUS) {
      throw std::runtime_error("joint '" + joint->name + "' is neither fixed nor continuous");
    }
    result.axis = {btScalar(joint->axis.x), btScalar(joint->axis.y), btScalar(joint->axis.z)};
    result.pose = parent_pose * ToBullet(joint->parent_to_joint_origin_transform);
  }
  ReadInertial(link, &result);
  for (const auto& visual : link.visual_array) {
    Material material;
    if (visual->material) {
      const urdf::Color& c = visual->material->color;
      material.colour = {c.r, c.g, c.b};
      material.texture = visual->material->texture_filename;
    }
    result.visuals.push_back({result.pose * ToBullet(visual->origin),
                              ReadGeometry(visual->geometry.get(), link.name),
                              std::move(material)});
  }
  for (const auto& collision : link.collision_array) {
    Geometry geometry = ReadGeometry(collision->geometry.get(), link.name);
    if (geometry.type == Geometry::Type::kMesh) {
      throw std::runtime_error("link '" + link.name + "' has a mesh as <collision>");
    }
    result.collisions.push_back(
        {result.pose * ToBullet(collision->origin), std::move(geometry), 1.0});
  }
  return result;
}

void ReadTree(const urdf::Link& link, const btTransform& parent_pose, Robot* robot) {
  robot->links.push_back(ReadLink(link, parent_pose));
  const btTransform pose = robot->links.back().pose;
  for (const auto& child : link.child_links) ReadTree(*child, pose, robot);
}

}  // namespace

const RobotLink& Robot::MovedBy(const std::string& joint) const {
  for (const RobotLink& link : links) {
    if (link.moving && link.joint == joint) return link;
  }
  throw std::runtime_error("robot '" + name + "' has no moving joint '" + joint + "'");
}

Robot LoadRobot(const std::string& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  if (!stream) throw std::runtime_error("cannot read the robot '" + file + "'");
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model || !model->getRoot()) {
    throw std::runtime_error("cannot read the robot '" + file + "': it is not a valid URDF");
  }
  try {
    Robot robot;
    robot.name = model->getName();
    ReadTree(*model->getRoot(), btTransform::getIdentity(), &robot);
    return robot;
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error("cannot read the robot '" + file + "': " + problem.what());
  }
}

}  // namespace tld_follower::sim
