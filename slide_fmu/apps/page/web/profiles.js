// How far a move from rest to rest has come, after a share of its time: slide_fmu/excitation/speed_profile.py.

/** Smallest share of a ramp of acceleration in its phase. */
export const LEAST_ROUNDED = 0.02;

/** A Profile speeds up and slows down for shares of its time; rounded: how much of these is jerk. */
export class Profile {
  constructor(speeding, slowing, rounded) {
    const [ramp, speed] = [Math.max(rounded, LEAST_ROUNDED) / 2, 1 / (1 - (speeding + slowing) / 2)];
    const [up, down] = [speed / (speeding * (1 - ramp)), speed / (slowing * (1 - ramp))];
    this.speeding = speeding;
    this.peaks = [speed, Math.max(up, down), Math.max(up / speeding, down / slowing) / ramp];
    this.jumps = [[0, speeding, up], [1 - slowing, slowing, -down]].flatMap(([begin, length, height]) => {
      const jerk = height / (ramp * length);
      const shares = [[0, jerk], [ramp, -jerk], [1 - ramp, -jerk], [1, jerk]];
      return shares.map(([share, size]) => [begin + share * length, size / 6]);
    });
  }

  /** The distance, 0 to 1, after a share of the time. */
  way(done) {
    const past = Math.min(done, 1);
    let way = 0;
    for (const [begin, size] of this.jumps) {
      way += past > begin ? size * (past - begin) ** 3 : 0;
    }
    return way;
  }

  /** The shortest time in s over distances within limits, { speed, acceleration } for each. */
  leastTime(ways, limits) {
    let least = 0;
    ways.forEach((way, i) => {
      if (limits[i] !== null) {
        const { speed, acceleration } = limits[i];
        const size = Math.abs(way);
        const slow = (this.peaks[0] * size) / speed;
        least = Math.max(least, slow, Math.sqrt((this.peaks[1] * size) / acceleration));
      }
    });
    return least;
  }
}

/** The fastest symmetric profile over distances within limits: the best of a grid. */
export function fastestProfile(ways, limits) {
  let [best, least] = [null, Infinity];
  for (let k = 0; k < 100; k += 1) {
    const ramp = 0.01 * 50 ** (k / 99);
    const profile = new Profile(ramp, ramp, LEAST_ROUNDED);
    const time = profile.leastTime(ways, limits);
    if (time < least) {
      [best, least] = [profile, time];
    }
  }
  return best;
}
