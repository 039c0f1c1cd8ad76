// The lamp: whether what the surrogate says now can be trusted, by its own signs.

import { byId, write } from "../../../core/web/modules/elements.js";
import { digits } from "../../../core/web/modules/units.js";

/** What the signs of an answer mean: { state, sign, title, text }. */
export function verdictOf(flags) {
  const bounded = "in_domain" in flags;
  const filled = Math.min(flags.window_filled, flags.error_bound_filled ?? 1);
  const estimated = flags.error_estimate_filled ?? 1;
  const good = bounded ? flags.in_domain === 1 : flags.inputs_in_range === 1;
  const novelty = bounded ? ` Novelty ${digits(flags.novelty)}; the edge is at 1.` : "";
  const part = (share) => `${Math.floor(100 * share)} %`;
  const rest = estimated < 1 ? ` The error estimate knows ${part(estimated)} of its past.` : "";
  if (!good) {
    return {
      state: "bad",
      sign: "▲",
      title: bounded ? "outside the domain" : "outside the range",
      text: `${bounded ? "The inputs are unlike those of the calibration: do not rely on the error bound." : "An input left the range of the training."}${novelty}`,
    };
  }
  if (filled < 1) {
    return {
      state: "wait",
      sign: "○",
      title: `${part(filled)} of the past is known`,
      text: `Until then, the first input counts as held for ever before.${novelty}`,
    };
  }
  if (bounded && flags.trusted !== 1) {
    return {
      state: "bad",
      sign: "▲",
      title: "may be wrong",
      text: `An error bound exceeds its tolerance, or an output left the range of the training.${novelty}`,
    };
  }
  return {
    state: "good",
    sign: "●",
    title: bounded ? "trusted" : "inside the range",
    text: bounded
      ? `Error bounds are within their tolerances. The inputs are like those of the calibration.${novelty}${rest}`
      : `All inputs lie in their ranges; that alone makes no output right.${rest}`,
  };
}

/** Shows the signs of an answer; what is read out changes only when the verdict does. */
export function showLamp(flags) {
  const { state, sign, title, text } = verdictOf(flags);
  const lamp = byId("lamp");
  if (lamp.dataset.state !== state) {
    lamp.dataset.state = state;
    byId("lamp-spoken").textContent = state === "wait" ? "the past is not known yet" : title;
  }
  write(byId("lamp-sign"), sign);
  write(byId("lamp-title"), title);
  write(byId("lamp-text"), text);
}
