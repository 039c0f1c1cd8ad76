// What people set: inputs, where cosine and sine of an angle are one, and how fast they may move.

const DEGREES = 180 / Math.PI;

function plainChannel(input, index) {
  return {
    ...input,
    turns: false,
    read: (row) => row[index],
    write: (value, row) => {
      row[index] = value;
    },
  };
}

/** An angle in degrees, in place of its cosine and sine. */
function angleChannel(cosine, sine, index) {
  const read = (row) => Math.atan2(row[index + 1], row[index]) * DEGREES;
  return {
    name: `${cosine.name}, ${sine.name}`,
    description: cosine.description.replace(/^cosine of (the )?/, ""),
    unit: "°",
    low: -180,
    high: 180,
    start: Math.atan2(sine.start, cosine.start) * DEGREES,
    turns: true,
    read,
    write: (value, row) => {
      row[index] = cosine.high * Math.cos(value / DEGREES);
      row[index + 1] = cosine.high * Math.sin(value / DEGREES);
    },
  };
}

/** The channels of a surrogate's inputs. */
export function channelsOf(facts) {
  return facts.inputs.flatMap((input, index) => {
    if (input.angle === "sine") {
      return [];
    }
    const angle = input.angle === "cosine";
    return [angle ? angleChannel(input, facts.inputs[index + 1], index) : plainChannel(input, index)];
  });
}

/** The shortest way from one value of a channel to another. */
export function distanceOf(channel, from, to) {
  const way = to - from;
  return channel.turns ? way - 360 * Math.round(way / 360) : way;
}

/**
 * How fast inputs that move may do so: { speed, acceleration }, those of a stored record; null for
 * inputs that jump, since they are held over a step. Without a record, they cross their range
 * within the time in which outputs and errors know their past.
 */
export function limitsOf(channel, facts, record) {
  if (facts.hold === "zero_order") {
    return null;
  }
  if (record === null) {
    const speed = (channel.high - channel.low) / facts.past;
    return { speed, acceleration: (10 * speed) / facts.past };
  }
  const values = record.rows.map((row) => channel.read(row));
  const steps = values.slice(1).map((value, k) => distanceOf(channel, values[k], value));
  const bends = steps.slice(1).map((value, k) => value - steps[k]);
  const most = (list) => list.reduce((least, value) => Math.max(least, Math.abs(value)), 1e-9);
  return { speed: most(steps) / facts.step, acceleration: most(bends) / facts.step ** 2 };
}

/** A Follower moves a channel to its target, no faster than it may. */
export class Follower {
  constructor(channel, limits) {
    this.channel = channel;
    this.limits = limits;
    this.value = channel.start;
    this.speed = 0;
  }

  /** Stands still at a value. */
  place(value) {
    this.value = value;
    this.speed = 0;
  }

  /** Goes on for a time in s; the value then. */
  advance(target, seconds) {
    const way = distanceOf(this.channel, this.value, target);
    if (this.limits === null) {
      this.value += way;
      return this.value;
    }
    const { speed, acceleration } = this.limits;
    const size = Math.abs(way);
    const braking = Math.sqrt(2 * 0.8 * acceleration * size);
    const wanted = Math.sign(way) * Math.min(speed, braking, size / seconds);
    const most = acceleration * seconds;
    this.speed += Math.min(Math.max(wanted - this.speed, -most), most);
    this.value += this.speed * seconds;
    return this.value;
  }
}
