"""Moves along a route, from profiles and shapers, are sampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.motion.response import Response
from slide_fmu.apps.motion.shapers import NONE, Shaper
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.speed_profile import SpeedProfiles


def shares(
    response: Response,
    profiles: SpeedProfiles,
    times: FloatArray,
    delays: FloatArray,
    parts: FloatArray,
) -> FloatArray:
    """Sample shares of the route of B moves, (B, count).

    Args:
        response: gives the samples.
        profiles: B profiles.
        times: their times in s, (B,).
        delays, parts: impulses of a shaper for each, in s and as shares of 1, (B, n).
    """
    sampled = np.zeros((len(times), response.count))
    for index in range(delays.shape[1]):
        past = response.time[None] - delays[:, index, None]
        sampled += parts[:, index, None] * profiles.way(np.maximum(past, 0.0) / times[:, None])
    return sampled


def shaped_shares(
    response: Response, profile: SpeedProfiles, time: float, shaper: Shaper = NONE
) -> FloatArray:
    """Sample a profile of a given time in s with a shaper: route shares, (count,)."""
    rows = shaper.delays[None], shaper.parts[None]
    return np.asarray(shares(response, profile, np.array([time]), *rows)[0])


def arrivals(response: Response, times: FloatArray, delays: FloatArray) -> NDArray[np.intp]:
    """Return the samples at which moves of times in s, (B,), and delays (B, n) come to rest."""
    done = times + delays.max(axis=1)
    return np.asarray(np.searchsorted(response.time, done - 1e-9 * response.step))
