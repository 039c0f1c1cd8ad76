// What people move: the pad, a slider for every input, physical parameters, the confidence.

import { byId } from "../../../core/web/modules/elements.js";
import { Pad } from "./pad.js";
import { Slider } from "./sliders.js";

/** A Panel calls `changed.target(index, value)`, `.parameter(index, value)`, `.confidence(value)`. */
export class Panel {
  constructor(facts, channels, changed) {
    this.sliders = channels.map(
      (channel, i) => new Slider(channel, (value) => changed.target(i, value)),
    );
    this.pad = new Pad(channels, changed.target);
    byId("pad").append(this.pad.block);
    byId("sliders").append(...this.sliders.map((slider) => slider.block));
    this.settings = facts.parameters.map(
      (parameter, i) => new Slider(parameter, (value) => changed.parameter(i, value)),
    );
    if (facts.confidence !== null) {
      const what = { ...facts.confidence, name: "confidence of the bound", unit: "1" };
      this.settings.push(new Slider(what, changed.confidence));
    }
    byId("parameters").append(...this.settings.map((slider) => slider.block));
  }

  /** Shows physical parameters and the confidence. */
  showSettings(parameters, confidence) {
    const values = [...parameters, confidence];
    this.settings.forEach((slider, i) => slider.show(values[i]));
  }

  /** Shows where the inputs are set to. */
  show(targets) {
    targets.forEach((value, i) => this.sliders[i].show(value));
    this.pad.show(targets);
  }
}
