// The page of one surrogate: live, over its stored trajectory, over a user's record.

import { watchButtons, WAYS } from "./buttons.js";
import { channelsOf, limitsOf } from "./channels.js";
import { differenceTo, storedCourse } from "./course.js";
import { watchFiles } from "./files.js";
import { byId } from "../../../core/web/modules/elements.js";
import { Drag } from "./drag.js";
import { Live } from "./live.js";
import { Moves } from "./moves.js";
import { MovesCard } from "./moves_card.js";
import { Optimiser } from "./optimiser.js";
import { Panel } from "./panel.js";
import { Player } from "./player.js";
import { Session } from "./session.js";
import { Address, takeState } from "./state.js";
import { beginTheme } from "../../../core/web/modules/theme.js";
import { Tour } from "./tour.js";
import { View } from "./view.js";

// the machine is drawn in every frame, all else less often: that takes longer, and is read slowly
const REDRAWN = 1000 / 15;

// moves last a second or two: they are shown slowly
const MOVES_PACE = 0.4;

/** An App does what people ask for. */
export class App {
  constructor(facts, machine, files, drawing) {
    this.facts = facts;
    this.session = new Session(machine, facts);
    this.files = files;
    this.channels = channelsOf(facts);
    this.parameters = facts.parameters.map((parameter) => parameter.start);
    this.confidence = facts.confidence?.start ?? 0;
    this.courses = { own: null };
    if (facts.trajectory !== null) {
      this.courses.stored = storedCourse(facts, files);
    }
    this.moves = facts.moves === null ? null : new Moves(facts, facts.moves);
    this.movesCard = new MovesCard(byId("moves-plot"));
    const limits = this.channels.map((channel) => limitsOf(channel, facts, this.courses.stored ?? null));
    this.optimiser = new Optimiser(this, limits);
    const tour = facts.trajectory === null ? null : new Tour(this.channels, this.courses.stored, facts);
    this.live = new Live(this.session, facts, this.channels, limits, tour);
    this.player = new Player();
    this.address = new Address(this);
    this.panel = new Panel(facts, this.channels, {
      target: (i, value) => this.setTarget(i, value),
      parameter: (i, value) => {
        this.parameters[i] = value;
        this.settings();
      },
      confidence: (value) => {
        this.confidence = value;
        this.settings();
      },
    });
    this.grip = drawing === null ? null : new Drag(byId("drawing-canvas"), this);
    this.view = new View(facts, this.channels, { point: (time) => this.point(time), wish: () => this.wish() }, drawing);
  }

  begin() {
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    watchButtons(this);
    this.wander(!still);
    const { way, time } = takeState(this, location.hash);
    this.panel.show(this.live.targets);
    this.panel.showSettings(this.parameters, this.confidence);
    watchFiles(this);
    beginTheme(() => this.wish());
    new ResizeObserver(() => this.wish()).observe(byId("plots"));
    this.choose(way in this.courses || (way === "moves" && this.optimiser.possible) ? way : "live");
    if (Number.isFinite(time)) {
      this.point(time);
    }
    requestAnimationFrame((now) => this.frame(now));
  }

  /** The record that is shown, once the surrogate has answered it; null when there is none. */
  get course() {
    return this.courses[this.way] ?? null;
  }

  /** Goes to one of the ways. */
  choose(way) {
    this.way = way;
    document.body.dataset.way = way;
    WAYS.forEach((name) => byId(`way-${name}`).setAttribute("aria-pressed", String(name === way)));
    this.restart();
    this.optimiser.enter(way);
    this.play(way === "live" || way === "moves");
  }

  /** Takes moves over, and plays them. */
  showMoves(moves) {
    this.moves = moves;
    this.restart();
    this.player.go(moves.xRange[0]);
    this.play(true);
  }

  /** What the player plays: a record, or moves; null when there is neither. */
  get played() {
    return this.way === "moves" ? this.moves : this.course;
  }

