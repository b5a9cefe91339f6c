// Two cursors over the traces: each stands at a sample, and the readout shows both, their difference, and 1/dt.

import { number } from "./canvas.js";
import { shownSignals } from "./signals.js";

const NAMES = ["a", "b"], STEP_S = 0.02, DECIMALS_S = 3;
const find = (id) => document.getElementById(id);
export const cursors = { on: false, ages: [4, 2] }; // how long before the last sample each cursor is, s

// Returns the place of the sample that is nearest to the age of a cursor; -1 if there is none.
export function placeOf(samples, age) {
  if (!samples.length) return -1;
  const time = samples[samples.length - 1][0] - age;
  let low = 0, high = samples.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (samples[middle][0] < time) low = middle + 1;
    else high = middle;
  }
  const before = Math.max(low - 1, 0);
  return time - samples[before][0] < samples[low][0] - time ? before : low;
}

function move(which, age, shownS) {
  cursors.ages[which] = Math.min(Math.max(age, 0), shownS);
  find(`cursor-${NAMES[which]}`).value = -cursors.ages[which];
}

// Lets the cursors be moved by their sliders, and by a drag over the drawing. `ageAt` returns the age at a place of
// the drawing; `say` writes the readout at once.
export function beginCursors(canvas, shownS, ageAt, say) {
  NAMES.forEach((name, which) => {
    const slider = find(`cursor-${name}`);
    Object.assign(slider, { min: -shownS, max: 0, step: STEP_S, value: -cursors.ages[which] });
    slider.addEventListener("input", () => {
      move(which, -Number(slider.value), shownS);
      say();
    });
  });
  find("cursors").addEventListener("click", () => {
    cursors.on = !cursors.on;
    find("cursors").setAttribute("aria-pressed", cursors.on);
    find("measure").hidden = !cursors.on;
    canvas.classList.toggle("measured", cursors.on);
    say();
  });
  let held = null;
  const drag = (event) => {
    if (held === null) return;
    move(held, ageAt(event.offsetX), shownS);
    say();
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (!cursors.on) return;
    canvas.setPointerCapture(event.pointerId);
    const away = cursors.ages.map((age) => Math.abs(age - ageAt(event.offsetX)));
    held = away[0] <= away[1] ? 0 : 1;
    drag(event);
  });
  canvas.addEventListener("pointermove", drag);
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (held = null));
}

// Returns what the cursors show of samples: their times before the last one, s, the difference, and 1/dt in Hz, all
// null without samples; and a row of values for each signal that is shown, in its unit.
export function measured(samples) {
  const [a, b] = cursors.ages.map((age) => samples[placeOf(samples, age)]);
  if (!a) return null;
  const last = samples[samples.length - 1][0], dt = b[0] - a[0];
  const rows = shownSignals().map(({ name, unit, column, scale, decimals }) => {
    return { name, unit, decimals, a: a[column] * scale, b: b[column] * scale };
  });
  return { times: [a[0] - last, b[0] - last], dt, hz: dt ? 1 / Math.abs(dt) : null, rows };
}

function row(cells) {
  const line = document.createElement("tr");
  cells.forEach((text, place) => {
    const cell = document.createElement(place ? "td" : "th");
    if (!place) cell.scope = "row";
    cell.textContent = text;
    line.append(cell);
  });
  return line;
}

// Writes the readout, and what the sliders say to who does not see them.
export function sayCursors(samples) {
  if (!cursors.on) return;
  const found = measured(samples);
  if (!found) return find("readout").replaceChildren(row(["no samples yet", "", "", ""]));
  const { times, dt, hz, rows } = found;
  const hertz = hz === null ? "\u2013" : `${number(hz, 3)}`;
  find("readout").replaceChildren(
    row(["time, s", ...[...times, dt].map((time) => number(time, DECIMALS_S))]),
    row(["1/\u0394t, Hz", "", "", hertz]),
    ...rows.map(({ name, unit, decimals, a, b }) => {
      return row([`${name}, ${unit}`, ...[a, b, b - a].map((value) => number(value, decimals))]);
    }),
  );
  const difference = `difference ${number(dt, DECIMALS_S)} s, ${hertz} Hz`;
  NAMES.forEach((name, which) => {
    const values = rows.map((each) => `${each.name} ${number(each[name], each.decimals)} ${each.unit}`);
    const text = [`${number(times[which], DECIMALS_S)} s`, ...values, difference].join(", ");
    find(`cursor-${name}`).setAttribute("aria-valuetext", text);
  });
}
