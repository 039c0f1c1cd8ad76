"""The feed-forward family: its network, its byte layout, its gradient."""

from slide_fmu.network.feed_forward.network import (
    FeedForward,
    Layer,
    SlidingWindow,
    check_ages,
)

__all__ = ["FeedForward", "Layer", "SlidingWindow", "check_ages"]
