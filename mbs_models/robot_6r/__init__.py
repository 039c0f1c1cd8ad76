"""The robot is a Puma 560 on a flexible socket; it follows six desired joint angles."""

from mbs_models.robot_6r.robot_6r import Robot6R

__all__ = ["Robot6R"]