  play(on) {
    this.playing = on && (this.way === "live" || this.played !== null);
    byId("play").textContent = this.playing ? "Pause" : "Play";
    if (this.playing && this.played !== null && this.player.atEnd) {
      this.player.go(this.played.xRange[0]);
    }
  }

  wander(on) {
    this.live.letWander(on);
    byId("wander").checked = on;
  }

  /** Starts the run of the present way anew. */
  restart() {
    byId("save").disabled = this.course === null;
    this.attempt(() => {
      if (this.way === "live") {
        this.live.restart(this.parameters, this.confidence);
      } else if (this.played !== null) {
        this.answer(this.played);
        this.player.take(this.played);
      }
    });
    this.wish();
  }

  /** Lets the surrogate answer a record, or moves. */
  answer(course) {
    if (course === this.moves) {
      course.run(this.session, this.facts, this.parameters, this.confidence);
      this.movesCard.say(this.moves);
      return;
    }
    const given = this.facts.parameters.map(
      (parameter, i) => course.parameters?.[parameter.name] ?? this.parameters[i],
    );
    course.run(this.session, this.facts, given, this.confidence);
    const stored = course === this.courses.stored;
    const difference = stored ? differenceTo(this.files.results, course, this.facts) : null;
    this.view.showErrors(course, difference);
  }

  /** Takes over parameters and confidence. */
  settings() {
    this.attempt(() => {
      if (this.way === "live") {
        this.session.set(this.parameters, this.confidence);
      } else if (this.played !== null) {
        this.answer(this.played);
      }
    });
    this.wish();
  }

  setTarget(index, value) {
    this.live.targets[index] = value;
    this.wander(false);
    this.panel.show(this.live.targets);
    this.optimiser.chooseGoal();
    this.wish();
  }

  /** Marks a time of a record, where people point at one. */
  point(time) {
    if (this.played !== null && time !== null) {
      this.play(false);
      this.player.go(time);
      this.wish();
    }
  }

  /** Does something; what goes wrong is shown. */
  attempt(action) {
    const problem = byId("problem");
    try {
      action();
      problem.hidden = true;
    } catch (error) {
      problem.textContent = error.message;
      problem.hidden = false;
      this.play(false);
    }
  }

  /** Asks for a drawing in the next frame. */
  wish() {
    this.wished = true;
  }

  frame(now) {
    const seconds = (now - (this.before ?? now)) / 1000;
    this.before = now;
    if (this.optimiser.searching) {
      this.attempt(() => this.optimiser.goOn());
    }
    if (this.playing) {
      this.goOn(seconds);
    }
    // a frame comes a little early or late
    const whole = this.wished && !(now - this.redrawn < 0.9 * REDRAWN);
    if (whole) {
      this.address.write(now);
      this.wished = false;
      this.redrawn = now;
    }
    if (whole || this.playing) {
      this.draw(whole);
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  goOn(seconds) {
    if (this.way === "live") {
      this.attempt(() => this.live.advance(seconds));
    } else {
      this.player.go(this.player.time + seconds * (this.way === "moves" ? MOVES_PACE : 1));
      if (this.player.atEnd) {
        this.play(false);
      }
    }
    this.wish();
  }

  /** Draws what is shown now; not whole: the machine alone. */
  draw(whole) {
    if (this.way === "live") {
      this.view.drawLive(this.live, this.parameters, this.confidence, whole);
      if (whole) {
        this.panel.show(this.live.targets);
      }
    } else if (this.way === "moves" && this.optimiser.open) {
      this.view.drawPose(this.optimiser.goalRow, this.parameters);
    } else if (this.way === "moves") {
      this.view.drawMoves(this.player, this.movesCard, whole);
    } else if (this.course !== null) {
      this.view.drawCourse(this.player, this.confidence, whole);
    } else {
      this.view.clear();
    }
  }
}
