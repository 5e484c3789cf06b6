"""A bridge to ROS 2: what sensors measured as topics, velocities as inputs. Needs rclpy: see docs/ros2.md."""

from .bridge import Bridge

__all__ = ["Bridge"]
